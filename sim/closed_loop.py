"""Closed-loop simulation: from encoder readings to currents in every control period of a batch."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ident.support.arrays import Array
from sim.control_law import ControlLaw, ControlPeriods
from sim.controller import Controller
from sim.engine import Engine
from sim.sensors import SENSOR_EFFECTS, SensorOptions
from sim.sensors.effect import NoiseStreams, Reader

CHUNK = 500
"""Number of control periods whose references are gathered and whose logs are stored together."""
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
    law, readers = control_law(controllers), _readers(sensors, streams, limits.shape[1])
    samples, (B, n) = len(controllers[0].reference), engine.q.shape
    log = LoopLog(np.empty((B, samples, n)), np.empty((B, samples, n)))
    periods = ControlPeriods(law, min(CHUNK, samples))
    q, current, readings = engine.q, engine.current, list(periods.reading)
    for start in range(0, samples, CHUNK):
        length = min(CHUNK, samples - start)
        for i, controller in enumerate(controllers):
            periods.reference[:length, i] = controller.reference[start : start + length]
            if law.ki is not None:
                periods.q_ref[:length, i] = controller.q_ref[start : start + length]
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
        log.q[:, start : start + length] = periods.reading[:length].transpose(1, 0, 2)
        log.v[:, start : start + length] = periods.v[:length].transpose(1, 0, 2)
        advanced(B * length * controllers[0].period)
    for v, limit in zip(log.v, limits, strict=True):
        np.clip(v, -limit, limit, out=v)
    return log


def control_law(controllers: Sequence[Controller]) -> ControlLaw:
    """Return the law of B controllers, one per simulation."""
    n, ki = len(controllers[0].kp), np.stack([c.ki for c in controllers])
    estimates = [[1.0 - c.blend for c in controllers], [c.blend / c.period for c in controllers]]
    return ControlLaw(
        feedback=np.array([[c.kp for c in controllers], [c.kd for c in controllers]]),
        estimate=np.repeat(np.array(estimates)[:, :, None], n, axis=2),
        ki=ki if ki.any() else None,
    )


def _readers(sensors: Sequence[SensorOptions], streams: Sequence[NoiseStreams], n: int) -> list[Reader]:
    """Return the functions of the sensors that distort readings."""
    made = [effect.reader(sensors, streams, n) for effect in SENSOR_EFFECTS.values()]
    return [reader for reader in made if reader is not None]
