"""Closed-loop simulation: from encoder readings to currents in every control period of a batch."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ident.support.arrays import Array
from sim.control_law import ControlPeriods
from sim.controller import Controller
from sim.engine import Engine
from sim.sensors import SENSOR_EFFECTS, SensorOptions
from sim.sensors.effect import NoiseStreams, Reader

CHUNK = 100
"""Number of control periods whose references are gathered and whose logs are stored together; they fit in the cache."""
Advanced = Callable[[float], None]
"""Callback that receives the simulated time since the last call, summed over all simulations [s]."""


def no_progress(seconds: float) -> None:
    """Callback that does nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class LoopLog:
    """Every control period of B simulations.

    Attributes:
        q: Encoder readings [rad], shape (B, N, n).
        v: Current references [drive units], shape (B, N, n).
    """

    q: Array
    v: Array


def closed_loop(
    engine: Engine,
    controllers: Sequence[Controller],
    limits: Array,
    sensors: Sequence[SensorOptions],
    streams: Sequence[NoiseStreams],
    *,
    advanced: Advanced = no_progress,
) -> LoopLog:
    """Run B simulations to the end of their motions.

    The first axis of the log is the simulation; arrays of the loop have time first.

    Args:
        engine: The simulations, at rest at the start of their motions.
        controllers: One per simulation, of equal length and period.
        limits: Current limits [drive units], shape (B, n).
        sensors: One per simulation.
        streams: Random numbers of the sensors, one per simulation.
        advanced: Called after every chunk.
    """
    samples, (B, n) = len(controllers[0].reference), engine.q.shape
    log, readers = LoopLog(np.empty((B, samples, n)), np.empty((B, samples, n))), _readers(sensors, streams, n)
    periods = ControlPeriods(controllers, min(CHUNK, samples))
    q, current, readings = engine.q, engine.current, list(periods.reading)
    for start in range(0, samples, CHUNK):
        rows = slice(start, min(start + CHUNK, samples))
        length = rows.stop - start
        for i, controller in enumerate(controllers):
            periods.reference[:length, i] = controller.reference[rows]
            if periods.q_ref is not None:
                periods.q_ref[:length, i] = controller.q_ref[rows]
        for k in range(length):
            reading = readings[k]
            reading[...] = q
            for distort in readers:
                distort(reading)
            if start + k == 0:
                periods.switch_on(reading)
            current[...] = periods.command(k)
            engine.advance()
        periods.go_on()
        log.q[:, rows] = periods.reading[:length].transpose(1, 0, 2)
        log.v[:, rows] = periods.v[:length].transpose(1, 0, 2)
        advanced(B * length * controllers[0].period)
    for v, limit in zip(log.v, limits, strict=True):
        np.clip(v, -limit, limit, out=v)
    return log


def _readers(sensors: Sequence[SensorOptions], streams: Sequence[NoiseStreams], n: int) -> list[Reader]:
    """Return the functions of the sensors that distort readings."""
    made = [effect.reader(sensors, streams, n) for effect in SENSOR_EFFECTS.values()]
    return [reader for reader in made if reader is not None]
