"""Closed loops of a batch: from encoder readings to currents in every control period.

In NumPy between the steps of MuJoCo:

    dq   <- dq + b ((q - q_before) / T - dq)           low-passed difference of readings, b = 1 - exp(-2 pi f_c T)
    s    <- s + Ki T (q_ref - q)                       integral action, if any
    v     = Kp (q_ref - q) + Kd (dq_ref - dq) + s + tau_ff,   all divided by g_assumed

limited by the drive to |v| <= v_max (`sim.plant`). q is the encoder reading, so encoder noise enters v through the
loop. The part that does not depend on the reading, `(Kp q_ref + Kd dq_ref + tau_ff) / g_assumed`, is tabulated with the
motion (`sim.controller`) and called reference.
"""

from collections.abc import Callable, Sequence

import numpy as np

from ident.support.arrays import Array
from sim.controller import Controller
from sim.engine import Engine
from sim.sensors import SENSORS, SensorOptions
from sim.sensors.sensor import NoiseStreams

CHUNK = 100
"""Number of control periods whose references are gathered and whose logs are stored together; they fit in the cache."""
Advanced = Callable[[float], None]
"""Callback that receives the simulated time since the last call, summed over all simulations [s]."""


def no_progress(seconds: float) -> None:
    """Callback that does nothing."""


def closed_loop(
    engine: Engine,
    controllers: Sequence[Controller],
    limits: Array,
    sensors: Sequence[SensorOptions],
    streams: Sequence[NoiseStreams],
    *,
    advanced: Advanced = no_progress,
) -> tuple[Array, Array]:
    """Run B simulations, at rest at the start of their motions, to the end.

    Controllers are of equal length and period; limits of the currents [drive units] have the shape (B, n). Returned are
    encoder readings [rad] and current references [drive units] of every control period, each (B, N, n).
    """
    samples, (B, n) = len(controllers[0].reference), engine.q.shape
    q_log, v_log = np.empty((2, B, samples, n))
    made = [sensor.reader(sensors, streams, n) for sensor in SENSORS.values()]
    readers = [reader for reader in made if reader is not None]
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
        q_log[:, rows] = periods.reading[:length].transpose(1, 0, 2)
        v_log[:, rows] = periods.v[:length].transpose(1, 0, 2)
        advanced(B * length * controllers[0].period)
    return q_log, np.clip(v_log, -limits[:, None], limits[:, None], out=v_log)


class ControlPeriods:
    """B controllers in a sequence of control periods, with their readings and commands.

    With few simulations, the number of NumPy calls determines the computing time. Values that undergo the same
    operation are therefore adjacent in memory, and all views are created once.

    Attributes:
        reference: Tabulated part of the current, written before the run [drive units], shape (length, B, n).
        q_ref: Reference positions, written before the run, used only by the integral action [rad], shape (length, B,
            n); None without integral action.
        reading: Encoder readings, written right before the period is commanded [rad], shape (length, B, n).
        v: Current references before saturation [drive units], shape (length, B, n).
    """

    def __init__(self, controllers: Sequence[Controller], length: int) -> None:
        """Allocate the memory of a run of `length` control periods, for controllers of equal period."""
        kp, self._kd, ki = (np.stack([getattr(c, name) for c in controllers]) for name in ("kp", "kd", "ki"))
        B, n = kp.shape
        keeps, takes = (
            np.repeat([[each] for each in shares], n, axis=1)
            for shares in ([1.0 - c.blend for c in controllers], [c.blend / c.period for c in controllers])
        )
        self._coefficients = np.stack((-kp, keeps, np.ones((B, n)), takes))  # whole arrays: broadcasting costs
        self._ki = ki if ki.any() else None
        self._memory = np.zeros((length + 2, 4, B, n))  # a period before, then the run, then where its last one ends
        self.reading, self.reference = self._memory[1:-1, 0], self._memory[1:-1, 2]
        self.q_ref = None if self._ki is None else np.zeros((length, B, n))
        self.v = np.zeros((length, B, n))
        # Of a period: readings, speed estimate of the period before, reference, difference to the readings before. The
        # results, reference minus position feedback and speed estimate, are where the next period has its first two.
        rows = zip(self._memory, self._memory[1:], self._memory[2:], self.v, strict=False)
        self._periods = [
            (now[0], before[0], now[3], now, after[:2], after[0], after[1], v) for before, now, after, v in rows
        ]
        self._products, self._product = np.empty((4, B, n)), np.empty((B, n))
        self._first, self._second = self._products[:2], self._products[2:]
        self._integral = np.zeros((B, n))

    def switch_on(self, reading: Array) -> None:
        """Put the controllers at rest before the first period, at a reading [rad], shape (B, n)."""
        self._memory[0, 0] = reading
        self._memory[1, 1] = self._integral[:] = 0.0

    def go_on(self) -> None:
        """Continue from the last period."""
        self._memory[0, 0], self._memory[1, 1] = self._memory[-2, 0], self._memory[-1, 1]

    def command(self, k: int) -> Array:
        """Compute the currents of period k from its reading and the preceding period: a row of `v`, shape (B, n)."""
        reading, before, difference, known, after, left, dq, v = self._periods[k]
        np.subtract(reading, before, difference)
        np.multiply(self._coefficients, known, self._products)
        np.add(self._first, self._second, after)
        np.multiply(self._kd, dq, self._product)
        np.subtract(left, self._product, v)
        if self._ki is not None and self.q_ref is not None:
            self._integral += self._ki * (self.q_ref[k] - reading)
            np.add(v, self._integral, v)
        return v
