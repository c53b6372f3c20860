"""Presliding: dry friction develops over a distance (Dahl 1968; LuGre without its damping).

    ds/dt = (1 - s sign(dq)) dq / presliding,      tau = -F s

F is the total dry friction of the joint or the coupled motor, and s, between -1 and 1, its relative deflection, 0 at
the start of a motion. At constant speed the law has an exact solution over a control period, which is stable for any
distance. The torque is held over the period, which limits the stiffness F / presliding for a given rotor and period.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from annotated_types import Interval, Unit

from ident.support.arrays import Array
from sim.drives import DriveTruth
from sim.effects.effect import Build, ControlStep, Effect, Term, Values, each_value
from sim.errors import EffectError
from sim.robot import Robot

STIFFEST = 400.0
"""Largest natural frequency of a rotor on its presliding stiffness [rad/s]: 0.4 rad in a period of 1 ms."""


@dataclass(frozen=True, kw_only=True)
class Presliding(Values):
    """Elastic deflection before sliding.

    Attributes:
        presliding: Distance after which dry friction has reached 63 % [rad]; 0 for immediate friction.
    """

    presliding: Annotated[float, Interval(ge=0.0, le=1.0), Unit("rad")] = 0.0


def _fits(values: Presliding, robot: Robot, drives: DriveTruth) -> None:
    if not values.presliding:
        return
    friction, inertia = (np.asarray(x, dtype=np.float64) for x in (drives.coulomb_friction, drives.rotor_inertia))
    least = np.divide(friction, inertia * STIFFEST**2, out=np.full(robot.n, np.inf), where=inertia > 0.0)
    j = int(np.argmax(least))
    if values.presliding < least[j]:
        raise EffectError(
            f"errors: presliding = {values.presliding:g} rad is too stiff for joint {j + 1}, whose dry friction is "
            f"{friction[j]:g} N m on a rotor of {inertia[j]:g} kg m^2; expected {least[j]:.3g} rad or more"
        )


def _term(values: Sequence[Presliding], builds: Sequence[Build]) -> Term:
    (distance,) = each_value(values, "presliding")
    builds_up = distance > 0.0
    distance = np.where(builds_up, distance, 1.0)
    deflection: list[Array] = []  # (B, n + c), from the first period on

    def add(step: ControlStep) -> None:
        if not deflection:
            deflection.append(np.zeros_like(step.speed))
        s = deflection[0]
        force = np.where(builds_up, s * step.friction, 0.0)
        step.torque[:] -= (step.turns.transpose(0, 2, 1) @ force[:, :, None])[:, :, 0]
        step.friction[:] = np.where(builds_up, 0.0, step.friction)
        side = np.sign(step.speed)
        s[:] = side + (s - side) * np.exp(-np.abs(step.speed) * step.period / distance)

    return add


def _along(values: Presliding, build: Build) -> Term:
    """Between two reversals s - sign(dq) decays with the distance since the first of them."""
    distance = values.presliding

    def add(step: ControlStep) -> None:
        side, moved = np.sign(step.speed), np.abs(step.speed) * step.period  # (N, n + c)
        s = np.zeros_like(moved)
        for k in range(moved.shape[1]):
            turns = np.flatnonzero(np.diff(side[:, k])) + 1
            before = 0.0
            for begin, end in zip((0, *turns), (*turns, len(side)), strict=True):
                travelled = np.concatenate(([0.0], np.cumsum(moved[begin:end, k])))
                course = side[begin, k] + (before - side[begin, k]) * np.exp(-travelled / distance)
                s[begin:end, k], before = course[:-1], course[-1]
        step.torque[:] -= (s * step.friction) @ step.turns[0]
        step.friction[:] = 0.0

    return add


EFFECT = Effect[Presliding](fits=_fits, varies=lambda values: values.presliding > 0.0, term=_term, along=_along)
