"""Effects that act in every control period: what they write into the models of a batch.

MuJoCo's dry and viscous friction are constants of the model. Where they vary in time, they are written into that
simulation's model from state and currents at the start of the control period, and held over the period.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from ident.support.arrays import Array
from sim.compile import drive_constants
from sim.effects import EFFECTS, ModelErrors
from sim.effects.effect import Build, ControlStep, each_drive
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
        inertia: Rotors [kg m^2], shape (n + c,).
        turns: Speeds that it rubs at, as sums of joint speeds, shape (n + c, n).
        warmth: Temperature rise of the drives at the start of the motion [K], shape (n,).
    """

    errors: ModelErrors
    build: Build
    constant: Array
    damping: Array
    inertia: Array
    turns: Array
    warmth: Array


def varied(
    plant: Plant, model: mujoco.MjModel, *, step: float, earlier: int, warmth: Array | None = None
) -> Varied | None:
    """What acts on a plant in every control period, None if nothing does.

    Args:
        plant: The truth.
        model: Compiled from it.
        step: Physics step [s].
        earlier: Motions before this one, as it was compiled.
        warmth: Temperature rise of the drives at the start [K], shape (n,); None for cold ones.
    """
    if not any(effect.varies(plant.errors) for effect in EFFECTS.values()):
        return None
    return acting(plant, model, step=step, earlier=earlier, warmth=warmth)


def acting(plant: Plant, model: mujoco.MjModel, *, step: float, earlier: int, warmth: Array | None = None) -> Varied:
    """What acts on a plant in a control period, constant friction where nothing varies; arguments as `varied`."""
    constant, n = drive_constants(model, "frictionloss"), plant.robot.n
    turns = np.eye(len(constant), n)
    for row, coupling in zip(turns[n:], plant.robot.couplings, strict=False):  # no coupled motors, no rows
        row[[coupling.motor, coupling.turns_with]] = 1.0
    return Varied(
        errors=plant.errors,
        build=Build(robot=plant.robot, drives=plant.drives, earlier=earlier, step=step),
        constant=constant,
        damping=drive_constants(model, "damping"),
        inertia=drive_constants(model, "armature"),
        turns=turns,
        warmth=np.zeros(n) if warmth is None else warmth,
    )


class Varying:
    """The effects of several simulations of one layout, as one function of their states.

    Attributes:
        warmth: Temperature rise of the drives, now [K], shape (B, n).
    """

    def __init__(self, members: Sequence[Varied], models: Sequence[mujoco.MjModel], *, period: float) -> None:
        """Stack what does not change.

        Args:
            members: One a simulation.
            models: Their models, each a simulation's own.
            period: Control period [s].
        """
        errors, builds = [m.errors for m in members], [m.build for m in members]
        active = [effect for effect in EFFECTS.values() if any(effect.varies(each) for each in errors)]
        self._terms = [effect.term(errors, builds) for effect in active]
        self._constant, self._damping, self._inertia, self._turns, self.warmth = (
            np.stack([getattr(m, name) for m in members])
            for name in ("constant", "damping", "inertia", "turns", "warmth")
        )
        self._drive = each_drive(builds, "gain", "amplifier_offset", "coulomb_asymmetry")
        self._period = period
        self._written = [_friction_fields(model) for model in models]
        self._before: ControlStep | None = None

    def torque(self, *, t: float, q: Array, dq: Array, v: Array, ddq: Array, rubbing: Array) -> Array:
        """Write the friction of a control period, and return the torque beside that of the drives.

        Args:
            t: Time since the start of the motion [s].
            q: Positions of the driven joints at the start of the period [rad], shape (B, n).
            dq: Their speeds [rad/s], shape (B, n).
            v: Currents [drive units], shape (B, n).
            ddq: Accelerations in the last physics step [rad/s^2], shape (B, n).
            rubbing: Torque of dry friction in the last physics step [N m], shape (B, n).

        Returns:
            Torques [N m], shape (B, n).
        """
        step = ControlStep(
            t=t,
            period=self._period,
            q=q,
            dq=dq,
            v=v,
            constant=self._constant,
            speed=(self._turns @ dq[:, :, None])[:, :, 0],
            friction=self._constant.copy(),
            damping=self._damping.copy(),
            torque=np.zeros_like(dq),
            turns=self._turns,
            transmitted=self._transmitted(ddq, rubbing),
            warmth=self.warmth,
        )
        for add in self._terms:
            add(step)
        self._before = step
        for fields, dry, viscous in zip(self._written, step.friction, step.damping, strict=True):
            for (joints, couplings), row in zip(fields, (dry, viscous), strict=True):
                joints[:], couplings[:] = row[: len(joints)], row[len(joints) :]
        return step.torque

    def _transmitted(self, ddq: Array, rubbing: Array) -> Array:
        """What links took over in the period before: drives and friction less what sped up the rotors."""
        before = self._before
        if before is None:
            return np.zeros_like(ddq)
        gain, offset, asymmetry = self._drive
        spun = self._inertia * (self._turns @ ddq[:, :, None])[:, :, 0] + before.damping * before.speed
        motors = gain * (before.v - offset) - asymmetry + before.torque + rubbing
        return motors - (self._turns.transpose(0, 2, 1) @ spun[:, :, None])[:, :, 0]


def _friction_fields(model: mujoco.MjModel) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Live views of a model's dry, then viscous friction, each of driven joints (n,), and coupled motors (c,)."""
    driven, coupled = slice(-model.nu, None), coupling_tendons(model)
    return (
        (model.dof_frictionloss[driven], model.tendon_frictionloss[coupled]),
        (model.dof_damping[driven], model.tendon_damping[coupled]),
    )
