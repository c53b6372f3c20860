"""A delay of the logged currents relative to the positions."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from annotated_types import Interval, Unit

from ident.support.arrays import Array
from sim.sensors.effect import Log, NoiseStreams, SensorEffect, Values


@dataclass(frozen=True, kw_only=True)
class Delay(Values):
    """Delay between logged currents and positions.

    Attributes:
        current_delay: Delay of the logged current relative to the logged position [s]; negative: the current leads.
    """

    current_delay: Annotated[float, Interval(ge=-10.0, le=10.0), Unit("s")] = 0.0


def delayed(v: Array, rate_hz: float, delay: float) -> Array:
    """Return the samples delayed by `delay` [s], linearly interpolated and held at the ends; shape (N, n)."""
    t = np.arange(len(v)) / rate_hz
    return np.stack([np.interp(t - delay, t, column) for column in v.T], axis=1)


def _late(values: Delay, log: Log, streams: NoiseStreams) -> Log:
    return replace(log, v=delayed(log.v, log.rate_hz, values.current_delay)) if values.current_delay else log


EFFECT = SensorEffect[Delay](logs=_late)
