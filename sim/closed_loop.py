"""The control law at work: encoder readings in, currents out, for every period of a batch."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ident.support.arrays import Array
from sim.control_law import ControlLaw, at_rest, control_step
from sim.controller import Controller
from sim.engine import Engine
from sim.sensors import SENSOR_EFFECTS, SensorOptions
from sim.sensors.effect import NoiseStreams, Reader

CHUNK = 500
"""Control periods whose references are gathered, and whose logs are stored, at once."""
Advanced = Callable[[float], None]
"""Is told how many seconds of motion have been simulated since the last time, of all simulations together [s]."""


def no_progress(seconds: float) -> None:
    """What nobody listens to."""


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

    For a few simulations the cost of this loop is the number of NumPy calls, not arithmetic. A chunk of periods is time
    first, as the loop reads and writes it; the log is simulation first, as it is used.

    Args:
        engine: The simulations, at rest at the start of their motions.
        controllers: One a simulation, of equal length and period.
        limits: Current limits [drive units], shape (B, n).
        sensors: One a simulation.
        streams: Random numbers of the sensors, one a simulation.
        advanced: Told after every chunk.
    """
    law, readers = control_law(controllers, limits), _readers(sensors, streams, limits.shape[1])
    samples, (B, n) = len(controllers[0].reference), engine.q.shape
    log = LoopLog(np.empty((B, samples, n)), np.empty((B, samples, n)))
    reference, q_ref, readings, currents = np.empty((4, CHUNK, B, n))
    state = at_rest(engine.q)
    for start in range(0, samples, CHUNK):
        length = min(CHUNK, samples - start)
        for i, controller in enumerate(controllers):
            reference[:length, i] = controller.reference[start : start + length]
            if law.ki is not None:
                q_ref[:length, i] = controller.q_ref[start : start + length]
        for k in range(length):
            reading = readings[k]
            reading[:] = engine.q
            for distort in readers:
                distort(reading)
            if start + k == 0:
                state = at_rest(reading)
            state, currents[k] = control_step(law, state, reading, reference[k], q_ref[k])
            engine.current[:] = currents[k]
            engine.advance()
        state = state._replace(q=state.q.copy())  # the next chunk overwrites the readings
        log.q[:, start : start + length] = readings[:length].transpose(1, 0, 2)
        log.v[:, start : start + length] = currents[:length].transpose(1, 0, 2)
        advanced(B * length * controllers[0].period)
    return log


def control_law(controllers: Sequence[Controller], limits: Array) -> ControlLaw:
    """The law of B controllers.

    Args:
        controllers: One a simulation.
        limits: Current limits [drive units], shape (B, n).
    """
    n = limits.shape[1]
    ki = np.stack([c.ki for c in controllers])
    return ControlLaw(
        kp=np.stack([c.kp for c in controllers]),
        kd=np.stack([c.kd for c in controllers]),
        ki=ki if ki.any() else None,
        keep=np.repeat([[1.0 - c.blend] for c in controllers], n, axis=1),
        per_second=np.repeat([[c.blend / c.period] for c in controllers], n, axis=1),
        limit=limits,
    )


def _readers(sensors: Sequence[SensorOptions], streams: Sequence[NoiseStreams], n: int) -> list[Reader]:
    """What distorts readings, of those sensors that do."""
    made = [effect.reader(sensors, streams, n) for effect in SENSOR_EFFECTS.values()]
    return [reader for reader in made if reader is not None]
