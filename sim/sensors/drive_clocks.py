"""Drives with separate clocks: samples of joint j are stamped t but taken at `(1 + r_j) t + o_j`.

r and o are drawn for each motion and joint. Position and current of one drive are sampled together. Values between
samples of the loop are linearly interpolated, and held at the ends.
"""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from annotated_types import Interval, Unit

from ident.support.arrays import Array
from sim.sensors.effect import Log, NoiseStreams, SensorEffect, Values


@dataclass(frozen=True, kw_only=True)
class DriveClocks(Values):
    """Differences between the drives' clocks and the clock of the time stamps.

    Attributes:
        clock_offset: Standard deviation of o [s].
        clock_rate: Standard deviation of r.
    """

    clock_offset: Annotated[float, Interval(ge=0.0, le=1.0), Unit("s")] = 0.0
    clock_rate: Annotated[float, Interval(ge=0.0, le=0.01)] = 0.0


def _own_time(values: DriveClocks, log: Log, streams: NoiseStreams) -> Log:
    if not (values.clock_offset or values.clock_rate):
        return log
    rate, offset = streams["drive_clocks"].standard_normal((2, log.v.shape[1]))
    even = np.arange(len(log.v)) / log.rate_hz
    taken = np.outer(even, 1.0 + values.clock_rate * rate) + values.clock_offset * offset  # (N, n)
    return replace(log, q=_read(even, log.q, taken), v=_read(even, log.v, taken))


def _read(t: Array, columns: Array, taken: Array) -> Array:
    return np.stack([np.interp(at, t, column) for at, column in zip(taken.T, columns.T, strict=True)], axis=1)


EFFECT = SensorEffect[DriveClocks](streams=("drive_clocks",), logs=_own_time)
