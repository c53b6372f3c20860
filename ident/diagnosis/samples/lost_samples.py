"""Lost samples that time stamps do not reveal, and samples that were logged repeatedly.

If one sample of a moving arm is lost and the time stamps remain uniform, all joints advance twice as far from one row
to the next; if one is repeated, none advances. The step of all joints is compared with the steps to each side, as a
ratio:

    share = sum_j s_j m_j / sum_j m_j^2         s_j the step of joint j, m_j the median of the steps beside it

A ratio of 3 means two lost samples. If the ratios of all such steps are whole numbers, time stamps can be corrected.

With jitter, samples were either taken at these times, or taken uniformly and stamped late. The interpretation with the
smoother speeds is used.
"""

from dataclasses import dataclass

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Severity
from ident.diagnosis.samples.noise import position_noise, position_quanta
from ident.observation.observation import ObserveOptions
from ident.recordings.checks import intervals_of
from ident.recordings.recording import LARGEST_GAP, Recording
from ident.support.arrays import Array, Indices, Mask, once_per_object

APART = 4
"""Number of steps to each side whose median speed a step is compared with."""
SURE = 12.0
"""Smallest significant error of a ratio, in standard deviations of position noise."""
OFF = 0.5
"""Relative error of a step that is too long or too short."""
SHOWS, MOST = 3.0, 0.75
"""Smallest step of a joint that is used, in standard deviations of noise, and share of such joints that must agree."""
MANY = 0.002
"""Share of the rows from which it is reported."""
HELD = 0.3
"""Share of rows with unchanged currents, from which these are logged at a lower rate than positions."""


PLAIN = 0.25
"""Largest difference from a whole number of samples for which the number of lost ones is unambiguous."""
SHOWN = 0.9
"""Smallest share of rows at which one lost sample would be detected, so that most lost samples are corrected."""
SAME = 1e-9
"""Relative difference of intervals that is rounding of the time stamps."""


@dataclass(frozen=True, slots=True, eq=False)
class TimestampAnomalies:
    """Rows whose step differs from that of their neighbours.

    Attributes:
        long: Rows, from 0, after which all joints advance too far.
        lost: Number of samples lost after each of these, 0 if ambiguous.
        still: Rows, from 0, after which no joint advances although the arm moves.
        shown: Share of the rows at which one lost sample would be detected.
    """

    long: Indices
    lost: Indices
    still: Indices
    shown: float

    @property
    def plain(self) -> bool:
        """Whether samples were lost, and their places and numbers are unambiguous."""
        return self.shown > SHOWN and len(self.lost) > 0 and bool((self.lost > 0).all())


@once_per_object
def timestamp_anomalies(recording: Recording) -> TimestampAnomalies:
    """Find steps of all joints together that are too long, or zero, for their time interval."""
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
    sure &= np.abs(periods - np.maximum(np.rint(periods), 1.0)) < 0.5 * OFF  # a late stamp makes a long interval
    sure &= np.sum(alike & moving, axis=1) > MOST * moving.sum(axis=1)  # one coarse encoder does not count
    unmoved = (step == 0.0).all(axis=1)
    still = sure & unmoved
    long = np.flatnonzero(sure & (share > 1.0) & ~np.concatenate(([False], still[:-1])))  # after repeats
    lost = (share[long] - 1.0) * periods[long]
    plain = (np.abs(lost - np.rint(lost)) < PLAIN) & (lost < LARGEST_GAP - 1.0)
    return TimestampAnomalies(
        long=long,
        lost=np.where(plain, np.rint(lost), 0).astype(np.intp),
        still=np.flatnonzero(still),
        shown=float(np.mean(np.sqrt(size) > SURE)),
    )


def _smoother(stamped: Array, even: Array, step: Array, sigma: Array) -> tuple[Array, Array, Array]:
    """Select the intervals, as stamped or uniform, with the smoother speeds.

    Returns:
        The intervals, shape (N - 1,), the speeds of the steps, and the median speeds of their neighbours, both (N - 1,
        n).
    """
    readings = (stamped,) if np.abs(stamped - even).max() < SAME * even.min() else (stamped, even)
    found = [(interval, rate := step / interval[:, None], _beside(rate)) for interval in readings]
    return min(found, key=lambda each: float(np.sum(np.abs(each[1] - each[2]) / sigma)))


def _beside(rate: Array) -> Array:
    """Median speed of the steps to each side of every step, without the step itself, shape (N - 1, n).

    The eight speeds x_-4 .. x_-1, x_1 .. x_4 are sorted by a network (Knuth, vol. 3, 5.3.4) whose first two rounds
    compare the same pairs for neighbouring steps.
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
    """Check positions and currents for lost and repeated samples."""
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
    """Mask of samples on both sides of lost ones, shape (N, n)."""
    return _beside_steps(recording, timestamp_anomalies(recording).long)


def repeated_spoilt(recording: Recording) -> Mask:
    """Mask of repeated samples, shape (N, n)."""
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
