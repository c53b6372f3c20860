"""Recordings, the log of a robot's controller for one motion, and motions: recordings with payloads."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from ident.numerics.splines import CubicSpline
from ident.payload.payload import Payload
from ident.support.arrays import Array, numbers, once_per_object
from ident.support.errors import PayloadError, RecordingError, placed

LARGEST_GAP = 10.0
"""Sampling interval relative to the median above which samples are missing instead of late."""
LARGEST_POSITION, LARGEST_CURRENT = 1e6, 1e12
"""Largest plausible position [rad or m] and current [any drive unit]; their squares are finite."""
FEW = 10
"""Number of samples below which a channel that is constant says nothing."""
JITTER_TOL = 1e-3
"""Relative deviation of a sampling interval from the mean above which a clock has jitter."""
MARKS = 64
"""Number of stored hashes of a recording: a copy of a tenth of its rows has three of them in 96 of 100 cases."""
ABSOLUTE = 1e8
"""Smallest time stamp [s] of an absolute clock, from 1970; three years for a clock that starts with its motion."""


@dataclass(frozen=True, slots=True, weakref_slot=True, eq=False, repr=False)
class Recording:
    """The log of one motion by the robot's controller. Checked at creation; the arrays are read-only.

    Attributes:
        t: Sample times [s], shape (N,), strictly increasing.
        q: Joint positions [rad or m], shape (N, n).
        v: Current references [drive units], shape (N, n).
        name: Name of its source, for messages.

    Raises:
        RecordingError: If shapes disagree, a value is not finite, time does not increase, or it is too short.
    """

    t: Array
    q: Array
    v: Array
    name: str = "recording"

    def __post_init__(self) -> None:
        """Check and freeze the arrays."""
        with placed(self.name):
            for field in ("t", "q", "v"):
                try:
                    object.__setattr__(self, field, numbers(getattr(self, field)))
                except (TypeError, ValueError) as error:
                    reason = str(error).splitlines()[0]
                    raise RecordingError(f"{field} is not an array of numbers: {reason}") from error
            _check(self)

    def __repr__(self) -> str:
        """Return name, number of joints and length."""
        return f"Recording {self.name!r}: {self.n} joints, {len(self.t)} samples in {self.t[-1] - self.t[0]:.4g} s"

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.q.shape[1]

    @property
    def period(self) -> float:
        """Mean sampling interval [s]."""
        return float(self.t[-1] - self.t[0]) / (len(self.t) - 1)

    @property
    def jitter(self) -> float:
        """Largest deviation of a sampling interval from their mean, as a share of it."""
        return float(np.abs(np.diff(self.t) / self.period - 1.0).max())


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A recording and its payload.

    Attributes:
        payload: The specified payload, None for a bare flange. Recordings of one mounting share one object, and thus
            its unknown parameters.
    """

    recording: Recording
    payload: Payload | None = None


def motions_of(logs: object) -> tuple[Motion, ...]:
    """Return motions of an iterable of these, or of recordings with a bare flange; raises `RecordingError`."""
    expected = "expected motions from ident.read, at least one"
    if not isinstance(logs, Iterable) or isinstance(logs, str):
        raise RecordingError(f"logs are {type(logs).__name__}; {expected}")
    found = list[Motion]()
    for k, each in enumerate(cast("Iterable[object]", logs)):
        motion = Motion(each) if isinstance(each, Recording) else each
        if not isinstance(motion, Motion):
            raise RecordingError(f"log {k + 1} is {type(each).__name__}; {expected}")
        if not isinstance(motion.payload, Payload | None):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise PayloadError(f"payload of log {k + 1} is {type(motion.payload).__name__}; expected a Payload or None")
        found.append(motion)
    if not found:
        raise RecordingError(f"there are no logs; {expected}")
    return tuple(found)


NO_JOINT = "; to leave out a gripper or another column that is not a joint of the arm, name the others: q=NAME[{0..5}]"
"""Partial reading of columns of arrays."""


def resampled(recording: Recording) -> Recording:
    """Return the recording on a uniform clock of the same mean rate: q by cubic spline, v by linear interpolation.

    A recording whose clock is uniform within `JITTER_TOL` is returned unchanged. Raises `RecordingError` if samples
    are missing, as gaps are not interpolated.
    """
    if recording.jitter <= JITTER_TOL:
        return recording
    return _resampled(recording)


@once_per_object
def _resampled(recording: Recording) -> Recording:
    intervals = np.diff(recording.t)
    worst = int(intervals.argmax())
    if intervals[worst] > LARGEST_GAP * np.median(intervals) or len(intervals) < 4:
        raise RecordingError(
            f"samples are missing: {intervals[worst]:.3g} s pass from row {worst + 1} to the next, usually "
            f"{np.median(intervals):.3g} s; use the part before or after the gap",
            recording.name,
        )
    t = np.linspace(recording.t[0], recording.t[-1], len(recording.t))
    q = CubicSpline.through(recording.t, recording.q)(t)
    v = np.column_stack([np.interp(t, recording.t, each) for each in recording.v.T])
    return Recording(t, q, v, recording.name)


