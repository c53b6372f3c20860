"""Samples that were lost and whose time was filled in, and old ones that were written again: no time stamp shows them.

Where one sample of a moving arm is lost and the time stamps run on evenly, all joints advance twice as far from one row
to the next; where one is repeated, none advances. The step of all joints is compared with that of the rows to either
side, as a share of it:

    share = sum_j s_j m_j / sum_j m_j^2         s_j the step of joint j, m_j the median of the steps beside it

A share of 3 is two samples lost. Where the shares of all such steps are whole numbers, time stamps can be restored.

Stamps that jitter are those of samples taken at these very times, or late ones of samples taken evenly. Speeds are
smoother the right way, and steps are judged that way.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Severity
from ident.diagnosis.samples.noise import position_noise, position_quanta
from ident.observation.observation import ObserveOptions
from ident.recordings.intervals import intervals_of
from ident.recordings.recording import LARGEST_GAP, Recording
from ident.support.arrays import Array, Indices, Mask

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


PLAIN = 0.25
"""Deviation from a whole number of samples up to which the number lost is plain."""
SHOWN = 0.9
"""Share of the rows at which one lost sample must show: as many of those lost get their time back."""
SAME = 1e-9
"""Difference of intervals, as a share of one, that is rounding of the time stamps."""


@dataclass(frozen=True, slots=True, eq=False)
class TimestampAnomalies:
    """Rows whose step is not that of their neighbours.

    Attributes:
        long: Rows, from 0, after which all joints advance too far.
        lost: Samples that were lost after each of these, 0 where their number is not plain.
        still: Rows, from 0, after which none advances although the arm moves.
        shown: Share of the rows at which one lost sample would show.
    """

    long: Indices
    lost: Indices
    still: Indices
    shown: float

    @property
    def plain(self) -> bool:
        """Whether samples were lost, it shows where, and everywhere how many."""
        return self.shown > SHOWN and len(self.lost) > 0 and bool((self.lost > 0).all())


@lru_cache(maxsize=8)
def timestamp_anomalies(recording: Recording) -> TimestampAnomalies:
    """Steps of all joints together that are too long, or none at all, for the time that they take."""
    clock = intervals_of(recording.t)
    step = np.diff(recording.q, axis=0)  # (N - 1, n)
    rounding = np.array([step or np.finfo(float).eps for step in position_quanta(recording)]) / np.sqrt(12.0)
    sigma = np.sqrt(2.0) * np.hypot(position_noise(recording), rounding) / clock.usual
    even = np.asarray(clock.usual * (1.0 + clock.missing), np.float64)
    interval, rate, usual = _smoother(np.diff(recording.t), even, step, sigma)
    size = np.sum((usual / sigma) ** 2, axis=1)
    share = np.divide(np.sum(rate * usual / sigma**2, axis=1), size, out=np.ones(len(size)), where=size > 0.0)
    sure = (np.abs(share - 1.0) * np.sqrt(size) > SURE) & (np.abs(share - 1.0) > OFF)
    moving = np.abs(usual) > SHOWS * sigma
    own = np.divide(rate, usual, out=np.ones_like(rate), where=moving)
    alike = (np.abs(own - 1.0) > 0.5 * OFF) & ((own > 1.0) == (share > 1.0)[:, None])
    periods = interval / clock.usual
    sure &= np.abs(periods - np.maximum(np.rint(periods), 1.0)) < 0.5 * OFF  # where a stamp is late, so is the step
    sure &= np.sum(alike & moving, axis=1) > MOST * moving.sum(axis=1)  # one coarse encoder steps alone
    unmoved = (step == 0.0).all(axis=1)
    still = sure & unmoved
    long = np.flatnonzero(sure & (share > 1.0) & ~np.concatenate(([False], still[:-1])))  # after old rows it catches up
    lost = (share[long] - 1.0) * periods[long]
    plain = (np.abs(lost - np.rint(lost)) < PLAIN) & (lost < LARGEST_GAP - 1.0)
    return TimestampAnomalies(
        long=long,
        lost=np.where(plain, np.rint(lost), 0).astype(np.intp),
        still=np.flatnonzero(still),
        shown=float(np.mean(np.sqrt(size) > SURE)),
    )


def _smoother(stamped: Array, even: Array, step: Array, sigma: Array) -> tuple[Array, Array, Array]:
    """Intervals of samples that were taken when stamped, or evenly, by which speeds are smoother.

    Returns:
        The intervals, shape (N - 1,), the speeds of the steps, and the median speeds beside them, both (N - 1, n).
    """
    readings = (stamped,) if np.abs(stamped - even).max() < SAME * even.min() else (stamped, even)
    found = [(interval, rate := step / interval[:, None], _beside(rate)) for interval in readings]
    return min(found, key=lambda each: float(np.sum(np.abs(each[1] - each[2]) / sigma)))


def _beside(rate: Array) -> Array:
    """Median speed of the steps to either side of each, itself left out, shape (N - 1, n).

    The eight speeds x_-4 .. x_-1, x_1 .. x_4 are ordered by exchanges of pairs (Knuth, vol. 3, 5.3.4), of which the
    first two rounds compare the same pairs for neighbouring steps.
    """
    found = np.empty(rate.shape[::-1])
    for x, out in zip(rate.T, found, strict=True):
        padded = np.pad(x, APART, mode="edge")
        low, high = _ordered(padded[:-2], padded[2:])
        (a, c), (b, d) = _ordered(low[:-5], low[5:]), _ordered(high[:-5], high[5:])
        second, third = np.maximum(a[:-1], a[1:]), _ordered(b[:-1], b[1:])
        fourth, fifth = _ordered(c[:-1], c[1:]), np.minimum(d[:-1], d[1:])
        upper = np.maximum(np.maximum(third[0], fourth[0]), second)
        lower = np.minimum(np.minimum(third[1], fourth[1]), fifth)
        np.multiply(0.5, lower + upper, out=out)
    return found.T


def _ordered(x: Array, y: Array) -> tuple[Array, Array]:
    return np.minimum(x, y), np.maximum(x, y)


def lost_samples(recording: Recording, _: ObserveOptions | None = None) -> list[Diagnosis]:
    """What positions and currents say of lost and repeated samples."""
    odd = timestamp_anomalies(recording)
    found = [_lost(recording, odd), _repeated(recording, odd)]
    held = 100.0 * float((np.diff(recording.v, axis=0) == 0.0).all(axis=1).mean())
    if held > 100.0 * HELD:
        found.append(
            Diagnosis(
                name="held currents",
                severity=Severity.WEAK,
                sentence=(
                    f"all currents equal those of the row before on {held:.3g} % of the "
                    "rows: v is logged at a lower rate than q"
                ),
                advice="log them at the rate of positions",
                logs=(recording.name,),
                value=held,
                unit="% of the rows",
            )
        )
    return found


def lost_spoilt(recording: Recording) -> Mask:
    """Samples on both sides of lost ones, shape (N, n)."""
    return _beside_steps(recording, timestamp_anomalies(recording).long)


def repeated_spoilt(recording: Recording) -> Mask:
    """Samples that were written again, shape (N, n)."""
    return _beside_steps(recording, timestamp_anomalies(recording).still)


def _beside_steps(recording: Recording, rows: Indices) -> Mask:
    found = np.zeros(recording.q.shape, dtype=np.bool_)
    found[rows] = found[rows + 1] = True
    return found


def _lost(recording: Recording, odd: TimestampAnomalies) -> Diagnosis:
    name, logs = "lost samples", (recording.name,)
    if not len(odd.long):
        return Diagnosis(name=name, sentence="the motion shows no lost samples", logs=logs)
    first = f"first after row {odd.long[0] + 1}, {recording.t[odd.long[0]]:.6g} s"
    if odd.plain:
        many = int(odd.lost.sum())
        return Diagnosis(
            name=name,
            severity=Severity.WEAK,
            sentence=(
                f"{many} {'sample is' if many == 1 else 'samples are'} lost without a gap in the "
                f"time stamps, {first}; stamps corrected"
            ),
            advice="log the controller's own time",
            logs=logs,
            value=float(many),
            unit="samples",
        )
    return Diagnosis(
        name=name,
        severity=Severity.WRONG if len(odd.long) > MANY * len(recording.t) else Severity.WEAK,
        sentence=f"all joints jump ahead {_times(len(odd.long))}, {first}: samples are lost",
        advice="log the controller's own time",
        logs=logs,
        value=float(len(odd.long)),
        unit="jumps",
    )


def _repeated(recording: Recording, odd: TimestampAnomalies) -> Diagnosis:
    name, logs, still = "repeated samples", (recording.name,), odd.still
    if not len(still):
        return Diagnosis(name=name, sentence="no samples are repeated", logs=logs)
    return Diagnosis(
        name=name,
        severity=Severity.WRONG if len(still) > MANY * len(recording.t) else Severity.WEAK,
        sentence=f"positions of a moving arm repeat {_times(len(still))}, first after row {still[0] + 1}, "
        f"{recording.t[still[0]]:.6g} s",
        advice="log each sample once, with its own time",
        logs=logs,
        value=float(len(still)),
        unit="rows",
    )


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"
