"""Backlash of elastic transmissions: within the gap only damping acts.

With d = q_motor - q_link and b = backlash the spring of a transmission gives Ke (|d| - b / 2) sign(d) if |d| exceeds b
/ 2, otherwise 0. At the start of a motion every link is on the side to which gravity pulls it.
"""

from dataclasses import dataclass
from typing import Annotated

import mujoco
import numpy as np
from annotated_types import Interval, Unit

from ident.support.arrays import Array
from sim.drives import DriveTruth
from sim.effects.effect import Build, Effect
from sim.effects.joint_elasticity import JointElasticity, sag, transmissions
from sim.errors import EffectError
from sim.robot import Robot

NOTHING = 1e-9
"""Torque [N m] below which rounding errors dominate: it moves no link to either side."""


@dataclass(frozen=True, kw_only=True)
class Backlash(JointElasticity):
    """Backlash of the transmissions.

    Attributes:
        backlash: Angle by which every link can turn relative to its motor without torque [rad].
    """

    backlash: Annotated[float, Interval(ge=0.0, le=0.1), Unit("rad")] = 0.0


def _fits(values: Backlash, robot: Robot, drives: DriveTruth) -> None:
    if values.backlash and values.joint_compliance is None:
        raise EffectError(
            f"errors: backlash = {values.backlash:g} rad needs elastic transmissions; state joint_compliance"
        )


def _open(values: Backlash, model: mujoco.MjModel, build: Build) -> None:
    if values.backlash:
        model.tendon_lengthspring[transmissions(model)] = (-0.5 * values.backlash, 0.5 * values.backlash)


def _hang(values: Backlash, model: mujoco.MjModel, state: Array) -> None:
    """Move links to one side of the gap, then to equilibrium."""
    if not values.backlash:
        return
    n, data = model.nu, mujoco.MjData(model)
    data.qpos[:] = state
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    gravity = np.where(np.abs(data.qfrc_bias[:n]) > NOTHING, data.qfrc_bias[:n], 0.0)
    state[:n] = state[n:] - 0.5 * values.backlash * np.sign(gravity)
    sag(model, state)


EFFECT = Effect[Backlash](fits=_fits, after_compile=_open, settle=_hang)
