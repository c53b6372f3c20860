"""Currents that are logged later than the positions they were commanded at."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from annotated_types import Interval, Unit

from ident.support.arrays import Array
from sim.sensors.effect import Log, NoiseStreams, SensorEffect, Values


@dataclass(frozen=True, kw_only=True)
class Delay(Values):
    """A lag between both logs.

    Attributes:
        current_delay: Time by which the logged current lags behind the logged position [s]; negative: it leads.
    """

    current_delay: Annotated[float, Interval(ge=-10.0, le=10.0), Unit("s")] = 0.0


def delayed(v: Array, rate_hz: float, delay: float) -> Array:
    """Samples as they were `delay` [s] before, between samples on straight lines, at the ends held; shape (N, n)."""
    t = np.arange(len(v)) / rate_hz
    return np.stack([np.interp(t - delay, t, column) for column in v.T], axis=1)


def _late(values: Delay, log: Log, streams: NoiseStreams) -> Log:
    return replace(log, v=delayed(log.v, log.rate_hz, values.current_delay)) if values.current_delay else log


EFFECT = SensorEffect[Delay](logs=_late)
