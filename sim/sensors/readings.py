"""Readings of encoders and logged currents.

Encoders: noise, then quantisation. Controller and log use the readings. Noise of the current is white and coloured, in
proportion to each joint's rms current; coloured noise represents residuals of real robots. Gain and offset errors
differ between motions, `(1 + e) v + o`: e and o are drawn for each motion and joint. Causes are amplifiers that are
zeroed at power-on, and warming shunts.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated, ClassVar

import numpy as np
from annotated_types import Interval, Unit

from ident.numerics.filters import butterworth, filtered
from ident.support.arrays import Array
from sim.errors import PlantError
from sim.sensors.sensor import Log, Noise, NoiseStreams, Reader, Sensor

Angle = Annotated[float, Interval(ge=0.0, le=1.0), Unit("rad")]
Share = Annotated[float, Interval(ge=0.0, le=1.0)]
Ratio = Annotated[float, Interval(ge=0.0, le=100.0)]
CHUNK = 100
"""Number of control periods whose noise is drawn together."""


@dataclass(frozen=True, kw_only=True)
class Encoder(Sensor):
    """One encoder a joint, on the joint side."""

    streams: ClassVar[tuple[str, ...]] = ("encoder",)
    encoder_quantum: Angle = 0.0  # encoder resolution on the joint side [rad]
    encoder_noise: Angle = 0.0  # standard deviation of a reading before quantisation [rad]

    @staticmethod
    def reader(values: Sequence[object], streams: Sequence[NoiseStreams], n: int) -> Reader | None:
        """Encoders of B simulations, as full arrays, because broadcasting is slow in the loop."""
        std, quantum = (
            np.repeat([[getattr(each, name)] for each in values], n, axis=1)
            for name in ("encoder_noise", "encoder_quantum")
        )
        if not (std.any() or quantum.any()):
            return None
        noise = _drawn(std, streams)
        quantised = quantum > 0.0
        quantum, scratch, some = np.where(quantised, quantum, 1.0), np.empty_like(quantum), bool(quantised.any())

        def read(reading: Array) -> None:
            np.add(reading, next(noise), reading)
            if some:
                np.divide(reading, quantum, scratch)
                np.rint(scratch, scratch)
                np.multiply(scratch, quantum, scratch)
                np.copyto(reading, scratch, where=quantised)

        return read

    def noise(self, log: Log) -> Sequence[Noise]:
        """Noise of the readings only: the motion that it causes through the currents is in the log."""
        size = np.hypot(self.encoder_noise, self.encoder_quantum / np.sqrt(12.0))
        return [Noise(stream="encoder", q=np.full(1, size), v=np.zeros(1))] if size else []


def _drawn(std: Array, streams: Sequence[NoiseStreams]) -> Iterator[Array]:
    """Yield the noise of successive control periods [rad], shape (B, n), with these deviations (B, n)."""
    B, n = std.shape
    drawn, noise = np.empty((B, CHUNK, n)), np.empty((CHUNK, B, n))
    periods = list(noise)
    while True:
        for each, rows in zip(streams, drawn, strict=True):
            each["encoder"].standard_normal(out=rows)
        np.multiply(drawn, std[:, None], out=noise.transpose(1, 0, 2))
        yield from periods


LOWEST_SHARE = 1e-5
"""Lowest cut-off of coloured noise, as a share of the rate: below it the filter does not settle within the run."""


@dataclass(frozen=True, kw_only=True)
class CurrentNoise(Sensor):
    """White and coloured noise."""

    streams: ClassVar[tuple[str, ...]] = ("white", "coloured")
    current_white: Ratio = 0.0  # white noise of the logged current, as a share of the joint's rms current
    current_coloured: Ratio = 0.0  # coloured noise of the logged current, in the same way
    coloured_cutoff_hz: Annotated[float, Interval(ge=0.0, le=1e6), Unit("Hz")] = 20.0  # cut-off of coloured noise [Hz]

    def fits(self, rate_hz: float) -> None:
        low, high = LOWEST_SHARE * rate_hz, 0.5 * rate_hz
        if self.current_coloured and not low <= self.coloured_cutoff_hz < high:
            raise PlantError(
                f"sensors: coloured_cutoff_hz = {self.coloured_cutoff_hz:g} at {rate_hz:g} Hz: expected {low:g} Hz or "
                f"more, and less than {high:g} Hz"
            )

    def logs(self, log: Log, streams: NoiseStreams) -> Log:
        """Add noise; white noise is drawn before coloured noise if they are the same generator."""
        v = log.v
        noise = streams["white"].standard_normal(v.shape)  # in place from here on: allocation costs more than the sums
        noise *= self.current_white
        if self.current_coloured:
            coloured = coloured_noise(v.shape, log.rate_hz, self.coloured_cutoff_hz, streams["coloured"])
            coloured *= self.current_coloured
            noise += coloured
        noise *= np.sqrt(np.mean(v**2, axis=0))
        noise += v
        return replace(log, v=noise)

    def noise(self, log: Log) -> Sequence[Noise]:
        rms, none, found = np.sqrt(np.mean(log.v**2, axis=0)), np.zeros(1), list[Noise]()
        if self.current_white:
            found.append(Noise(stream="white", q=none, v=self.current_white * rms))
        if self.current_coloured:
            sos, _, scale = _shaping(log.rate_hz, self.coloured_cutoff_hz)
            found.append(Noise(stream="coloured", q=none, v=self.current_coloured / scale * rms, sos=sos))
        return found


def coloured_noise(shape: tuple[int, ...], rate_hz: float, cutoff_hz: float, rng: np.random.Generator) -> Array:
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


@dataclass(frozen=True, kw_only=True)
class CurrentSensor(Sensor):
    """Errors of the logged current that are constant during a motion."""

    streams: ClassVar[tuple[str, ...]] = ("current_sensor",)
    current_gain_error: Share = 0.0  # standard deviation of the relative error e of a motion's current
    current_offset: Ratio = 0.0  # standard deviation of its offset o, as a share of the joint's rms current

    def logs(self, log: Log, streams: NoiseStreams) -> Log:
        if not (self.current_gain_error or self.current_offset):
            return log
        gain, offset = streams["current_sensor"].standard_normal((2, log.v.shape[1]))
        rms = np.sqrt(np.mean(log.v**2, axis=0))
        return replace(log, v=(1.0 + self.current_gain_error * gain) * log.v + self.current_offset * offset * rms)

    def noise(self, log: Log) -> Sequence[Noise]:
        sizes = (self.current_gain_error * log.v, self.current_offset * np.sqrt(np.mean(log.v**2, axis=0)))
        return [Noise(stream="current_sensor", q=np.zeros(1), v=size, lasting=True) for size in sizes if size.any()]


@dataclass(frozen=True, kw_only=True)
class Delay(Sensor):
    """Delay between logged currents and positions.

    Attributes:
        current_delay: Delay of the logged current relative to the logged position [s]; negative: the current leads.
    """

    current_delay: Annotated[float, Interval(ge=-10.0, le=10.0), Unit("s")] = 0.0

    def logs(self, log: Log, streams: NoiseStreams) -> Log:
        if not self.current_delay:
            return log
        t = np.arange(len(log.v)) / log.rate_hz
        return replace(log, v=np.stack([np.interp(t - self.current_delay, t, v) for v in log.v.T], axis=1))
