"""What stands between the plant and its log: encoders in the loop, current sensing beside it."""

from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np
from scipy import signal

from ident.arrays import Array
from sim.errors import SensorError


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorOptions:
    """Noise and timing of the sensors; zero switches a source off.

    Attributes:
        encoder_quantum: Encoder resolution on the joint side [rad].
        encoder_noise: Standard deviation of a reading before quantisation [rad].
        current_white: White noise of the logged current, as a share of the joint's rms current.
        current_coloured: Noise below `coloured_cutoff_hz` of the logged current, as a share of the same.
        coloured_cutoff_hz: Its cut-off [Hz].
        current_delay: Time by which the logged current lags behind the logged position [s]; negative: it leads.
        clock_jitter: Standard deviation of the error of a time stamp [s], evenly distributed; a quarter of the period
            at most, so that time increases. The samples themselves are taken on time.
    """

    encoder_quantum: float = 0.0
    encoder_noise: float = 0.0
    current_white: float = 0.0
    current_coloured: float = 0.0
    coloured_cutoff_hz: float = 20.0
    current_delay: float = 0.0
    clock_jitter: float = 0.0

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            SensorError: If one is negative that must not be, or no finite number.
        """
        for field in fields(self):
            if not np.isfinite(getattr(self, field.name)):
                raise SensorError(f"sensors: {field.name} = {getattr(self, field.name)} is not a finite number")
            if getattr(self, field.name) < 0.0 and field.name != "current_delay":
                raise SensorError(f"sensors: {field.name} = {getattr(self, field.name)} is negative")
        if self.current_coloured and not self.coloured_cutoff_hz:
            raise SensorError("sensors: coloured noise needs coloured_cutoff_hz above 0")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NoiseStreams:
    """Random numbers of one motion, each kind of noise from a generator of its own choice.

    Attributes:
        encoder: Of encoder readings.
        white: Of white current noise, drawn before `coloured` where they are the same generator.
        coloured: Of coloured current noise.
        clock: Of time stamps.
    """

    encoder: np.random.Generator
    white: np.random.Generator
    coloured: np.random.Generator
    clock: np.random.Generator


def noise_streams(rng: np.random.Generator) -> NoiseStreams:
    """The streams that follow from one generator."""
    encoder, current, clock = rng.spawn(3)
    return NoiseStreams(encoder=encoder, white=current, coloured=current, clock=clock)


def check_rate(options: SensorOptions, rate_hz: float) -> None:
    """Check that sensors fit the rate they log at.

    Raises:
        SensorError: If coloured noise has its cut-off at half the rate or above, or time stamps could change order.
    """
    if options.current_coloured and options.coloured_cutoff_hz >= 0.5 * rate_hz:
        needed = 2.0 * options.coloured_cutoff_hz
        raise SensorError(
            f"sensors: coloured_cutoff_hz = {options.coloured_cutoff_hz:g} needs a log faster than {needed:g} Hz"
        )
    if options.clock_jitter > 0.25 / rate_hz:
        raise SensorError(
            f"sensors: clock_jitter = {options.clock_jitter:g} s at {rate_hz:g} Hz: expected a quarter of the period, "
            f"{0.25 / rate_hz:g} s, at most"
        )


def logged_time(samples: int, rate_hz: float, options: SensorOptions, rng: np.random.Generator) -> Array:
    """Time stamps of the log [s], shape (N,)."""
    t = np.arange(samples) / rate_hz
    if not options.clock_jitter:
        return t
    return t + options.clock_jitter * rng.uniform(-np.sqrt(3.0), np.sqrt(3.0), samples)  # of unit deviation


def delayed(v: Array, rate_hz: float, delay: float) -> Array:
    """Samples as they were `delay` [s] before, between samples on straight lines, at the ends held; shape (N, n)."""
    if not delay:
        return v
    t = np.arange(len(v)) / rate_hz
    return np.stack([np.interp(t - delay, t, column) for column in v.T], axis=1)


def logged_current(v: Array, rate_hz: float, options: SensorOptions, streams: NoiseStreams) -> Array:
    """The current reference as it is logged.

    Args:
        v: Current references [drive units], shape (N, n).
        rate_hz: Their rate [Hz].
        options: Noise levels.
        streams: Sources of the noise.

    Returns:
        v with white and coloured noise, both in proportion to each joint's rms current, shape (N, n).
    """
    rms = np.sqrt(np.mean(v**2, axis=0))
    noise = streams.white.standard_normal(v.shape)  # in place from here on: fresh megabytes cost more than arithmetic
    noise *= options.current_white
    if options.current_coloured:
        coloured = coloured_noise(v.shape, rate_hz, options.coloured_cutoff_hz, streams.coloured)
        coloured *= options.current_coloured
        noise += coloured
    noise *= rms
    noise += v
    return noise


def coloured_noise(shape: tuple[int, int], rate_hz: float, cutoff_hz: float, rng: np.random.Generator) -> Array:
    """Stationary noise of unit variance below a cut-off (second-order Butterworth), shape (N, n)."""
    sos, warm_up, scale = _shaping(rate_hz, cutoff_hz)
    white = rng.standard_normal((warm_up + shape[0], shape[1]))
    coloured = signal.sosfilt(sos, white, axis=0)[warm_up:]
    coloured /= scale
    return coloured


@lru_cache(maxsize=16)
def _shaping(rate_hz: float, cutoff_hz: float) -> tuple[Array, int, float]:
    """Filter of coloured noise, samples until it has settled, and its gain for white noise."""
    sos = signal.butter(2, cutoff_hz, fs=rate_hz, output="sos")
    warm_up = int(np.ceil(5.0 * rate_hz / cutoff_hz))
    impulse = signal.sosfilt(sos, np.eye(1, 4 * warm_up)[0])
    return sos, warm_up, float(np.linalg.norm(impulse))
