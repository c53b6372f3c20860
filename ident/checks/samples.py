"""Samples that a clock does not betray: lost ones whose time was filled in, and old ones that were written again.

Where one sample of a moving arm is lost and the time stamps run on evenly, all joints advance twice as far from one row
to the next; where one is repeated, none advances. The step of all joints is compared with that of the rows to either
side, as a share of it:

    share = sum_j s_j m_j / sum_j m_j^2         s_j the step of joint j, m_j the mean of the steps beside it
"""

from dataclasses import dataclass

import numpy as np

from ident.arrays import Array, Indices
from ident.checks.noise import noise_std, quantum
from ident.checks.remark import Grade, Remark
from ident.recording import Recording

APART = 4
"""Steps to either side whose median speed a step is compared with."""
SURE = 12.0
"""Deviations by noise of the positions that a share must be off by."""
OFF = 0.5
"""Share of a step by which it is too long or too short."""
SHOWS, MOST = 3.0, 0.75
"""Deviations that a joint must move by in a step to show it, and share of such joints that must agree."""
MANY = 0.002
"""Share of the rows from which it is no accident."""
HELD = 0.3
"""Share of rows on which all currents stay as they are, from which they are logged more slowly than positions."""


@dataclass(frozen=True, slots=True, eq=False)
class OddSteps:
    """Rows whose step is not that of their neighbours.

    Attributes:
        long: Rows, from 0, after which all joints advance too far.
        still: Rows, from 0, after which none advances although the arm moves.
    """

    long: Indices
    still: Indices


def odd_steps(recording: Recording) -> OddSteps:
    """Steps of all joints together that are too long, or none at all, for the time that they take."""
    rate = np.diff(recording.q, axis=0) / np.diff(recording.t)[:, None]  # (N - 1, n)
    rounding = np.array([quantum(q) or np.finfo(float).eps for q in recording.q.T]) / np.sqrt(12.0)
    sigma = np.sqrt(2.0) * np.hypot(noise_std(recording.q), rounding) / float(np.median(np.diff(recording.t)))
    usual = _beside(rate)
    size = np.sum((usual / sigma) ** 2, axis=1)
    share = np.divide(np.sum(rate * usual / sigma**2, axis=1), size, out=np.ones(len(size)), where=size > 0.0)
    sure = (np.abs(share - 1.0) * np.sqrt(size) > SURE) & (np.abs(share - 1.0) > OFF)
    moving = np.abs(usual) > SHOWS * sigma
    own = np.divide(rate, usual, out=np.ones_like(rate), where=moving)
    alike = (np.abs(own - 1.0) > 0.5 * OFF) & ((own > 1.0) == (share > 1.0)[:, None])
    sure &= np.sum(alike & moving, axis=1) > MOST * moving.sum(axis=1)  # one coarse encoder steps alone
    unmoved = (np.diff(recording.q, axis=0) == 0.0).all(axis=1)
    return OddSteps(np.flatnonzero(sure & (share > 1.0)), np.flatnonzero(sure & unmoved))


def _beside(rate: Array) -> Array:
    """Median speed of the steps to either side of each, itself left out, shape (N - 1, n)."""
    padded = np.pad(rate, ((APART, APART), (0, 0)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * APART + 1, axis=0)
    return np.median(np.delete(windows, APART, axis=2), axis=2)


def sample_remarks(recording: Recording) -> list[Remark]:
    """What positions and currents say of lost and repeated samples."""
    odd = odd_steps(recording)
    rows = len(recording.t)
    many = MANY * rows
    found = [
        Remark(topic="lost samples", log=recording.name, seen="none by the motion"),
        Remark(topic="repeated samples", log=recording.name, seen="none"),
    ]
    if len(odd.long):
        found[0] = Remark(
            topic="lost samples",
            log=recording.name,
            seen=f"all joints jump ahead {len(odd.long)} times, first after row {odd.long[0] + 1}, "
            f"t = {recording.t[odd.long[0]]:.6g} s",
            grade=Grade.WRONG if len(odd.long) > many else Grade.WEAK,
            advice="time stamps do not show what was lost; log the controller's own time",
        )
    if len(odd.still):
        found[1] = Remark(
            topic="repeated samples",
            log=recording.name,
            seen=f"positions of a moving arm repeated {len(odd.still)} times, first after row {odd.still[0] + 1}, "
            f"t = {recording.t[odd.still[0]]:.6g} s",
            grade=Grade.WRONG if len(odd.still) > many else Grade.WEAK,
            advice="log each sample once, with its own time",
        )
    held = float((np.diff(recording.v, axis=0) == 0.0).all(axis=1).mean())
    if held > HELD:
        found.append(
            Remark(
                topic="held currents",
                log=recording.name,
                seen=f"all currents repeat the row before on {100.0 * held:.3g} % of the rows",
                grade=Grade.WEAK,
                advice="currents are logged more slowly than positions, and late by half of that",
            )
        )
    return found
