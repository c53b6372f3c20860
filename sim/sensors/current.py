"""Noise of the logged current, white and coloured, in proportion to each joint's rms current."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated

import numpy as np
from annotated_types import Interval, Unit

from ident.numerics.filters import butterworth, filtered
from ident.support.arrays import Array
from sim.errors import SensorError
from sim.sensors.effect import Log, Noise, NoiseStreams, SensorEffect, Values


@dataclass(frozen=True, kw_only=True)
class CurrentNoise(Values):
    """White and coloured noise; coloured noise represents residuals of real robots.

    Attributes:
        current_white: White noise of the logged current, as a share of the joint's rms current.
        current_coloured: Noise of the logged current below `coloured_cutoff_hz`, as a share of the joint's rms current.
        coloured_cutoff_hz: Cut-off of the coloured noise [Hz].
    """

    current_white: Annotated[float, Interval(ge=0.0, le=100.0)] = 0.0
    current_coloured: Annotated[float, Interval(ge=0.0, le=100.0)] = 0.0
    coloured_cutoff_hz: Annotated[float, Interval(ge=0.0, le=1e6), Unit("Hz")] = 20.0


LOWEST_SHARE = 1e-5
"""Lowest cut-off of coloured noise, as a share of the rate: below it the filter does not settle within the run."""


def logged_current(v: Array, rate_hz: float, values: CurrentNoise, streams: NoiseStreams) -> Array:
    """Return the current reference as logged.

    Args:
        v: Current references [drive units], shape (N, n).
        rate_hz: Their rate [Hz].
        values: Noise levels.
        streams: Sources of the noise; white noise is drawn before coloured noise if they are the same generator.

    Returns:
        v with white and coloured noise, both in proportion to each joint's rms current, shape (N, n).
    """
    rms = np.sqrt(np.mean(v**2, axis=0))
    noise = streams["white"].standard_normal(v.shape)  # in place from here on: allocation costs more than the sums
    noise *= values.current_white
    if values.current_coloured:
        coloured = coloured_noise(v.shape, rate_hz, values.coloured_cutoff_hz, streams["coloured"])
        coloured *= values.current_coloured
        noise += coloured
    noise *= rms
    noise += v
    return noise


def coloured_noise(shape: tuple[int, int], rate_hz: float, cutoff_hz: float, rng: np.random.Generator) -> Array:
    """Return stationary noise of unit variance below a cut-off (second-order Butterworth), shape (N, n)."""
    sos, warm_up, scale = _shaping(rate_hz, cutoff_hz)
    white = rng.standard_normal((warm_up + shape[0], shape[1]))
    coloured = filtered(sos, white)[warm_up:]
    coloured /= scale
    return coloured


@lru_cache(maxsize=16)
def _shaping(rate_hz: float, cutoff_hz: float) -> tuple[Array, int, float]:
    """Return the filter of coloured noise, its settling time in samples, and its gain for white noise."""
    sos = butterworth(2, cutoff_hz, rate_hz)
    warm_up = int(np.ceil(5.0 * rate_hz / cutoff_hz))
    impulse = filtered(sos, np.eye(4 * warm_up, 1))
    return sos, warm_up, float(np.linalg.norm(impulse))


def _fits(values: CurrentNoise, rate_hz: float) -> None:
    low, high = LOWEST_SHARE * rate_hz, 0.5 * rate_hz
    if values.current_coloured and not low <= values.coloured_cutoff_hz < high:
        raise SensorError(
            f"sensors: coloured_cutoff_hz = {values.coloured_cutoff_hz:g} at {rate_hz:g} Hz: expected {low:g} Hz or "
            f"more, and less than {high:g} Hz"
        )


def _noisy(values: CurrentNoise, log: Log, streams: NoiseStreams) -> Log:
    return replace(log, v=logged_current(log.v, log.rate_hz, values, streams))


def _noise(values: CurrentNoise, log: Log) -> Sequence[Noise]:
    rms, none = np.sqrt(np.mean(log.v**2, axis=0)), np.zeros(1)
    found = list[Noise]()
    if values.current_white:
        found.append(Noise(stream="white", q=none, v=values.current_white * rms))
    if values.current_coloured:
        sos, _, scale = _shaping(log.rate_hz, values.coloured_cutoff_hz)
        found.append(Noise(stream="coloured", q=none, v=values.current_coloured / scale * rms, sos=sos))
    return found


EFFECT = SensorEffect[CurrentNoise](streams=("white", "coloured"), fits=_fits, logs=_noisy, noise=_noise)
