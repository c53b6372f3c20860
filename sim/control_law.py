"""The control law of a digital joint controller in one control period.

    dq   <- dq + b ((q - q_before) / T - dq)           low-passed difference of readings, b = 1 - exp(-2 pi f_c T)
    s    <- s + Ki T (q_ref - q)                       integral action, if any
    v     = Kp (q_ref - q) + Kd (dq_ref - dq) + s + tau_ff,   all divided by g_assumed

limited by the drive to |v| <= v_max (`sim.compile`). q is the encoder reading, so encoder noise enters v through the
loop. The part that does not depend on the reading, `(Kp q_ref + Kd dq_ref + tau_ff) / g_assumed`, is tabulated with the
motion (`sim.controller`) and called reference.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ident.support.arrays import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ControlLaw:
    """The constants of B controllers with n joints, as full arrays, because broadcasting is slow in the loop.

    Attributes:
        feedback: Kp [drive units / rad] and Kd [drive units s / rad] over assumed gain, shape (2, B, n).
        estimate: Coefficients of the speed estimate: 1 - b of its previous value, b / T of the difference [1/s], shape
            (2, B, n).
        ki: Ki over assumed gain, times the period [drive units / rad], shape (B, n); None without integral action.
    """

    feedback: Array
    estimate: Array
    ki: Array | None


class _Period(NamedTuple):
    """Views of the memory of one control period, and of the period before; shape (B, n), or (2, B, n) for two.

    Attributes:
        reading: Readings [rad].
        before: Readings of the preceding period [rad].
        difference: `reading` minus `before` [rad].
        known: Speed estimate of the preceding period [rad/s], and the difference [rad].
        dq: Speed estimate [rad/s].
        state: Readings and speed estimate.
        reference: Tabulated part of the current [drive units].
        q_ref: Reference positions [rad].
        v: Current references [drive units].
    """

    reading: Array
    before: Array
    difference: Array
    known: Array
    dq: Array
    state: Array
    reference: Array
    q_ref: Array
    v: Array


class ControlPeriods:
    """B controllers in a sequence of control periods, with their readings and commands.

    With few simulations, the number of NumPy calls determines the computing time. Values with the same operation are
    therefore adjacent in memory, and all views are created once.

    Attributes:
        reference: Tabulated part of the current, written before the run [drive units], shape (length, B, n).
        q_ref: Reference positions, written before the run, used only by the integral action [rad], shape (length, B,
            n).
        reading: Encoder readings, written in every period [rad], shape (length, B, n).
        v: Current references before saturation [drive units], shape (length, B, n).
    """

    def __init__(self, law: ControlLaw, length: int) -> None:
        """Allocate the memory.

        Args:
            law: Their constants.
            length: Number of control periods of a run.
        """
        _, B, n = law.feedback.shape
        self._law = law
        self.reference, self.q_ref, self.v = np.zeros((3, length, B, n))
        self._memory = np.zeros((length + 1, 3, B, n))  # reading, speed estimate, difference to the next reading
        self.reading = self._memory[1:, 0]
        rows = zip(self._memory[:-1], self._memory[1:], self.reference, self.q_ref, self.v, strict=True)
        self._periods = [
            _Period(now[0], before[0], before[2], before[1:], now[1], now[:2], *others) for before, now, *others in rows
        ]
        self._products = np.empty((2, B, n))
        self._first, self._second = self._products
        self._integral = np.zeros((B, n))

    def switch_on(self, reading: Array) -> None:
        """Put the controllers at rest before the first period, at a reading [rad], shape (B, n)."""
        self._memory[0] = self._integral[:] = 0.0
        self._memory[0, 0] = reading

    def go_on(self) -> None:
        """Continue from the last period."""
        self._memory[0] = self._memory[-1]

    def command(self, k: int) -> Array:
        """Compute the currents of period k from its reading and the preceding period: a row of `v`, shape (B, n)."""
        reading, before, difference, known, dq, state, reference, q_ref, v = self._periods[k]
        law, products, first, second = self._law, self._products, self._first, self._second
        np.subtract(reading, before, difference)
        np.multiply(law.estimate, known, products)
        np.add(first, second, dq)
        np.multiply(law.feedback, state, products)
        np.subtract(reference, first, v)
        np.subtract(v, second, v)
        if law.ki is not None:
            np.subtract(q_ref, reading, first)
            np.multiply(law.ki, first, first)
            np.add(self._integral, first, self._integral)
            np.add(v, self._integral, v)
        return v
