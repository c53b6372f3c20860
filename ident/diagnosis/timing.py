"""Time of a log: rate, jitter, gaps, and samples that were lost or repeated behind uniform time stamps.

If one sample of a moving arm is lost and the time stamps remain uniform, all joints advance twice as far from one row
to the next; if one is repeated, none advances. The step of all joints is compared with the steps to each side, as a
ratio:

    share = sum_j s_j m_j / sum_j m_j^2         s_j the step of joint j, m_j the median of the steps beside it

A ratio of 3 means two lost samples. If the ratios of all such steps are whole numbers, time stamps can be corrected.

With jitter, samples were either taken at these times, or taken uniformly and stamped late. The interpretation with the
smoother speeds is used.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ident.diagnosis.channels import first, times
from ident.diagnosis.diagnosis import Diagnosis, Severity, finding
from ident.diagnosis.motion_quality import by_joint, position_noise, position_quanta
from ident.numerics.signals import KERNEL_CUTOFFS, SETTLING
from ident.observation.observation import ObserveOptions
from ident.recordings.checks import Intervals, intervals_of
from ident.recordings.recording import JITTER_TOL, LARGEST_GAP, Recording
from ident.support.arrays import Array, Indices, Mask, once_per_object

ROOM = 4.0
"""Number of samples per period of the highest cut-off below which the rate is too low for the filters."""
JITTERED = 0.5
"""Relative deviation of an interval, without missing samples, that is reported."""
ROWS_A_JOINT, SPARE = 10, 1.2
"""Number of rows per joint that an observation requires (`ident.observation.observation`), and margin of their
duration, as groups and decimation are whole numbers of samples."""


def slowest_hz(observing: ObserveOptions) -> float:
    """Rate of a log [Hz] below which it is too low for the filters."""
    return ROOM * max(observing.cutoff_hz, observing.decimation_cutoff_hz)


@once_per_object
def intervals(recording: Recording) -> Intervals:
    """`intervals_of` the time stamps."""
    return intervals_of(recording.t)


def clock(recording: Recording, observing: ObserveOptions) -> list[Diagnosis]:
    """Check the time stamps."""
    found, slowest, name = intervals(recording), slowest_hz(observing), recording.name
    hertz = 1.0 / found.mean  # controllers that log every 10 or 12 ms do so at a rate between the two
    rate = f"sampled at {hertz:.4g} Hz: {len(recording.t)} samples in {float(recording.t[-1] - recording.t[0]):.4g} s"
    faster = f"log at {slowest:g} Hz or more, or lower --cutoff-hz" if hertz < slowest else None
    varied = f"sampling intervals vary by up to {100.0 * found.jitter:.3g} %"
    varied = varied if found.jitter > JITTER_TOL else "sampling intervals are equal"
    own = "log the time at which a sample was taken, not at which it arrived" if found.jitter > JITTERED else None
    return [
        finding(name, "rate", rate, faster, value=hertz, unit="Hz"),
        finding(name, "jitter", varied, own, value=100.0 * found.jitter, unit="%"),
        missing_samples(recording, observing),
    ]


def least_seconds(observing: ObserveOptions, n: int) -> float:
    """Duration [s] of a log of n joints below which the filters leave too few rows."""
    filters = 2.0 * SETTLING / observing.cutoff_hz + KERNEL_CUTOFFS / observing.decimation_cutoff_hz
    return filters + SPARE * ROWS_A_JOINT * n / observing.rows_per_second


def usable_parts(recording: Recording, observing: ObserveOptions) -> list[slice]:
    """Rows between gaps too long to interpolate, if there are enough for the filters; none without such a gap."""
    t, least = recording.t, least_seconds(observing, recording.n)
    gaps = np.flatnonzero(np.diff(t) > LARGEST_GAP * intervals(recording).usual) + 1
    ends = pairwise([0, *gaps.tolist(), len(t)] if len(gaps) else [])
    return [slice(a, b) for a, b in ends if b - a > 1 and t[b - 1] - t[a] >= least]


def missing_samples(recording: Recording, observing: ObserveOptions) -> Diagnosis:
    """Check for samples that are missing by the time stamps, and describe the treatment of the gaps."""
    found, name = intervals(recording), "missing samples"
    if not found.lost:
        return finding(recording.name, name, "the time stamps show no missing samples")
    t, parts, used = recording.t, usable_parts(recording, observing), ""
    at = int(np.where(found.missing, np.diff(t), 0.0).argmax())
    longest = float(t[at + 1] - t[at])
    hole = longest > LARGEST_GAP * found.usual
    if hole and parts:
        one = f"from {t[parts[0].start]:.4g} to {t[parts[0].stop - 1]:.4g} s"
        used = f"; used {one if len(parts) == 1 else f'as {len(parts)} logs'}"
    lost = "1 sample is" if found.lost == 1 else f"{found.lost} samples are"
    gaps = "1 gap" if found.gaps == 1 else f"{found.gaps} gaps"
    sentence = f"{lost} missing in {gaps}, the longest {longest:.3g} s at t = {t[at]:.6g} s{used}"
    grade = Severity.WRONG if hole and not parts else Severity.WEAK
    advice = "log with less load on the computer"
    return finding(recording.name, name, sentence, advice, severity=grade, value=found.lost, unit="samples")


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
    """Rows whose step differs from that of their neighbours."""

    long: Indices  # rows, from 0, after which all joints advance too far
    lost: Indices  # number of samples lost after each of these, 0 if ambiguous
    still: Indices  # rows, from 0, after which no joint advances although the arm moves
    shown: float  # share of the rows at which one lost sample would be detected

    @property
    def plain(self) -> bool:
        """Whether samples were lost, and their places and numbers are unambiguous."""
        return self.shown > SHOWN and len(self.lost) > 0 and bool((self.lost > 0).all())


@once_per_object
def timestamp_anomalies(recording: Recording) -> TimestampAnomalies:
    """Find steps of all joints together that are too long, or zero, for their time interval."""
    found, step, stamped = intervals(recording), by_joint(recording).dq, np.diff(recording.t)  # (n, N - 1), (N - 1,)
    rounding = np.array([quantum or np.finfo(float).eps for quantum in position_quanta(recording)]) / np.sqrt(12.0)
    sigma = np.sqrt(2.0) * np.hypot(position_noise(recording), rounding) / found.usual
    even = np.asarray(found.usual * (1.0 + found.missing), np.float64)
    readings = [stamped] if np.abs(stamped - even).max() < SAME * even.min() else [stamped, even]
    speeds = [(each, rate := step / sigma[:, None] / each, speed_beside(rate)) for each in readings]  # in noise
    interval, rate, usual = min(speeds, key=lambda each: float(np.abs(each[1] - each[2]).sum()))
    size = np.einsum("jk,jk->k", usual, usual)
    share = np.divide(np.einsum("jk,jk->k", rate, usual), size, out=np.ones(len(size)), where=size > 0.0)
    off, periods = np.abs(share - 1.0), interval / found.usual
    whole = np.abs(periods - np.maximum(np.rint(periods), 1.0)) < 0.5 * OFF  # a late stamp makes a long interval
    whole[:APART] = whole[len(whole) - APART :] = False  # a motion that begins or ends has no steps on both sides
    sure = np.flatnonzero((off * np.sqrt(size) > SURE) & (off > OFF) & whole)
    # beside the two steps next to it, too: a joint that sags for some samples has a smooth peak of speed
    adjacent = 0.5 * (rate[:, sure - 1] + rate[:, sure + 1])
    rate, usual = rate[:, sure], usual[:, sure]
    sharp = np.abs(np.sum((rate - adjacent) * adjacent, axis=0)) > OFF * np.sum(adjacent**2, axis=0)
    sure, rate, usual = sure[sharp], rate[:, sharp], usual[:, sharp]
    moving = np.abs(usual) > SHOWS
    own = np.divide(rate, usual, out=np.ones_like(rate), where=moving)
    alike = moving & (np.abs(own - 1.0) > 0.5 * OFF) & ((own > 1.0) == (share[sure] > 1.0))
    sure = sure[alike.sum(axis=0) > MOST * moving.sum(axis=0)]  # one coarse encoder does not count
    still = sure[(step[:, sure] == 0.0).all(axis=0)]
    long = sure[(share[sure] > 1.0) & ~np.isin(sure - 1, still)]  # after repeats
    lost = (share[long] - 1.0) * periods[long]
    plain = (np.abs(lost - np.rint(lost)) < PLAIN) & (lost < LARGEST_GAP - 1.0)
    lost = np.where(plain, np.rint(lost), 0).astype(np.intp)
    return TimestampAnomalies(long=long, lost=lost, still=still, shown=float(np.mean(np.sqrt(size) > SURE)))


def speed_beside(rate: Array) -> Array:
    """Median speed of the steps to each side of every step, without the step itself, shape (n, N - 1)."""
    near = sliding_window_view(np.pad(rate, ((0, 0), (APART, APART)), mode="edge"), 2 * APART + 1, axis=1)
    found = np.empty_like(rate)
    for joint, out in zip(near, found, strict=True):
        each = np.sort(np.delete(joint, APART, axis=1), axis=1)
        out[:] = 0.5 * (each[:, APART - 1] + each[:, APART])
    return found


def lost_samples(recording: Recording, _: ObserveOptions | None = None) -> list[Diagnosis]:
    """Check positions and currents for lost, repeated and held samples."""
    odd, name, count = timestamp_anomalies(recording), recording.name, len(recording.t)
    lost, repeats = "the motion shows no lost samples", "no samples are repeated"
    found = [finding(name, "lost samples", lost), finding(name, "repeated samples", repeats)]

    def severity(rows: Indices) -> Severity:
        return Severity.WRONG if len(rows) > MANY * count else Severity.WEAK

    if len(odd.long):
        place, many, grade, unit = first(recording, odd.long), len(odd.long), severity(odd.long), "jumps"
        sentence = f"all joints jump ahead {times(many)}, {place}: samples are lost"
        if odd.plain:
            many, grade, unit = int(odd.lost.sum()), Severity.WEAK, "samples"
            lost = "1 sample is" if many == 1 else f"{many} samples are"
            sentence = f"{lost} lost without a gap in the time stamps, {place}; stamps corrected"
        advice = "log the controller's own time"
        found[0] = finding(name, "lost samples", sentence, advice, severity=grade, value=many, unit=unit)
    if many := len(odd.still):
        sentence = f"positions of a moving arm repeat {times(many)}, {first(recording, odd.still)}"
        advice, grade = "log each sample once, with its own time", severity(odd.still)
        found[1] = finding(name, "repeated samples", sentence, advice, severity=grade, value=many, unit="rows")
    held = 100.0 * float((by_joint(recording).dv == 0.0).all(axis=0).mean())
    if held > 100.0 * HELD:
        sentence = f"all currents equal those of the row before on {held:.3g} % of the rows: v is logged at a lower "
        advice = "log them at the rate of positions"
        found.append(finding(name, "held currents", sentence + "rate than q", advice, value=held, unit="% of the rows"))
    return found


def beside(recording: Recording, rows: Indices) -> Mask:
    """Mask of the samples on both sides of rows, shape (N, n)."""
    found = np.zeros(recording.q.shape, dtype=np.bool_)
    found[rows] = found[rows + 1] = True
    return found
