"""Transmissions: motors that turn with the sum of two joints, elastic joints, and their backlash.

A coupled motor is a fixed tendon over both joints with armature and friction of the motor. Drives of elastic joints act
on motor joints; a fixed tendon q_motor - q_link with stiffness and damping connects each with its joint of the arm.
With d = q_motor - q_link and b = backlash the spring gives Ke (|d| - b / 2) sign(d) if |d| exceeds b / 2, otherwise 0:
within the gap only damping acts. At the start of a motion every link is on the side to which gravity pulls it.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import mujoco
import numpy as np
from annotated_types import Interval, Unit

from ident.support.arrays import Array
from sim.effects.effect import Build, Effect, Share
from sim.errors import PlantError
from sim.model_spec import arm_joints, driven_joints
from sim.robot import DriveTruth, Robot

COUPLING, TRANSMISSION, MOTOR = "_coupling", "_transmission", "_motor"
"""Endings of the names of tendons: of a coupled motor, of an elastic joint, and of a motor that several joints turn."""
TRANSMISSION_DAMPING = 0.05
"""Damping ratio of an elastic transmission on its rotor; assumed."""
FASTEST_MODE = 4.0 * TRANSMISSION_DAMPING
"""Largest natural frequency of rotor on transmission, times the physics step [rad].

Stiffness Ke acts explicitly, damping De implicitly, so a link of any inertia is stable if Ke step^2 <= 2 De step. With
`De = 2 zeta sqrt(Ke Ia)` this is `sqrt(Ke / Ia) step <= 4 zeta`.
"""
SOFTEST = 0.1
"""Largest compliance [rad/(N m)]: one radian under 10 N m."""
MASSLESS = 1e-12
"""Mass [kg] and inertia [kg m^2] of a motor's body, positive as MuJoCo requires; the armature is the rotor."""
NOTHING = 1e-9
"""Torque [N m] below which rounding errors dominate: it moves no link to either side."""


@dataclass(frozen=True, kw_only=True)
class WristCoupling(Effect):
    """The couplings that the robot file defines."""

    adds: ClassVar[bool] = True
    wrist_coupling: Share = 0.0  # share of every coupled motor that turns with two joints instead of its own

    def fits(self, robot: Robot, drives: DriveTruth) -> None:
        share = self.wrist_coupling
        if not share:
            return
        if not robot.coupling:
            raise PlantError(f"errors: wrist_coupling = {share:g}: {robot.name} has no coupling; leave it at 0")
        for (name, left), unit in zip(
            own_parts(share, robot, drives).items(), ("kg m^2", "N m s/rad", "N m"), strict=True
        ):
            if (left < 0.0).any():
                j = int(np.argmin(left))
                raise PlantError(
                    f"errors: wrist_coupling = {share:g} leaves joint {j + 1} a {name} of {left[j]:.3g} {unit}, below "
                    "0; use a smaller share"
                )

    def before_compile(self, spec: mujoco.MjSpec, build: Build) -> None:
        share = self.wrist_coupling
        for coupling in build.robot.coupling if share else ():
            tendon = spec.add_tendon(name=f"{spec.joints[coupling.motor].name}{COUPLING}")
            tendon.armature = share * build.drives.rotor_inertia[coupling.motor]
            tendon.damping[0] = share * coupling.viscous_friction
            tendon.frictionloss = share * coupling.coulomb_friction
            for joint in sorted((coupling.motor, coupling.turns_with)):
                tendon.wrap_joint(spec.actuators[joint].target, 1.0)

    def after_compile(self, model: mujoco.MjModel, build: Build) -> None:
        if self.wrist_coupling:
            own, driven = own_parts(self.wrist_coupling, build.robot, build.drives), driven_joints(model)
            model.dof_armature[driven] = own["rotor_inertia"]
            model.dof_damping[driven] = own["viscous_friction"]
            model.dof_frictionloss[driven] = own["coulomb_friction"]


def own_parts(share: float, robot: Robot, drives: DriveTruth) -> dict[str, Array]:
    """Return the parts of the drives that turn with their own joints alone, by name, each of shape (n,)."""
    own = {
        name: np.array(getattr(drives, name), dtype=np.float64)
        for name in ("rotor_inertia", "viscous_friction", "coulomb_friction")
    }
    for coupling in robot.coupling:
        pair = [coupling.turns_with, coupling.motor]
        own["rotor_inertia"][pair] -= share * float(drives.rotor_inertia[coupling.motor])
        own["viscous_friction"][pair] -= share * coupling.viscous_friction
        own["coulomb_friction"][coupling.motor] -= share * coupling.coulomb_friction
    return own


def places_of_motors(model: mujoco.MjModel) -> list[tuple[str, slice]]:
    """Return where a compiled model has inertia and friction of the n motors, then of the c coupled ones."""
    if (motors := _tendons(model, MOTOR)).stop:
        return [("tendon", motors)]
    return [("dof", driven_joints(model)), ("tendon", _tendons(model, COUPLING))]


def _tendons(model: mujoco.MjModel, ending: str) -> slice:
    found = [k for k in range(model.ntendon) if model.tendon(k).name.endswith(ending)]
    return slice(found[0], found[-1] + 1) if found else slice(0)


