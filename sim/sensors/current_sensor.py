"""Current sensors whose gain and offset errors differ between motions: `(1 + e) v + o`.

e and o are drawn for each motion and joint. Causes are amplifiers that are zeroed at power-on, and warming shunts.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from annotated_types import Interval

from sim.sensors.effect import Log, Noise, NoiseStreams, SensorEffect, Values


@dataclass(frozen=True, kw_only=True)
class CurrentSensor(Values):
    """Errors of the logged current that are constant during a motion.

    Attributes:
        current_gain_error: Standard deviation of the relative error e of a motion's current.
        current_offset: Standard deviation of its offset o, as a share of the joint's rms current.
    """

    current_gain_error: Annotated[float, Interval(ge=0.0, le=1.0)] = 0.0
    current_offset: Annotated[float, Interval(ge=0.0, le=100.0)] = 0.0


def _adjusted(values: CurrentSensor, log: Log, streams: NoiseStreams) -> Log:
    if not (values.current_gain_error or values.current_offset):
        return log
    gain, offset = streams["current_sensor"].standard_normal((2, log.v.shape[1]))
    rms = np.sqrt(np.mean(log.v**2, axis=0))
    return replace(log, v=(1.0 + values.current_gain_error * gain) * log.v + values.current_offset * offset * rms)


def _noise(values: CurrentSensor, log: Log) -> Sequence[Noise]:
    rms, none = np.sqrt(np.mean(log.v**2, axis=0)), np.zeros(1)
    sizes = (values.current_gain_error * log.v, values.current_offset * rms)
    return [Noise(stream="current_sensor", q=none, v=size, lasting=True) for size in sizes if size.any()]


EFFECT = SensorEffect[CurrentSensor](streams=("current_sensor",), logs=_adjusted, noise=_noise)
