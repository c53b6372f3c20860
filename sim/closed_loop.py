"""The control law at work: encoder readings in, currents out, for every period of a batch."""

from collections.abc import Sequence

import numpy as np

from ident.arrays import Array
from sim.controller import Controller
from sim.engine import Engine
from sim.sensors import SensorOptions

CHUNK = 500
"""Control periods whose encoder noise is drawn, and whose logs are stored, at once."""


def closed_loop(
    engine: Engine,
    controllers: Sequence[Controller],
    limits: Array,
    sensors: Sequence[SensorOptions],
    encoders: Sequence[np.random.Generator],
) -> tuple[Array, Array]:
    """Run B simulations to the end of their motions.

    The law is written with in-place operations on (B, n) arrays: for a few simulations the cost of this loop is the
    number of NumPy calls, not arithmetic. A chunk of periods is time first, as the loop reads and writes it; the log
    is simulation first, as it is used.

    Args:
        engine: The simulations, at rest at the start of their motions.
        controllers: One a simulation, of equal length and period.
        limits: Current limits [drive units], shape (B, n).
        sensors: Encoders, one a simulation.
        encoders: Sources of encoder noise, one a simulation.

    Returns:
        Encoder readings [rad] and current references [drive units] of every control period, each (B, N, n).
    """
    kp, kd, ki = (np.stack([getattr(c, name) for c in controllers]) for name in ("kp", "kd", "ki"))
    keep, per_second, quantum = (
        np.repeat(np.array(values)[:, None], limits.shape[1], axis=1)  # whole arrays: broadcasting costs in the loop
        for values in (
            [1.0 - c.blend for c in controllers],
            [c.blend / c.period for c in controllers],
            [s.encoder_quantum for s in sensors],
        )
    )
    noise_std = np.array([[[s.encoder_noise]] for s in sensors])
    integral = bool(ki.any())
    samples, (B, n) = len(controllers[0].reference), engine.q.shape
    q_log, v_log = np.empty((B, samples, n)), np.empty((B, samples, n))
    reference, noise, readings, currents = np.empty((4, CHUNK, B, n))
    drawn = np.empty((B, CHUNK, n))
    dq, total, change, previous = *np.zeros((3, B, n)), engine.q.copy()
    quantised, below = quantum > 0.0, -limits
    rounding = bool(quantised.any())
    resolution = np.where(quantised, quantum, 1.0)
    for start in range(0, samples, CHUNK):
        stop = min(start + CHUNK, samples)
        length = stop - start
        for i, (controller, encoder) in enumerate(zip(controllers, encoders, strict=True)):
            reference[:length, i] = controller.reference[start:stop]
            encoder.standard_normal(out=drawn[i, :length])
        np.multiply(drawn[:, :length], noise_std, out=noise[:length].transpose(1, 0, 2))
        for k in range(length):
            reading, v = readings[k], currents[k]
            np.add(engine.q, noise[k], out=reading)
            if rounding:
                np.divide(reading, resolution, out=change)
                np.rint(change, out=change)
                change *= resolution
                np.copyto(reading, change, where=quantised)
            if start + k == 0:
                previous[:] = reading
            np.subtract(reading, previous, out=change)
            change *= per_second
            dq *= keep
            dq += change
            previous[:] = reading
            np.multiply(kp, reading, out=change)
            np.subtract(reference[k], change, out=v)
            np.multiply(kd, dq, out=change)
            v -= change
            if integral:
                total += ki * (np.stack([c.q_ref[start + k] for c in controllers]) - reading)
                v += total
            np.minimum(v, limits, out=v)
            np.maximum(v, below, out=v)
            engine.current[:] = v
            engine.advance()
        q_log[:, start:stop] = readings[:length].transpose(1, 0, 2)
        v_log[:, start:stop] = currents[:length].transpose(1, 0, 2)
    return q_log, v_log
