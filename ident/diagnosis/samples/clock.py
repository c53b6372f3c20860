"""The clock of a log: its rate, its jitter, and samples that are missing by the time stamps."""

from itertools import pairwise

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Severity
from ident.numerics.signals import KERNEL_CUTOFFS, SETTLING
from ident.observation.observation import ObserveOptions
from ident.recordings.checks import intervals_of
from ident.recordings.recording import JITTER_TOL, LARGEST_GAP, Recording

ROOM = 4.0
"""Number of samples per period of the highest cut-off below which the rate is too low for the filters."""
JITTERED = 0.5
"""Relative deviation of an interval, without missing samples, that is reported."""


ROWS_A_JOINT = 10
"""Number of rows per joint that an observation requires (`ident.observation.observation`)."""
SPARE = 1.2
"""Margin of their duration, as groups and decimation are whole numbers of samples."""


def slowest_hz(observing: ObserveOptions) -> float:
    """Rate of a log [Hz] below which it is too low for the filters."""
    return ROOM * max(observing.cutoff_hz, observing.decimation_cutoff_hz)


SLOW = slowest_hz(ObserveOptions())
"""The same for the default filters."""


def clock(recording: Recording, observing: ObserveOptions) -> list[Diagnosis]:
    """Check the time stamps."""
    found = intervals_of(recording.t)
    duration = float(recording.t[-1] - recording.t[0])
    hertz = 1.0 / found.mean  # controllers that log every 10 or 12 ms do so at a rate between the two
    slowest = slowest_hz(observing)
    slow, uneven = hertz < slowest, found.jitter > JITTERED
    rate = Diagnosis(
        name="rate",
        severity=Severity.WEAK if slow else Severity.GOOD,
        sentence=f"sampled at {hertz:.4g} Hz: {len(recording.t)} samples in {duration:.4g} s",
        advice=f"log at {slowest:g} Hz or more, or lower --cutoff-hz" if slow else None,
        logs=(recording.name,),
        value=hertz,
        unit="Hz",
    )
    jitter = Diagnosis(
        name="jitter",
        severity=Severity.WEAK if uneven else Severity.GOOD,
        sentence="sampling intervals are equal"
        if found.jitter <= JITTER_TOL
        else f"sampling intervals vary by up to {100.0 * found.jitter:.3g} %",
        advice="log the time at which a sample was taken, not at which it arrived" if uneven else None,
        logs=(recording.name,),
        value=100.0 * found.jitter,
        unit="%",
    )
    return [rate, jitter, missing_samples(recording, observing)]


def usable_parts(recording: Recording, observing: ObserveOptions) -> list[slice]:
    """Rows between gaps that are too long to interpolate, if there are enough for the filters.

    Empty without such a gap, or if no part is long enough.
    """
    intervals = np.diff(recording.t)
    gaps = np.flatnonzero(intervals > LARGEST_GAP * np.median(intervals)) + 1
    if not len(gaps):
        return []
    ends = [0, *gaps.tolist(), len(recording.t)]
    least = least_seconds(observing, recording.n)
    return [slice(a, b) for a, b in pairwise(ends) if b - a > 1 and recording.t[b - 1] - recording.t[a] >= least]


def missing_samples(recording: Recording, observing: ObserveOptions) -> Diagnosis:
    """Check for samples that are missing by the time stamps, and describe the treatment of the gaps."""
    found = intervals_of(recording.t)
    if not found.lost:
        return Diagnosis(
            name="missing samples", sentence="the time stamps show no missing samples", logs=(recording.name,)
        )
    intervals = np.diff(recording.t)
    at = int(np.where(found.missing, intervals, 0.0).argmax())
    hole = intervals[at] > LARGEST_GAP * found.usual
    parts = usable_parts(recording, observing)
    lost = "1 sample is" if found.lost == 1 else f"{found.lost} samples are"
    gaps = "1 gap" if found.gaps == 1 else f"{found.gaps} gaps"
    used = f"; {_used(recording, parts)}" if hole and parts else ""
    return Diagnosis(
        name="missing samples",
        severity=Severity.WRONG if hole and not parts else Severity.WEAK,
        sentence=f"{lost} missing in {gaps}, the longest {intervals[at]:.3g} s at t = {recording.t[at]:.6g} s{used}",
        advice="log with less load on the computer",
        logs=(recording.name,),
        value=float(found.lost),
        unit="samples",
    )


def least_seconds(observing: ObserveOptions, n: int) -> float:
    """Duration [s] of a log of n joints below which the filters leave too few rows."""
    filters = 2.0 * SETTLING / observing.cutoff_hz + KERNEL_CUTOFFS / observing.decimation_cutoff_hz
    return filters + SPARE * ROWS_A_JOINT * n / observing.rows_per_second


def _used(recording: Recording, parts: list[slice]) -> str:
    """Describe how a log with gaps is used."""
    if len(parts) > 1:
        return f"used as {len(parts)} logs"
    return f"used from {recording.t[parts[0].start]:.4g} to {recording.t[parts[0].stop - 1]:.4g} s"
