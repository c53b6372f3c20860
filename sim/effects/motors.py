"""Effects of the motors: torque that is periodic over their position, gains that vary, and temperature.

    cogging, ripple    tau = (1 + torque_ripple sin(k q + 1)) g (v - v0) - cogging |g| v_max sin(k q),  k = motor_waves
    gain laws          tau = (1 - falls |v / v_max| - bends (v / v_max)^2 + gain_by_sign sign(v) / 2 + d) g (v - v0)
                       1 + d = (1 + gain_drift)^k in the motion after k others
    temperature        T dx/dt = W (v / v_max)^2 - x          W motor_warming, T warming_time, x the rise above cold
                       tau = g (1 + gain_by_temperature x) (v - v0)
                       Fc exp(coulomb_by_temperature x),  Fv exp(viscous_by_temperature x)

q is the position of the driven joint, which is that of the motor on the joint side. The phases of cogging and ripple
differ by 1 rad, so that they do not cancel. W v^2 / v_max^2 is the equilibrium of I^2 R heating and cooling. The
solution is exact over a period with constant current. The temperature rise continues between the motions of an
experiment (`sim.experiment`), with v = 0 during the rests.
"""

from dataclasses import dataclass, fields
from typing import Annotated

import numpy as np
from annotated_types import Interval, Unit

from ident.numerics.filters import filtered
from ident.support.arrays import Array
from sim.effects.effect import ControlStep, Effect, Share, Stacked
from sim.errors import PlantError
from sim.robot import DriveTruth, Robot

Change = Annotated[float, Interval(ge=-0.4, le=0.4)]


@dataclass(frozen=True, kw_only=True)
class Cogging(Effect):
    """Periodic torque over the position of every motor, whose periods per turn the gear ratio multiplies."""

    cogging: Share = 0.0  # amplitude of cogging, as a share of the drive's largest torque
    torque_ripple: Share = 0.0  # amplitude of ripple, as a share of the drive's torque
    motor_waves: Annotated[float, Interval(gt=0.0, le=1e5)] = 600.0  # periods per turn of the joint, not motor; assumed

    @staticmethod
    def act(values: Stacked, drives: Stacked, step: ControlStep) -> None:
        gain, angle = drives["gain"], values["motor_waves"] * step.q
        ripple = values["torque_ripple"] * gain * np.sin(angle + 1.0) * (step.v - drives["amplifier_offset"])
        step.torque[:] += ripple - values["cogging"] * np.abs(gain) * drives["current_limit"] * np.sin(angle)


@dataclass(frozen=True, kw_only=True)
class GainLaws(Effect):
    """Gains that depend on size and sign of the current and change from motion to motion."""

    torque_constant_falls: Change = 0.0  # relative fall to the largest current, in proportion to it, as iron saturates
    torque_constant_bends: Change = 0.0  # the same in proportion to the square of the current
    gain_by_sign: Change = 0.0  # gain at positive minus that at negative current, as a share of their mean
    gain_drift: Change = 0.0  # relative change of a gain from each motion to the next

    def fits(self, robot: Robot, drives: DriveTruth) -> None:
        if self.torque_constant_falls or self.torque_constant_bends:
            _refuse_no_limit("torque_constant_falls and torque_constant_bends refer", drives)

    @staticmethod
    def act(values: Stacked, drives: Stacked, step: ControlStep) -> None:
        law = (1.0 + values["gain_drift"]) ** drives["earlier"] - 1.0 + 0.5 * values["gain_by_sign"] * np.sign(step.v)
        law -= _fall(values["torque_constant_falls"], values["torque_constant_bends"], step.v, drives["current_limit"])
        step.torque[:] += law * drives["gain"] * (step.v - drives["amplifier_offset"])


def gain_at(values: GainLaws, drives: DriveTruth, current: Array) -> Array:
    """Return the gains at stated currents [drive units] in the first motion, mean of both signs, shape (n,)."""
    fall = _fall(values.torque_constant_falls, values.torque_constant_bends, current, drives.current_limit)
    return drives.gain * (1.0 - fall)


def _fall(falls: Array | float, bends: Array | float, current: Array, limit: Array) -> Array:
    share = np.abs(current) / np.where(limit > 0.0, limit, np.inf)
    return falls * share + bends * share**2


def _refuse_no_limit(what: str, drives: DriveTruth) -> None:
    limit = np.asarray(drives.current_limit)
    if not limit.all():
        joint = int(np.argmin(limit)) + 1
        raise PlantError(
            f"errors: {what} to the current limit, but current_limit of joint {joint} is 0; state one above 0"
        )


@dataclass(frozen=True, kw_only=True)
class Temperature(Effect):
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

    def fits(self, robot: Robot, drives: DriveTruth) -> None:
        if self.motor_warming:
            _refuse_no_limit("motor_warming refers", drives)

    @classmethod
    def varies(cls, values: object) -> bool:
        """Return whether drives warm up and a parameter depends on it."""
        warms, *effects = (getattr(values, each.name) for each in fields(cls) if not each.default)
        return bool(warms and any(effects))

    @staticmethod
    def act(values: Stacked, drives: Stacked, step: ControlStep) -> None:
        by_gain, limit = values["gain_by_temperature"] * step.warmth * drives["gain"], drives["current_limit"]
        step.torque[:] += by_gain * (step.v - drives["amplifier_offset"])
        motor = np.asarray(drives["motor"], np.intp)[:, : step.friction.shape[1]]
        rise = np.take_along_axis(step.warmth, motor, axis=1)
        step.friction[:] *= np.exp(values["coulomb_by_temperature"] * rise)
        step.damping[:] *= np.exp(values["viscous_by_temperature"] * rise)
        settled = values["motor_warming"] / np.where(limit > 0.0, limit, np.inf) ** 2 * step.v**2
        step.warmth[:] = settled + (step.warmth - settled) * np.exp(-step.period / values["warming_time"])


def warmed(values: Temperature, warmth: Array, load: Array, seconds: float) -> Array:
    """Return the temperature rise [K], (n,), after a time at constant load, the mean square of v / v_max, (n,)."""
    settled = values.motor_warming * load
    return settled + (warmth - settled) * np.exp(-seconds / values.warming_time)


def warming(values: Temperature, warmth: Array, load: Array, period: float) -> Array:
    """Return the temperature rise at the start of each period and the end of the last [K], (N + 1, n)."""
    kept = np.exp(-period / values.warming_time)
    settled = values.motor_warming * load
    lag = np.array([[1.0 - kept, 0.0, 0.0, 1.0, -kept, 0.0]])
    return np.concatenate((warmth[None], warmth + filtered(lag, settled - warmth)))
