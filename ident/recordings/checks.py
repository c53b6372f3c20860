"""Checks for implausible logs: clocks in other units, jumps of positions, spikes of currents.

A few spikes can dominate a least-squares estimate without a hint at the cause. Each check compares samples with others
of the same channel, so it needs no unit, and its limits exceed those of any motion, so it raises no false alarms:

    step of q    faster than `FASTEST`, and `UNUSUAL` times what 99 % of the channel's steps stay below
    v            `UNUSUAL` times as far from the median as 99 % of the samples, for at most `BURST` samples
    many spikes  `UNUSUAL` times as far from the median of `NEAR` samples to either side as half the samples are, and
                 by half of the channel's own range, or what a joint would do at `FASTEST`

For Gaussian noise, the limits are 50 standard deviations in the second check and 13 in the third, for spikes in more
than `MANY` of the samples, which affect the quantiles of the others. A change by one quantum is not a spike.

After a missing sample, all stamps are later by a period. After a late stamp due to jitter, the following ones are on
time: jitter shortens intervals as much as it lengthens others. Samples are therefore missing in a long interval if it
exceeds the jitter indicated by the shortest interval, or if the following stamps stay late.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ident.numerics.neighbours import long_runs, median, running_median
from ident.recordings.description import ISO, TIME, line_of
from ident.recordings.recording import LARGEST_GAP, Recording
from ident.support.arrays import Array, Indices, Mask, once_per_object
from ident.support.errors import RecordingError

SLOWEST, FASTEST_CLOCK = 0.2, 1e-5
"""Plausible sampling intervals [s]: at 5 Hz motions of a robot cannot be differentiated."""
FASTEST = 50.0
"""Largest plausible speed of a joint [rad/s or m/s]; wrists of small arms reach 20."""
UNUSUAL = 20.0
"""Ratio to the 99 % quantile of the channel."""
BURST = 10
"""Largest duration of a spike in samples; a longer one is considered a motion."""
NEAR = 3
"""Number of samples to either side for the median; a spike may last as long."""
LEVELS = 3
"""Least number of values of a coarse channel: of two, one may be a fault."""
WHOLE = 0.01
"""Largest deviation of a difference from a multiple of the quantum, in quanta."""
MANY = 0.001
"""Smallest share of samples with such spikes that is reported; fewer have no effect on a gain."""
CHANCE = 1e-9
"""Probability that all spikes follow an encoder step by chance."""
SHARE = 0.99
MIDDLE = (0.05, 0.95)
"""Quantiles that define a channel's range; spikes in fewer samples do not change it."""
REPAIR = "remove or repair those samples"
TURNS = ((2.0 * np.pi, "2 pi", "np.unwrap(q, axis=0)"), (360.0, "360", "np.unwrap(q, period=360, axis=0)"))
LOST = 1.5
"""Interval relative to the median above which a sample may be missing: nearer to two periods than to one."""
BESIDE = 10
"""Number of stamps to either side of an interval whose median delays are compared."""
SURE = 3.0
"""Number of standard deviations by which such a difference must exceed half a period."""
DEVIATION = 1.4826
"""Ratio of a normal variable's standard deviation to its median magnitude."""


class LogFault(NamedTuple):
    """An implausible feature of a log: its joint, from 0, None for the clock; finding and place; cause or advice."""

    joint: int | None
    sentence: str
    advice: str


def check_log(recording: Recording, *, t_unit: str = "s") -> None:
    """Refuse implausible clock, positions or currents with a `RecordingError`; `t_unit` is the stated unit of time."""
    for fault in log_faults(recording, t_unit=t_unit):
        raise RecordingError(f"{recording.name}: {fault.sentence}; {fault.advice}", joint=fault.joint)


def check_clock(recording: Recording, *, t_unit: str = "s") -> None:
    """Refuse a recording with time in other units; arguments and errors as `check_log`."""
    for fault in _clock_faults(recording, t_unit):
        raise RecordingError(f"{recording.name}: {fault.sentence}; {fault.advice}", joint=fault.joint)


def log_faults(recording: Recording, *, t_unit: str = "s") -> Iterator[LogFault]:
    """Return all implausible features of a recording, the clock first, then channel by channel."""
    yield from _clock_faults(recording, t_unit)
    yield from _sample_faults(recording)


def spikes(recording: Recording) -> tuple[Mask, Mask]:
    """Return masks of spikes of positions and of currents, both of shape (N, n)."""
    fastest = FASTEST * float(np.median(np.diff(recording.t)))
    q = [_many_spikes(x, fastest * foreign_unit(x))[0] for x in recording.q.T]
    v = [_few_spikes(x) | _many_spikes(x, float("inf"))[0] for x in recording.v.T]
    return np.column_stack(q), np.column_stack(v)


def jumps(recording: Recording, j: int) -> Mask:
    """Return a mask of rows followed by an implausible speed, shape (N - 1,)."""
    interval, size = np.diff(recording.t), np.abs(np.diff(recording.q[:, j]))
    jumped = size > FASTEST * interval
    if not jumped.any():
        return jumped
    fastest = FASTEST * np.maximum(interval, np.median(interval))
    return (size > fastest) & (size > UNUSUAL * float(np.quantile(size, SHARE)))


