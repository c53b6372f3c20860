"""Periodic torque over the position of the motor: cogging is additive, torque ripple multiplicative.

    tau = (1 + torque_ripple sin(k q + 1)) g (v - v0) - cogging |g| v_max sin(k q),      k = motor_waves

q is the position of the driven joint, which is that of the motor on the joint side. The phases of both differ by 1 rad,
so that they do not cancel.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from annotated_types import Interval

from sim.effects.effect import Build, ControlStep, Effect, Term, Values, each_drive, each_value

PHASE = 1.0
"""Phase of ripple relative to cogging [rad]."""


@dataclass(frozen=True, kw_only=True)
class Cogging(Values):
    """Periodic torque over the position of every motor.

    Attributes:
        cogging: Amplitude of cogging, as a share of the drive's largest torque.
        torque_ripple: Amplitude of ripple, as a share of the drive's torque.
        motor_waves: Periods per turn of the joint: periods per turn of the motor times the gear ratio; assumed.
    """

    cogging: Annotated[float, Interval(ge=0.0, le=1.0)] = 0.0
    torque_ripple: Annotated[float, Interval(ge=0.0, le=1.0)] = 0.0
    motor_waves: Annotated[float, Interval(gt=0.0, le=1e5)] = 600.0


def _term(values: Sequence[Cogging], builds: Sequence[Build]) -> Term:
    gain, offset, limit = each_drive(builds, "gain", "amplifier_offset", "current_limit")
    waves, ripple, cogging = each_value(values, "motor_waves", "torque_ripple", "cogging")
    ripple, cogging = ripple * gain, cogging * np.abs(gain) * limit  # (B, n)

    def add(step: ControlStep) -> None:
        angle = waves * step.q
        step.torque[:] += ripple * np.sin(angle + PHASE) * (step.v - offset) - cogging * np.sin(angle)

    return add


EFFECT = Effect[Cogging](
    varies=lambda values: values.cogging > 0.0 or values.torque_ripple > 0.0, term=_term, instant=True
)