def in_order_of_time(motions: Sequence[Motion]) -> tuple[Motion, ...]:
    """Return motions sorted by their first samples if all have absolute time, otherwise in the given order."""
    absolute = all(motion.recording.t[0] >= ABSOLUTE for motion in motions)
    return tuple(sorted(motions, key=lambda motion: motion.recording.t[0]) if absolute else motions)


def share_samples(one: Recording, other: Recording) -> bool:
    """Return whether two recordings have rows in common, as of a motion that is given twice, whole or in part.

    Noise makes each row unique, up to the digits that a file may lack. Rows that repeat, as of an arm at rest, are
    ignored, and so is 1 % of common rows, as of few joints by chance, or where a log was split.
    """
    if one.n != other.n:
        return False
    first, second = _unique_rows(one), _unique_rows(other)
    common = len(np.intersect1d(first, second, assume_unique=True))
    return common > max(1.0, 0.01 * min(len(first), len(second)))


def row_marks(recording: Recording) -> tuple[str, ...]:
    """Return the `MARKS` smallest hashes of rows, hexadecimal, of which a part or thinned copy has its share."""
    return tuple(f"{int(each):016x}" for each in _unique_rows(recording)[:MARKS])


def has_marks(recording: Recording, marks: Sequence[str]) -> bool:
    """Return whether a recording has rows of the one with these marks: three, as two may be common by chance."""
    return len(np.intersect1d(_unique_rows(recording), np.array([int(each, 16) for each in marks], np.uint64))) > 2


@once_per_object
def _unique_rows(recording: Recording) -> NDArray[np.uint64]:
    """Return hashes of the rows that do not repeat, of 12 bits (3.6 digits) of each number."""
    fraction, power = np.frexp(np.hstack((recording.q, recording.v)))
    rounded = np.ldexp(np.rint(np.ldexp(fraction, 12)), power - 12) + 0.0  # also for -0.0
    found = np.zeros(len(rounded), np.uint64)
    for column in np.ascontiguousarray(rounded.T).view(np.uint64):
        found = (found ^ column) * np.uint64(0x9E3779B97F4A7C15)
        found ^= found >> np.uint64(29)
    value, count = np.unique(found, return_counts=True)
    return value[count == 1]


def _check(recording: Recording) -> None:
    t, q, v = recording.t, recording.q, recording.v
    if t.ndim != 1 or q.ndim != 2 or v.shape != q.shape or len(t) != len(q):
        raise RecordingError(
            f"t, q and v have shapes {t.shape}, {q.shape} and {v.shape}; expected (N,), (N, n) and (N, n)"
        )
    if q.shape[1] == 0:
        raise RecordingError("the recording has no joint")
    for kind, values, largest in (
        ("t", t[:, None], float(np.finfo(np.float64).max)),
        ("q", q, LARGEST_POSITION),
        ("v", v, LARGEST_CURRENT),
    ):
        bad = np.argwhere(~(np.abs(values) <= largest))
        if len(bad):
            row, joint = bad[0].tolist()
            value, channel = float(values[row, joint]), kind if kind == "t" else f"{kind}{joint + 1}"
            where = f"at row {row + 1} ({len(bad)} such values)"
            if not np.isfinite(value):
                raise RecordingError(f"{channel} is not a finite number {where}; remove or repair those rows")
            raise RecordingError(
                f"{channel} = {value:.4g} {where}; expected up to {largest:g}, check the unit",
                joint=joint,
                value=value,
                bounds=(-largest, largest),
            )
    if len(t) < 2:
        raise RecordingError(f"{len(t)} samples are too few")
    peak = np.abs(v).max(axis=0)
    if (small := np.flatnonzero((peak > 0.0) & (peak < 1.0 / LARGEST_CURRENT))).size:
        joint, value = int(small[0]), float(peak[small[0]])
        least = f"expected {1.0 / LARGEST_CURRENT:g} or more, check the unit"
        raise RecordingError(f"v{joint + 1} is at most {value:.4g}; {least}", joint=joint, value=value)
    back = np.flatnonzero(np.diff(t) <= 0.0)
    if len(back):
        k, advice = int(back[0]), ""
        if (t[back + 1] < t[back]).all():
            only = "only = { episode_index = 0 } in a log description"
            advice = f"; if the file holds several recordings, take one of them, such as {only}"
        elif (t[back + 1] == t[back]).all() and (q[back + 1] == q[back]).all() and (v[back + 1] == v[back]).all():
            advice = f"; {len(back)} rows repeat earlier rows: drop the duplicates"
        elif (t[back + 1] == t[back]).all() and len(back) > 1:
            advice = f"; {len(back)} rows repeat the time of the row before, write t with more digits"
            if (t == np.rint(t)).all():
                advice += ', or add the column of fractions: column = ["sec", "nanosec"], unit = ["s", "ns"] in [t]'
        raise RecordingError(f"time does not increase at row {k + 2}: t = {t[k + 1]:.9g} s after {t[k]:.9g} s{advice}")
    for label, values in (("q", q), ("v", v)):
        flat = np.flatnonzero((values == values[0]).all(axis=0))
        if len(flat):
            if len(t) < FEW:
                raise RecordingError(f"{len(t)} samples are too few")
            raise RecordingError(
                f"{label}{flat[0] + 1} never changes; the joint did not move or the channel was not logged"
                f"{NO_JOINT if flat[0] + 1 == recording.n > 1 else ''}",
                joint=int(flat[0]),
            )