@dataclass(frozen=True, kw_only=True)
class JointElasticity(Effect):
    """Elastic transmissions.

    Attributes:
        joint_compliance: Compliance of each joint's transmission [rad/(N m)]; None or all zero for rigid joints.
    """

    adds: ClassVar[bool] = True
    joint_compliance: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        """Check the compliances; replace all zero by None."""
        super().__post_init__()
        if self.joint_compliance is None:
            return
        if not any(self.joint_compliance):
            object.__setattr__(self, "joint_compliance", None)
        elif not all(0.0 < c <= SOFTEST for c in self.joint_compliance):
            raise PlantError(
                f"errors: joint_compliance = {list(self.joint_compliance)} rad/(N m): expected positive numbers up to "
                f"{SOFTEST:g}, one per joint; all zero for rigid joints"
            )

    def fits(self, robot: Robot, drives: DriveTruth) -> None:
        if self.joint_compliance is None:
            return
        if robot.transmission is not None:
            raise PlantError(
                f"errors: joint_compliance: elastic joints of {robot.name}, whose motors turn with several joints, are "
                "not simulated; leave it out of errors and sources"
            )
        if len(self.joint_compliance) != robot.n:
            raise PlantError(
                f"errors: joint_compliance: {len(self.joint_compliance)} values [rad/(N m)], expected {robot.n}, one "
                "per joint"
            )
        if not drives.rotor_inertia.all():
            raise PlantError("errors: joint_compliance needs a rotor_inertia above 0 kg m^2 at every joint")

    def before_compile(self, spec: mujoco.MjSpec, build: Build) -> None:
        if self.joint_compliance is None:
            return
        stiffness, inertia = 1.0 / np.array(self.joint_compliance), np.asarray(build.drives.rotor_inertia)
        mode, step = np.sqrt(stiffness / inertia), build.step  # (n,) rad/s
        j = int(np.argmax(mode))
        if mode[j] * step > FASTEST_MODE:
            softest, longest = 1.01 * step**2 / (FASTEST_MODE**2 * inertia[j]), 0.99 * FASTEST_MODE / mode[j]  # rounded
            raise PlantError(
                f"errors: joint_compliance of joint {j + 1} = {1.0 / stiffness[j]:.3g} rad/(N m) is too stiff for a "
                f"step of {step:g} s; use a step of {longest:.3g} s at most, or {softest:.3g} rad/(N m) at least"
            )
        damping = 2.0 * TRANSMISSION_DAMPING * np.sqrt(stiffness * inertia)
        # Motors beside the arm are separate islands; solving them together with the arm changes the last digits.
        spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_ISLAND)
        links = [joint.name for joint in spec.joints]
        pairs = [(coupling.motor, coupling.turns_with) for coupling in build.robot.coupling]
        motors: list[mujoco.MjsBody] = []
        for j, link in enumerate(links):
            # MuJoCo's inertia matrix has entries only within one branch, but a coupling needs one between its motors.
            parent = motors[-1] if any(min(pair) < j <= max(pair) for pair in pairs) else spec.worldbody
            motor = parent.add_body(name=f"{link}_motor", explicitinertial=True, mass=MASSLESS, inertia=[MASSLESS] * 3)
            motor.add_joint(name=motor.name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
            motors.append(motor)
            tendon = spec.add_tendon(name=f"{link}{TRANSMISSION}", springlength=[0.0, 0.0])
            tendon.stiffness[0], tendon.damping[0] = stiffness[j], damping[j]
            tendon.wrap_joint(motor.name, 1.0)
            tendon.wrap_joint(link, -1.0)
            spec.actuators[j].target = motor.name

    def settle(self, model: mujoco.MjModel, state: Array) -> None:
        if self.joint_compliance is not None:
            state[arm_joints(model)] = state[driven_joints(model)]


def own_stiffness(model: mujoco.MjModel) -> Array:
    """Return the stiffness of each joint's spring, which is an elastic link's transmission [N m/rad], (nv,)."""
    stiffness: Array = model.jnt_stiffness.copy()
    if (found := _tendons(model, TRANSMISSION)).stop:
        stiffness[arm_joints(model)] = model.tendon_stiffness[found]
    return stiffness


def sag(model: mujoco.MjModel, state: Array) -> None:
    """Move the joints without a drive to the equilibrium of their springs and gravity."""
    data, free = mujoco.MjData(model), np.delete(np.arange(model.nv), driven_joints(model))
    compliance = 1.0 / own_stiffness(model)[free]
    for _ in range(20):  # the error falls by gravity's over the transmission's stiffness each time, about 0.03
        data.qpos[:] = state
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        state[free] += compliance * (data.qfrc_passive - data.qfrc_bias)[free]


@dataclass(frozen=True, kw_only=True)
class Backlash(JointElasticity):
    """Backlash of the transmissions.

    Attributes:
        backlash: Angle by which every link can turn relative to its motor without torque [rad].
    """

    adds: ClassVar[bool] = False
    backlash: Annotated[float, Interval(ge=0.0, le=0.1), Unit("rad")] = 0.0

    def fits(self, robot: Robot, drives: DriveTruth) -> None:
        if self.backlash and self.joint_compliance is None:
            raise PlantError(
                f"errors: backlash = {self.backlash:g} rad needs elastic transmissions; state joint_compliance"
            )

    def before_compile(self, spec: mujoco.MjSpec, build: Build) -> None:
        """Leave the motors to the effect of elasticity."""

    def after_compile(self, model: mujoco.MjModel, build: Build) -> None:
        if self.backlash:
            gap = (-0.5 * self.backlash, 0.5 * self.backlash)
            model.tendon_lengthspring[_tendons(model, TRANSMISSION)] = gap

    def settle(self, model: mujoco.MjModel, state: Array) -> None:
        if not self.backlash:
            return
        links, data = arm_joints(model), mujoco.MjData(model)
        data.qpos[:] = state
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        gravity = np.where(np.abs(data.qfrc_bias[links]) > NOTHING, data.qfrc_bias[links], 0.0)
        state[links] -= 0.5 * self.backlash * np.sign(gravity)
