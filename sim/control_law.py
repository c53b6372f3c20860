"""The control law of a digital joint controller, one control period of it.

    dq   <- dq + b ((q - q_before) / T - dq)           low-passed difference of readings, b = 1 - exp(-2 pi f_c T)
    s    <- s + Ki T (q_ref - q)                       integral, where there is one
    v     = Kp (q_ref - q) + Kd (dq_ref - dq) + s + tau_ff,   all over g_believed, and |v| <= v_max

q is what the encoders read: their noise travels round the loop into v. What does not depend on the reading,
`(Kp q_ref + Kd dq_ref + tau_ff) / g_believed`, is tabulated with the motion (`sim.controller`) and called reference.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ident.support.arrays import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ControlLaw:
    """The constants of B controllers with n joints; whole arrays (B, n), since broadcasting costs in the loop.

    Attributes:
        kp: Kp over believed gain [drive units / rad].
        kd: Kd over believed gain [drive units s / rad].
        ki: Ki over believed gain, times the period [drive units / rad]; None if no controller integrates.
        keep: 1 - b, what the speed estimate keeps of itself.
        per_second: b / T, what it takes of a difference [1/s].
        limit: v_max [drive units].
    """

    kp: Array
    kd: Array
    ki: Array | None
    keep: Array
    per_second: Array
    limit: Array


class LoopState(NamedTuple):
    """What B controllers remember; arrays (B, n).

    Attributes:
        q: Last reading [rad].
        dq: Speed estimate [rad/s].
        integral: s over believed gain [drive units].
    """

    q: Array
    dq: Array
    integral: Array


class Command(NamedTuple):
    """What one period of the law gives.

    Attributes:
        state: To be remembered.
        v: Current references [drive units], shape (B, n).
    """

    state: LoopState
    v: Array


def at_rest(reading: Array) -> LoopState:
    """The memory of controllers that are switched on at a first reading, shape (B, n)."""
    return LoopState(reading, np.zeros_like(reading), np.zeros_like(reading))


def control_step(law: ControlLaw, state: LoopState, reading: Array, reference: Array, q_ref: Array) -> Command:
    """One control period.

    Args:
        law: Constants.
        state: Memory of the period before; not changed.
        reading: What the encoders read [rad], shape (B, n).
        reference: Tabulated part of the current [drive units], shape (B, n).
        q_ref: Reference positions, for the integral alone [rad], shape (B, n).
    """
    dq = law.keep * state.dq + law.per_second * (reading - state.q)
    v = reference - law.kp * reading - law.kd * dq
    integral = state.integral
    if law.ki is not None:
        integral = integral + law.ki * (q_ref - reading)
        v += integral
    v = np.maximum(np.minimum(v, law.limit), -law.limit)
    return Command(LoopState(reading, dq, integral), v)
