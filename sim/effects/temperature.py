"""Drives that warm up: one temperature per drive, and its effects.

    T dx/dt = W (v / v_max)^2 - x                      W motor_warming, T warming_time, x the rise above the cold drive
    tau = g (1 + gain_by_temperature x) (v - v0)
    Fc exp(coulomb_by_temperature x),  Fv exp(viscous_by_temperature x)

W v^2 / v_max^2 is the equilibrium of I^2 R heating and cooling. The solution is exact over a period with constant
current. The temperature rise continues between the motions of an experiment (`sim.sequence`), with v = 0 during the
rests.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from annotated_types import Interval, Unit

from ident.numerics.filters import filtered
from ident.support.arrays import Array
from sim.drives import DriveTruth
from sim.effects.effect import Build, ControlStep, Effect, Term, Values, each_drive, each_value
from sim.effects.wrist_coupling import coupled_motors
from sim.errors import EffectError
from sim.robot import Robot


@dataclass(frozen=True, kw_only=True)
class Temperature(Values):
    """Warming of the drives and its effects.

    Attributes:
        motor_warming: Steady-state temperature rise of a drive at its largest current [K].
        warming_time: Time constant of warming and cooling [s]; assumed.
        gain_by_temperature: Relative change of the gain per temperature rise [1/K]; negative, as magnets weaken.
        coulomb_by_temperature: Relative change of dry friction per temperature rise [1/K].
        viscous_by_temperature: Relative change of viscous friction per temperature rise [1/K].
    """

    motor_warming: Annotated[float, Interval(ge=0.0, le=1e4), Unit("K")] = 0.0
    warming_time: Annotated[float, Interval(ge=1.0, le=1e6), Unit("s")] = 1800.0
    gain_by_temperature: Annotated[float, Interval(ge=-0.01, le=0.01), Unit("1/K")] = 0.0
    coulomb_by_temperature: Annotated[float, Interval(ge=-0.1, le=0.1), Unit("1/K")] = 0.0
    viscous_by_temperature: Annotated[float, Interval(ge=-0.1, le=0.1), Unit("1/K")] = 0.0


def _fits(values: Temperature, robot: Robot, drives: DriveTruth) -> None:
    limit = np.asarray(drives.current_limit)
    if values.motor_warming and not limit.all():
        raise EffectError(
            "errors: motor_warming refers to the current limit, but current_limit of joint "
            f"{int(np.argmin(limit)) + 1} is 0; state one above 0"
        )


def warmed(values: Temperature, warmth: Array, load: Array, seconds: float) -> Array:
    """Return the temperature rise after some time at constant load.

    Args:
        values: Warming of the drives.
        warmth: Initial temperature rise [K], shape (n,).
        load: Mean square of the current relative to its limit, shape (n,); 0 for a rest.
        seconds: Duration [s].
    """
    settled = values.motor_warming * load
    return settled + (warmth - settled) * np.exp(-seconds / values.warming_time)


def warming(values: Temperature, warmth: Array, load: Array, period: float) -> Array:
    """Temperature rise along a motion.

    Args:
        values: Warming of the drives.
        warmth: Temperature rise at its start [K], shape (n,).
        load: Square of the current relative to its limit in each period, shape (N, n).
        period: Control period [s].

    Returns:
        Temperature rise at the start of each period and at the end of the last [K], shape (N + 1, n).
    """
    kept = np.exp(-period / values.warming_time)
    settled = values.motor_warming * load
    lag = np.array([[1.0 - kept, 0.0, 0.0, 1.0, -kept, 0.0]])
    return np.concatenate((warmth[None], warmth + filtered(lag, settled - warmth)))


def _term(values: Sequence[Temperature], builds: Sequence[Build]) -> Term:
    gain, offset, limit = each_drive(builds, "gain", "amplifier_offset", "current_limit")
    warming, time = each_value(values, "motor_warming", "warming_time")
    by_gain, by_coulomb, by_viscous = each_value(
        values, "gain_by_temperature", "coulomb_by_temperature", "viscous_by_temperature"
    )
    heat = warming / np.where(limit > 0.0, limit, np.inf) ** 2  # (B, n) K per squared current
    rubbing = np.stack([[*range(b.robot.n), *coupled_motors(b.robot)] for b in builds])  # (B, n + c) whose drive it is

    def add(step: ControlStep) -> None:
        step.torque[:] += by_gain * step.warmth * gain * (step.v - offset)
        rise = np.take_along_axis(step.warmth, rubbing[:, : step.friction.shape[1]], axis=1)
        step.friction[:] *= np.exp(by_coulomb * rise)
        step.damping[:] *= np.exp(by_viscous * rise)
        settled = heat * step.v**2
        step.warmth[:] = settled + (step.warmth - settled) * np.exp(-step.period / time)

    return add


def varies(values: Temperature) -> bool:
    """Return whether drives warm up and a parameter depends on it."""
    return values.motor_warming > 0.0 and bool(
        values.gain_by_temperature or values.coulomb_by_temperature or values.viscous_by_temperature
    )


EFFECT = Effect[Temperature](fits=_fits, varies=varies, term=_term, instant=True)
