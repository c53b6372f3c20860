"""Noise and resolution of a log's columns, from the samples alone.

Fourth differences remove slow motion and multiply the variance of white noise by 1 + 16 + 36 + 16 + 1 = 70; steps and
spikes hardly change their median magnitude.
"""

from functools import lru_cache
from statistics import NormalDist

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Severity
from ident.numerics.neighbours import quantum
from ident.numerics.signals import edge_samples, smooth_motion
from ident.observation.full_rate import filtered_motion
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording, resampled
from ident.support.arrays import Array, once_per_object, readonly

FOURTH = 70.0
"""Sum of the squares of 1, -4, 6, -4, 1."""
NORMAL_MEDIAN = NormalDist().inv_cdf(0.75)
"""Median magnitude of a standard normal variable."""
NOISY_CURRENT = 0.3
"""Ratio of white noise to standard deviation of a current above which a longer motion hardly helps."""
NOISY_ACCELERATION = 0.1
"""Ratio of noise to rms of a filtered acceleration that biases least squares, but not `iv`."""


def noise_std(x: Array) -> Array:
    """Standard deviation of the white noise of columns, shape (n,), zero for fewer than five rows.

    Args:
        x: Samples on a uniform clock, shape (N, n).
    """
    if len(x) < 5:
        return np.zeros(x.shape[1])
    size = np.median(np.abs(np.diff(np.ascontiguousarray(x.T), n=4)), axis=1)
    return size / (NORMAL_MEDIAN * np.sqrt(FOURTH))


@once_per_object
def position_noise(recording: Recording) -> Array:
    """`noise_std` of the positions, shape (n,)."""
    return readonly(noise_std(recording.q))


@once_per_object
def position_quanta(recording: Recording) -> tuple[float | None, ...]:
    """Quantisation step of each joint's positions (`quantum`)."""
    return tuple(quantum(q) for q in recording.q.T)


def acceleration_noise(recording: Recording, options: ObserveOptions) -> Array:
    """Ratio of noise to rms of the filtered accelerations, from white noise of the positions, shape (n,).

    With the fourth-order filter, forward and backward, noise of unit variance gives about `(2 pi f_c)^2 sqrt(0.4 f_c /
    f_s)` [1/s^2]; the value is computed from simulated noise.
    """
    even = resampled(recording)
    edge = edge_samples(even.period, options.cutoff_hz)
    inner = slice(edge, len(even.t) - edge)
    gain = acceleration_of_unit_noise(len(even.t), even.period, options.cutoff_hz)
    rms = np.sqrt(np.mean(filtered_motion(even, options.cutoff_hz)[2][inner] ** 2, axis=0))
    return position_noise(even) * gain / np.where(rms > 0.0, rms, np.inf)


@lru_cache(maxsize=8)  # recordings of one robot are often of one length
def acceleration_of_unit_noise(samples: int, period: float, cutoff_hz: float) -> float:
    """Standard deviation of the filtered accelerations of white noise with unit variance [1/s^2]."""
    edge = edge_samples(period, cutoff_hz)
    white = np.random.default_rng(0).normal(size=(samples, 1))
    return float(np.std(smooth_motion(white, period, cutoff_hz)[2][edge : samples - edge]))


def noise(recording: Recording, observing: ObserveOptions) -> list[Diagnosis]:
    """Check noise and resolution of positions and currents; the worst joint of each is reported."""
    steps = [(step, j) for j, step in enumerate(position_quanta(recording)) if step is not None]
    coarsest, which = max(steps, default=(None, 0))
    resolution = Diagnosis(
        name="encoder resolution",
        sentence="encoder steps are finer than the noise"
        if coarsest is None
        else f"the coarsest encoder has steps of {coarsest:.3g} rad or m (q{which + 1})",
        joints=() if coarsest is None else (which,),
        logs=(recording.name,),
        value=coarsest,
        unit=None if coarsest is None else "rad or m",
    )
    sigma, share = position_noise(recording), acceleration_noise(recording, observing)
    j = int(share.argmax())
    noisy = share[j] > NOISY_ACCELERATION
    of_positions = Diagnosis(
        name="noise of q",
        severity=Severity.WEAK if noisy else Severity.GOOD,
        sentence=f"q{j + 1} has noise of {sigma[j]:.2g} rad or m, "
        f"{100.0 * share[j]:.2g} % of its filtered acceleration",
        advice="lower --cutoff-hz, or use --method iv" if noisy else None,
        joints=(j,),
        logs=(recording.name,),
        value=100.0 * float(share[j]),
        unit="% of the acceleration",
    )
    loud = noise_std(recording.v) / np.std(recording.v, axis=0)
    k = int(loud.argmax())
    noisy = loud[k] > NOISY_CURRENT
    of_currents = Diagnosis(
        name="noise of v",
        severity=Severity.WEAK if noisy else Severity.GOOD,
        sentence=f"v{k + 1} has noise of {100.0 * loud[k]:.2g} % of its standard deviation",
        advice="repeat the motion several times" if noisy else None,
        joints=(k,),
        logs=(recording.name,),
        value=100.0 * float(loud[k]),
        unit="% of the standard deviation",
    )
    return [resolution, of_positions, of_currents]
