"""Clock jitter: samples are taken on time, but their time stamps have an error."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from annotated_types import Interval, Unit

from sim.errors import SensorError
from sim.sensors.effect import Log, Noise, NoiseStreams, SensorEffect, Values


@dataclass(frozen=True, kw_only=True)
class Clock(Values):
    """Jitter of time stamps.

    Attributes:
        clock_jitter: Standard deviation of the uniformly distributed error of a time stamp [s]; at most a quarter of
            the period, so that time increases. The samples themselves are taken on time.
    """

    clock_jitter: Annotated[float, Interval(ge=0.0, le=10.0), Unit("s")] = 0.0


def _fits(values: Clock, rate_hz: float) -> None:
    if values.clock_jitter > 0.25 / rate_hz:
        raise SensorError(
            f"sensors: clock_jitter = {values.clock_jitter:g} s at {rate_hz:g} Hz: expected a quarter of the period, "
            f"{0.25 / rate_hz:g} s, at most"
        )


def _jittered(values: Clock, log: Log, streams: NoiseStreams) -> Log:
    if not values.clock_jitter:
        return log
    even = streams["clock"].uniform(-np.sqrt(3.0), np.sqrt(3.0), len(log.t))  # of unit deviation
    return replace(log, t=log.t + values.clock_jitter * even)


def _noise(values: Clock, log: Log) -> Sequence[Noise]:
    """Return the equivalent position error: minus speed times the error of the stamp, equal for all joints."""
    if not values.clock_jitter:
        return []
    q, v = (-values.clock_jitter * np.gradient(x, 1.0 / log.rate_hz, axis=0) for x in (log.q, log.v))
    return [Noise(stream="clock", q=q, v=v, shared=True)]


EFFECT = SensorEffect[Clock](streams=("clock",), fits=_fits, logs=_jittered, noise=_noise)