def _clock_faults(recording: Recording, t_unit: str) -> Iterator[LogFault]:
    interval = float(np.median(np.diff(recording.t)))
    if FASTEST_CLOCK <= interval < SLOWEST:
        return
    unit = "s" if t_unit == ISO else t_unit
    logged, own = interval / TIME[unit], TIME[unit]
    fitting = [
        f"in {name}? Then add {line_of('t.factor', [scale / own])}"
        for name, scale in TIME.items()
        if name != ISO and FASTEST_CLOCK <= scale * logged < SLOWEST
    ]
    if (np.diff(recording.t) == 1.0).all():
        fitting.append("the number of the row? Then declare its rate, t=[RATE Hz]")
    sentence = f"t advances by {logged:.3g} {unit} a row, which is implausible"
    yield LogFault(None, sentence, f"is it {'; or '.join(fitting) or 'a time? Declare its unit, t=NAME[unit]'}")


@once_per_object
def _sample_faults(recording: Recording) -> tuple[LogFault, ...]:
    found, later = list[LogFault](), list[LogFault]()
    t, fastest = recording.t, FASTEST * float(np.median(np.diff(recording.t)))

    def add_many(kind: str, j: int, x: Array, mask: Mask, near: Array) -> None:
        if mask.any():
            row, count = int(mask.argmax()), int(mask.sum())
            sentence = (
                f"{kind}{j + 1} has {count} spikes ({100.0 * count / len(x):.2g} % of its samples), the first at row "
                f"{row + 1}, t = {t[row]:.6g} s: {x[row]:.4g} where its neighbours have {near[row]:.4g}"
            )
            later.append(LogFault(j, sentence, REPAIR))

    for j, q in enumerate(np.ascontiguousarray(recording.q.T)):
        add_many("q", j, q, *_many_spikes(q, fastest * foreign_unit(q)))
        jumped, step = jumps(recording, j), np.diff(q)
        if not jumped.any():
            continue
        row, usual = int(jumped.argmax()), float(np.quantile(np.abs(step), SHARE))
        more = f", and {int(jumped.sum()) - 1} more such steps" if jumped.sum() > 1 else ""
        ending, advice = f"faster than {FASTEST:g} rad/s or m/s{more}", "such a speed is implausible; " + REPAIR
        for turn, name, repair in TURNS:
            if abs(abs(step[row]) - turn) <= min(UNUSUAL * usual, 0.1 * turn):
                ending, advice = f"a turn of {name}: the angles are wrapped", f"unwrap them with {repair}"
        found.append(LogFault(j, f"q{j + 1} jumps by {step[row]:.4g} from row {row + 1} to the next, {ending}", advice))
    currents = np.ascontiguousarray(recording.v.T)
    of_v = [_many_spikes(v, float("inf")) for v in currents]
    answered = _answered(of_v, recording)
    for j, v in enumerate(currents):
        if not answered[j]:
            add_many("v", j, v, *of_v[j])
        rows = np.flatnonzero(_few_spikes(v))
        if len(rows):
            middle = float(np.median(v))
            listed = ", ".join(str(k + 1) for k in rows[:6]) + (", .." if len(rows) > 6 else "")
            sentence = (
                f"v{j + 1} = {v[rows[0]]:.4g} at row {rows[0] + 1}, while 99 % of its values are within "
                f"{np.quantile(np.abs(v - middle), SHARE):.3g} of {middle:.3g}; {len(rows)} such samples "
                f"(rows {listed})"
            )
            found.append(LogFault(j, sentence, REPAIR))
    return (*found, *later)


def _few_spikes(v: Array) -> Mask:
    """Return a mask of short outliers of a current, none if they are quanta of a coarse channel."""
    away = np.abs(v - median(v))
    if np.count_nonzero(away > float(away.max()) / UNUSUAL) > (1.0 - SHARE) * len(v) + 2.0:
        return np.zeros(len(v), dtype=np.bool_)  # the quantile is larger
    far = away > UNUSUAL * float(np.quantile(away, SHARE))
    found = far & ~long_runs(far, BURST + 1)
    return found & (not found.any() or not _flickers(v, away[found]))


def _many_spikes(x: Array, far: float) -> tuple[Mask, Array]:
    """Return a mask of spikes, empty if they are few, and the median of each sample's neighbours."""
    none = np.zeros(len(x), dtype=np.bool_)
    # The median of a window is one of its samples, so no sample differs from it by more than `change`. Spikes are
    # impossible, and medians not needed, if that is less than `far`, or than half the range of `MIDDLE`.
    change = max(float(np.abs(x[k:] - x[:-k]).max(initial=0.0)) for k in range(1, NEAR + 1))
    low, high = (int(np.count_nonzero(each)) for each in (x < x.mean() - change, x > x.mean() + change))
    if change < far and min(low, high) > MIDDLE[0] * len(x) + 2.0:  # quantiles reach that number of samples
        return none, x
    near = running_median(x, NEAR)
    away = np.abs(x - near)
    odd = away > UNUSUAL * median(away)
    if int(odd.sum()) <= MANY * len(x):
        return none, near
    low, high = np.quantile(x, MIDDLE)
    found = odd & (away > min(far, 0.5 * float(high - low)))
    return found & (int(found.sum()) > MANY * len(x) and not _flickers(x, away[found])), near


