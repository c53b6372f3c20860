"""Filters for slow logs: default cut-offs that are too high for a log's rate are lowered; specified ones are not.

A motion that the lowered filter attenuates is refused, as inertias would be estimated too small.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.numerics.neighbours import quantum
from ident.numerics.signals import FILTER_ORDER, SHARE_OF_RATE, noise_density
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording
from ident.support.arrays import Array
from ident.support.errors import RecordingError

MOST_BENT = 0.05
"""Largest share of a joint's rms speed that a lowered filter may remove; friction at reversals causes up to 2 %."""
DEFAULTS = ObserveOptions()


def following(options: ObserveOptions, recordings: Sequence[Recording]) -> tuple[ObserveOptions, str | None]:
    """Return the filters for recordings that are used together, lowered if the slowest requires it, and a note if so.

    Raises `RecordingError` if a joint moves too fast for the cut-off that its log allows.
    """
    slowest = max(recordings, key=lambda each: each.period)
    rate = 1.0 / slowest.period
    highest = SHARE_OF_RATE * rate
    lowered = options
    for name in ("cutoff_hz", "decimation_cutoff_hz"):
        if getattr(options, name) == getattr(DEFAULTS, name) > highest:
            lowered = replace(lowered, rows_per_second=min(lowered.rows_per_second, 2.0 * highest), **{name: highest})
    if lowered is options:
        return options, None
    for each in recordings:
        bent = _bent(each, lowered.cutoff_hz)
        j = int(np.argmax(bent))
        if bent[j] > MOST_BENT:
            raise RecordingError(
                f"joint {j + 1} moves too fast for a log at {1.0 / each.period:.4g} Hz: a low-pass at "
                f"{lowered.cutoff_hz:.3g} Hz removes {100.0 * bent[j]:.2g} % of its speed; log faster, or move more "
                "slowly",
                each.name,
                joint=j,
                value=float(bent[j]),
                bounds=(0.0, MOST_BENT),
            )
    return lowered, (
        f"{slowest.name}: logged at {rate:.4g} Hz, so positions are low-passed at {lowered.cutoff_hz:.3g} Hz and "
        f"currents at {lowered.decimation_cutoff_hz:.3g} Hz"
    )


def _bent(recording: Recording, cutoff_hz: float) -> Array:
    """Return the share of each joint's rms speed that a low-pass removes, shape (n,)."""
    q, period = recording.q, recording.period
    window = np.hanning(len(q))[:, None]
    f = np.fft.rfftfreq(len(q), period)
    power = np.abs(np.fft.rfft(window * (q - q.mean(axis=0)), axis=0)) ** 2
    steps = np.array([quantum(column) or 0.0 for column in q.T])  # quantisation, not motion
    density = np.maximum(noise_density(q, period), 2.0 * period * steps**2 / 12.0)
    noise = density * np.sum(window**2) / (2.0 * period)
    square = (2.0 * np.pi * f[:, None]) ** 2
    speeds = square * np.where(power > 10.0 * noise, power, 0.0)
    taken = 1.0 - 1.0 / (1.0 + (f[:, None] / cutoff_hz) ** (2 * FILTER_ORDER))  # forward and backward
    whole, lost = speeds.sum(axis=0), (taken**2 * speeds).sum(axis=0)
    lost = np.where(lost > 2.0 * (taken**2 * square * noise).sum(axis=0), lost, 0.0)  # not motion
    return np.sqrt(lost / np.where(whole > 0.0, whole, 1.0))
