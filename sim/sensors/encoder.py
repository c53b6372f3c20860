"""Encoders: noise, then quantisation. Controller and log use the readings."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from annotated_types import Interval, Unit

from ident.support.arrays import Array
from sim.sensors.effect import Log, Noise, NoiseStreams, Reader, SensorEffect, Values

CHUNK = 100
"""Number of control periods whose noise is drawn together."""


@dataclass(frozen=True, kw_only=True)
class Encoder(Values):
    """One encoder a joint, on the joint side.

    Attributes:
        encoder_quantum: Encoder resolution on the joint side [rad].
        encoder_noise: Standard deviation of a reading before quantisation [rad].
    """

    encoder_quantum: Annotated[float, Interval(ge=0.0, le=1.0), Unit("rad")] = 0.0
    encoder_noise: Annotated[float, Interval(ge=0.0, le=1.0), Unit("rad")] = 0.0


class _Encoders:
    """The encoders of B simulations, as full arrays, because broadcasting is slow in the loop."""

    def __init__(self, values: Sequence[Encoder], streams: Sequence[NoiseStreams], n: int) -> None:
        self._noise = _drawn(values, streams, n)
        quantum = np.repeat(np.array([[each.encoder_quantum] for each in values]), n, axis=1)
        self._quantised = quantum > 0.0
        self._quantum = np.where(self._quantised, quantum, 1.0)
        self._rounded = np.empty_like(quantum)
        self._rounds, self._all_round = bool(self._quantised.any()), bool(self._quantised.all())

    def __call__(self, reading: Array) -> None:
        np.add(reading, next(self._noise), reading)
        if self._all_round:
            rounded(reading, self._quantum, reading)
        elif self._rounds:
            rounded(reading, self._quantum, self._rounded)
            np.copyto(reading, self._rounded, where=self._quantised)


def rounded(reading: Array, quantum: Array, out: Array) -> None:
    """Round readings to the nearest multiple of a quantum, into `out`, which may be the readings; shapes are equal."""
    np.divide(reading, quantum, out)
    np.rint(out, out)
    np.multiply(out, quantum, out)


def drawn_noise(values: Encoder, streams: NoiseStreams, shape: tuple[int, int]) -> Array:
    """Return the noise of a whole motion, equal to that of its single periods [rad], shape (N, n)."""
    return values.encoder_noise * streams["encoder"].standard_normal(shape)


def _drawn(values: Sequence[Encoder], streams: Sequence[NoiseStreams], n: int) -> Iterator[Array]:
    """Yield the noise of successive control periods [rad], shape (B, n)."""
    std = np.array([[[each.encoder_noise]] for each in values])
    drawn, noise = np.empty((len(values), CHUNK, n)), np.empty((CHUNK, len(values), n))
    periods = list(noise)
    while True:
        for each, rows in zip(streams, drawn, strict=True):
            each["encoder"].standard_normal(out=rows)
        np.multiply(drawn, std, out=noise.transpose(1, 0, 2))
        yield from periods


def _reader(values: Sequence[Encoder], streams: Sequence[NoiseStreams], n: int) -> Reader | None:
    if any(each.encoder_noise or each.encoder_quantum for each in values):
        return _Encoders(values, streams, n)
    return None


def _noise(values: Encoder, log: Log) -> Sequence[Noise]:
    """Return the noise of the readings only: the motion that it causes through the currents is in the log."""
    size = np.hypot(values.encoder_noise, values.encoder_quantum / np.sqrt(12.0))
    return [Noise(stream="encoder", q=np.full(1, size), v=np.zeros(1))] if size else []


EFFECT = SensorEffect[Encoder](streams=("encoder",), reader=_reader, noise=_noise)