def foreign_unit(q: Array) -> float:
    """Factor of a position's unit if it is not radians or metres: its usual range in four turns, at least 1."""
    near = TURNS[0][0] * 4.0
    return max(1.0, float(np.ptp(np.quantile(q, MIDDLE))) / near) if np.ptp(q) > near else 1.0


def _answered(spikes: Sequence[tuple[Mask, Array]], recording: Recording) -> list[bool]:
    """Return for each joint whether the spikes of its current follow encoder steps, as a response of the controller.

    All of a joint do (`spikes` by `_many_spikes`); or, of a thinned log, the direction of most depends on that
    of the last step, separately for both signs of the current, as faults may have the direction of a current, and
    currents that of the motion. All joints have one kind of controller: the probability by chance is that of all.
    """
    answers, log_chance = list[bool](), 0.0
    for (mask, near), q, v in zip(spikes, recording.q.T, recording.v.T, strict=True):
        if not mask.any():
            answers.append(True)
            continue
        step = np.diff(q, prepend=q[0])
        last = np.maximum.accumulate(np.where(step == 0.0, -NEAR - 1, np.arange(len(q))))
        follow = np.arange(len(q)) - last <= NEAR
        all_follow = int(mask.sum()) * float(np.log(follow.mean())) if follow[mask].all() else 0.0
        at = np.flatnonzero(mask & follow)
        cases = 4 * (near[at] > 0.0) + 2 * (step[last[at]] > 0.0) + (v[at] > near[at])
        counts = np.bincount(cases, minlength=8).reshape(2, 2, 2) + 1e-9  # 0 log 0 is 0
        free = counts.sum(1, keepdims=True) * counts.sum(2, keepdims=True) / counts.sum((1, 2), keepdims=True)
        depends = -float(np.sum(counts * np.log(counts / free)))  # likelihood ratio of independence
        answers.append(bool(follow[mask].all() or depends < np.log(CHANCE)))
        log_chance += min(all_follow, depends)
    return [each and log_chance < float(np.log(CHANCE)) for each in answers]


def _flickers(x: Array, away: Array) -> bool:
    """Return whether samples differ by one quantum of a channel with few values."""
    steps = np.diff(np.unique(x))
    if len(steps) + 1 < LEVELS:
        return False
    step = float(steps.min())
    return bool((away < 1.5 * step).all() and np.abs(steps / step - np.rint(steps / step)).max() < WHOLE)


class Intervals(NamedTuple):
    """Sampling intervals and missing samples of a log."""

    usual: float  # median interval [s]
    mean: float  # mean interval without missing samples [s]
    jitter: float  # largest deviation of such an interval from the median, relative to it
    missing: Indices  # number of samples missing in each interval, shape (N - 1,)

    @property
    def lost(self) -> int:
        """Number of missing samples."""
        return int(self.missing.sum())

    @property
    def gaps(self) -> int:
        """Intervals with missing samples."""
        return int((self.missing > 0).sum())


def intervals_of(t: Array) -> Intervals:
    """Return the intervals of sample times [s], shape (N,)."""
    intervals = np.diff(t)
    usual = float(median(intervals))
    periods = intervals / usual
    missing = supposed = np.where(periods > LOST, np.rint(periods - 1.0), 0.0)
    if supposed.any():
        short = 1.0 - float(periods.min())
        plain = (periods > LOST + short) & (short < LOST - 1.0) | (periods > LARGEST_GAP)
        for _ in range(3):  # each with the results of the neighbours
            later = _later(periods - missing)
            spread = DEVIATION * np.median(np.abs(later))
            for_good = np.minimum(missing + later, supposed)
            missing = np.where(plain | (for_good > 0.5 + SURE * spread), supposed, 0.0)
    even = intervals[missing == 0.0]
    jitter = float(np.abs(even / usual - 1.0).max(initial=0.0))
    return Intervals(usual, float(even.mean()), jitter, missing.astype(np.intp))


def _later(periods: Array) -> Array:
    """Return the increase of the delay of stamps across each interval, shape (N - 1,)."""
    t = np.concatenate(([0.0], np.cumsum(periods)))  # (N,)
    beside = min(BESIDE, len(periods))
    late = t - np.median(t[beside:] - t[:-beside]) / beside * np.arange(len(t))
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(late, beside - 1, mode="edge"), beside)
    level = np.median(windows, axis=1)  # (N + beside - 1,), of the stamps up to each
    return level[beside:] - level[: len(periods)]
