"""Lost and repeated samples, except the first and the last.

A lost sample is not in the log. A repeated sample has its own time, but the positions and currents of the last sample
that is not a repetition.
"""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from annotated_types import Interval

from sim.sensors.effect import Log, NoiseStreams, SensorEffect, Values


@dataclass(frozen=True, kw_only=True)
class Samples(Values):
    """Probabilities of faults of each sample.

    Attributes:
        samples_lost: Share of lost samples.
        samples_repeated: Share of samples that repeat the preceding one.
    """

    samples_lost: Annotated[float, Interval(ge=0.0, le=0.5)] = 0.0
    samples_repeated: Annotated[float, Interval(ge=0.0, le=0.5)] = 0.0


def _arrived(values: Samples, log: Log, streams: NoiseStreams) -> Log:
    if not (values.samples_lost or values.samples_repeated):
        return log
    lost, repeated = streams["samples"].random((2, len(log.t))) < [[values.samples_lost], [values.samples_repeated]]
    lost[[0, -1]] = repeated[[0, -1]] = False
    source = np.maximum.accumulate(np.where(repeated, 0, np.arange(len(log.t))))  # of each, the last that is its own
    return replace(log, t=log.t[~lost], q=log.q[source][~lost], v=log.v[source][~lost])


EFFECT = SensorEffect[Samples](streams=("samples",), logs=_arrived)
