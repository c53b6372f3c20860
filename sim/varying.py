"""Effects that act in every control period: what they write into the models of a batch.

MuJoCo's dry and viscous friction are constants of the model. Where they vary in time, they are written into that
simulation's model from state and currents at the start of the control period, and held over the period.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from ident.arrays import Array
from sim.compile import damping_constants, friction_constants
from sim.effects import EFFECTS, ModelErrors
from sim.effects.effect import Build, ControlStep
from sim.effects.wrist_coupling import coupling_tendons
from sim.plant import Plant


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Varied:
    """A simulation with effects that act in every control period.

    Attributes:
        errors: Their values.
        build: What its model is made of.
        constant: Dry friction without them: joints, then coupled motors [N m], shape (n + c,).
        damping: Viscous friction without them [N m s/rad], shape (n + c,).
        turns: Speeds that it rubs at, as sums of joint speeds, shape (n + c, n).
    """

    errors: ModelErrors
    build: Build
    constant: Array
    damping: Array
    turns: Array


def varied(plant: Plant, model: mujoco.MjModel, *, step: float, earlier: int) -> Varied | None:
    """What acts on a plant in every control period, None if nothing does.

    Args:
        plant: The truth.
        model: Compiled from it.
        step: Physics step [s].
        earlier: Motions before this one, as it was compiled.
    """
    if not any(effect.varies(plant.errors) for effect in EFFECTS.values()):
        return None
    return acting(plant, model, step=step, earlier=earlier)


def acting(plant: Plant, model: mujoco.MjModel, *, step: float, earlier: int) -> Varied:
    """What acts on a plant in a control period, constant friction where nothing varies; arguments as `varied`."""
    constant, n = friction_constants(model), plant.robot.n
    turns = np.eye(len(constant), n)
    for row, coupling in zip(turns[n:], plant.robot.couplings, strict=False):  # no coupled motors, no rows
        row[[coupling.motor, coupling.turns_with]] = 1.0
    build = Build(robot=plant.robot, drives=plant.drives, earlier=earlier, step=step)
    damping = damping_constants(model)
    return Varied(errors=plant.errors, build=build, constant=constant, damping=damping, turns=turns)


class Varying:
    """The effects of several simulations of one layout, as one function of their states."""

    def __init__(self, members: Sequence[Varied], models: Sequence[mujoco.MjModel]) -> None:
        """Stack what does not change.

        Args:
            members: One a simulation.
            models: Their models, each a simulation's own.
        """
        errors, builds = [m.errors for m in members], [m.build for m in members]
        active = [effect for effect in EFFECTS.values() if any(effect.varies(each) for each in errors)]
        self._terms = [effect.term(errors, builds) for effect in active]
        self._constant = np.stack([m.constant for m in members])
        self._damping = np.stack([m.damping for m in members])
        self._turns = np.stack([m.turns for m in members])
        self._written = [_friction_fields(model) for model in models]

    def torque(self, t: float, q: Array, dq: Array, v: Array) -> Array:
        """Write the friction of a control period, and return the torque beside that of the drives.

        Args:
            t: Time since the start of the motion [s].
            q: Positions of the driven joints [rad], shape (B, n).
            dq: Their speeds [rad/s], shape (B, n).
            v: Currents [drive units], shape (B, n).

        Returns:
            Torques [N m], shape (B, n).
        """
        step = ControlStep(
            t=t,
            q=q,
            dq=dq,
            v=v,
            constant=self._constant,
            speed=(self._turns @ dq[:, :, None])[:, :, 0],
            friction=self._constant.copy(),
            damping=self._damping.copy(),
            torque=np.zeros_like(dq),
        )
        for add in self._terms:
            add(step)
        for fields, dry, viscous in zip(self._written, step.friction, step.damping, strict=True):
            for (joints, couplings), row in zip(fields, (dry, viscous), strict=True):
                joints[:], couplings[:] = row[: len(joints)], row[len(joints) :]
        return step.torque


def _friction_fields(model: mujoco.MjModel) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Live views of a model's dry, then viscous friction, each of driven joints (n,), and coupled motors (c,)."""
    driven, coupled = slice(-model.nu, None), coupling_tendons(model)
    return (
        (model.dof_frictionloss[driven], model.tendon_frictionloss[coupled]),
        (model.dof_damping[driven], model.tendon_damping[coupled]),
    )
