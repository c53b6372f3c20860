"""Motors that turn with the sum of two joints: a fixed tendon with armature and friction of the motor."""

from dataclasses import dataclass
from typing import Annotated

import mujoco
import numpy as np
from annotated_types import Interval

from ident.support.arrays import Array
from sim.drives import DriveTruth
from sim.effects.effect import Build, Effect, Values, tendons_ending
from sim.errors import EffectError
from sim.robot import Robot

COUPLING = "_coupling"
"""Ending of the name of the tendon of a motor that turns with the sum of two joints."""


@dataclass(frozen=True, kw_only=True)
class WristCoupling(Values):
    """The couplings that the robot file defines.

    Attributes:
        wrist_coupling: Share, 0 to 1, of every coupled motor that turns with the sum of two joints instead of its own
            joint.
    """

    wrist_coupling: Annotated[float, Interval(ge=0.0, le=1.0)] = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class OwnParts:
    """The part of every drive that turns with its own joint; arrays have shape (n,).

    Attributes:
        rotor_inertia: [kg m^2].
        viscous_friction: [N m s/rad].
        coulomb_friction: [N m].
    """

    rotor_inertia: Array
    viscous_friction: Array
    coulomb_friction: Array


def own_parts(share: float, robot: Robot, drives: DriveTruth) -> OwnParts:
    """Return the parts of the drives that do not turn with a sum of joints."""
    inertia, viscous, coulomb = (
        np.array(x, dtype=np.float64) for x in (drives.rotor_inertia, drives.viscous_friction, drives.coulomb_friction)
    )
    for coupling in robot.couplings:
        pair = [coupling.turns_with, coupling.motor]
        inertia[pair] -= share * float(drives.rotor_inertia[coupling.motor])
        viscous[pair] -= share * coupling.viscous_friction
        coulomb[coupling.motor] -= share * coupling.coulomb_friction
    return OwnParts(inertia, viscous, coulomb)


def coupling_tendons(model: mujoco.MjModel) -> slice:
    """Return the slice of the tendons of coupled motors in a compiled model; empty without any."""
    return tendons_ending(model, COUPLING)


def coupled_motors(robot: Robot) -> tuple[int, ...]:
    """Return the joint whose drive each of those tendons belongs to, in order."""
    return tuple(coupling.motor for coupling in robot.couplings)


def _fits(values: WristCoupling, robot: Robot, drives: DriveTruth) -> None:
    share = values.wrist_coupling
    if not share:
        return
    if not robot.couplings:
        raise EffectError(f"errors: wrist_coupling = {share:g}: {robot.name} has no coupling; leave it at 0")
    own = own_parts(share, robot, drives)
    for name, left, unit in (
        ("rotor_inertia", own.rotor_inertia, "kg m^2"),
        ("viscous_friction", own.viscous_friction, "N m s/rad"),
        ("coulomb_friction", own.coulomb_friction, "N m"),
    ):
        if (left < 0.0).any():
            j = int(np.argmin(left))
            raise EffectError(
                f"errors: wrist_coupling = {share:g} leaves joint {j + 1} a {name} of {left[j]:.3g} {unit}, below 0; "
                "use a smaller share"
            )


def _add_tendons(values: WristCoupling, spec: mujoco.MjSpec, build: Build) -> None:
    share = values.wrist_coupling
    for coupling in build.robot.couplings if share else ():
        tendon = spec.add_tendon(name=f"{spec.joints[coupling.motor].name}{COUPLING}")
        tendon.armature = share * build.drives.rotor_inertia[coupling.motor]
        tendon.damping[0] = share * coupling.viscous_friction
        tendon.frictionloss = share * coupling.coulomb_friction
        for joint in sorted((coupling.motor, coupling.turns_with)):
            tendon.wrap_joint(spec.actuators[joint].target, 1.0)


def _leave_own_parts(values: WristCoupling, model: mujoco.MjModel, build: Build) -> None:
    if values.wrist_coupling:
        own, driven = own_parts(values.wrist_coupling, build.robot, build.drives), slice(model.nv - model.nu, None)
        model.dof_armature[driven] = own.rotor_inertia
        model.dof_damping[driven] = own.viscous_friction
        model.dof_frictionloss[driven] = own.coulomb_friction


EFFECT = Effect[WristCoupling](
    fits=_fits,
    resizes=lambda values: values.wrist_coupling > 0.0,
    before_compile=_add_tendons,
    after_compile=_leave_own_parts,
)
