"""Encoders: noise, then quantisation. Controller and log use the readings."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from annotated_types import Interval, Unit

from ident.support.arrays import Array
from sim.sensors.sensor import Log, Noise, NoiseStreams, Reader, Sensor
from sim.values import each_value

CHUNK = 100
"""Number of control periods whose noise is drawn together."""


@dataclass(frozen=True, kw_only=True)
class Encoder(Sensor):
    """One encoder a joint, on the joint side.

    Attributes:
        encoder_quantum: Encoder resolution on the joint side [rad].
        encoder_noise: Standard deviation of a reading before quantisation [rad].
    """

    streams: ClassVar[tuple[str, ...]] = ("encoder",)
    encoder_quantum: Annotated[float, Interval(ge=0.0, le=1.0), Unit("rad")] = 0.0
    encoder_noise: Annotated[float, Interval(ge=0.0, le=1.0), Unit("rad")] = 0.0

    @staticmethod
    def reader(values: Sequence[object], streams: Sequence[NoiseStreams], n: int) -> Reader | None:
        """Encoders of B simulations, as full arrays, because broadcasting is slow in the loop."""
        std, quantum = (np.repeat(each, n, axis=1) for each in each_value(values, "encoder_noise", "encoder_quantum"))
        if not (std.any() or quantum.any()):
            return None
        noise = _drawn(std, streams)
        quantised = quantum > 0.0
        quantum, scratch = np.where(quantised, quantum, 1.0), np.empty_like(quantum)
        some, every = bool(quantised.any()), bool(quantised.all())

        def read(reading: Array) -> None:
            np.add(reading, next(noise), reading)
            if every:
                rounded(reading, quantum, reading)
            elif some:
                rounded(reading, quantum, scratch)
                np.copyto(reading, scratch, where=quantised)

        return read

    def noise(self, log: Log) -> Sequence[Noise]:
        """Noise of the readings only: the motion that it causes through the currents is in the log."""
        size = np.hypot(self.encoder_noise, self.encoder_quantum / np.sqrt(12.0))
        return [Noise(stream="encoder", q=np.full(1, size), v=np.zeros(1))] if size else []


def rounded(reading: Array, quantum: Array, out: Array) -> None:
    """Round readings to the nearest multiple of a quantum, into `out`, which may be the readings; shapes are equal."""
    np.divide(reading, quantum, out)
    np.rint(out, out)
    np.multiply(out, quantum, out)


def drawn_noise(values: Encoder, streams: NoiseStreams, shape: tuple[int, int]) -> Array:
    """Return the noise of a whole motion, equal to that of its single periods [rad], shape (N, n)."""
    return values.encoder_noise * streams["encoder"].standard_normal(shape)


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
