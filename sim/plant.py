"""The plant: all true parameters of the simulated robot, which identification must not use, and its MuJoCo model.

All true parameters are in fields of the compiled model:

    drive      tau = g (v - v0) - Fcoff     actuator_gainprm = g, actuator_biasprm = -g v0 - Fcoff, ctrlrange = v_max
    rotor      Ia ddq                       dof_armature
    friction   -Fv dq - Fc sign(dq)         dof_damping, dof_frictionloss
    payload    a body welded to link n      body `payload`
    errors     `sim.effects`                before and after the model is compiled

so the model can be saved and opened in any MuJoCo viewer. MuJoCo models dry friction as a soft constraint;
`FRICTION_SOLREF` and `FRICTION_SOLIMP` make it as stiff as the step allows.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np

from ident.support.arrays import Array
from sim.effects import EFFECTS, ModelErrors
from sim.effects.effect import Build
from sim.effects.transmissions import MOTOR, places_of_motors, sag
from sim.errors import PlantError
from sim.model_spec import compiled, driven_joints, lean_spec, silenced
from sim.robot import DriveTruth, Robot

HEAVIEST, FARTHEST, BULKIEST = 1e5, 1e2, 1e6
"""Largest mass [kg], distance of its centre [m] and moment of inertia [kg m^2] of a payload."""
FRICTION_SOLREF = (2.0, 1.0)
"""Time constant in steps, the smallest that MuJoCo accepts, and damping ratio."""
FRICTION_SOLIMP = (0.99, 0.999, 0.001, 0.5, 2.0)
"""Impedance near 1: friction cancels 99 % of the acceleration of a joint at rest; MuJoCo's default is 90 %."""

Layout = tuple[Path, str | None, tuple[bool, ...]]


@dataclass(frozen=True, slots=True, kw_only=True)
class PayloadBody:
    """A rigid body on the flange, in the frame of the last link; raises `PlantError` for a number out of range."""

    mass: float  # [kg]
    com: tuple[float, float, float]  # centre of mass [m]
    inertia: tuple[float, float, float, float, float, float]  # ixx, iyy, izz, ixy, ixz, iyz about it [kg m^2]

    def __post_init__(self) -> None:
        """Check the numbers; MuJoCo's compiler checks whether they are physically possible."""
        if not 0.0 < self.mass <= HEAVIEST:
            raise PlantError(f"payload: mass = {self.mass:g} kg: expected more than 0 to {HEAVIEST:g}")
        for name, unit, most in (("com", "m", FARTHEST), ("inertia", "kg m^2", BULKIEST)):
            for value in getattr(self, name):
                if not abs(value) <= most:  # NaN is not
                    raise PlantError(f"payload: {name} {value:g} {unit}: expected {most:g} at most")


@dataclass(frozen=True, slots=True, kw_only=True)
class Plant:
    """All true parameters of one robot; raises `PlantError` if drives or model errors do not apply to it."""

    robot: Robot
    drives: DriveTruth  # its true drives; those of `robot` are nominal
    payload: PayloadBody  # payload of the loaded motions
    errors: ModelErrors = field(default_factory=ModelErrors)

    def __post_init__(self) -> None:
        """Check that drives and errors fit the robot."""
        if len(self.drives.gain) != self.robot.n:
            raise PlantError(
                f"drives: {len(self.drives.gain)} gains for {self.robot.name}, which has {self.robot.n} joints"
            )
        for effect in EFFECTS.values():
            effect.fits(self.errors, self.robot, self.drives)


def layout(plant: Plant) -> Layout:
    """Layout of the compiled model; plants of equal layout have models of equal sizes and may run in one batch."""
    robot = plant.robot
    own = (effect.adds and effect.acts(plant.errors) for effect in EFFECTS.values())
    return robot.model, robot.flange, (robot.transmission is not None, *own)


@silenced()
def plant_model(
    plant: Plant,
    *,
    loaded: bool,
    step: float,
    earlier: int = 0,
    read: Callable[[Path, str | None], mujoco.MjSpec] = lean_spec,
) -> mujoco.MjModel:
    """Compile a plant with its payload or with a bare flange.

    Both have the same layout (the bare flange carries an empty body), so that they run in one batch. `step` is the
    physics step [s], `earlier` the number of motions before this one. With `full_spec` as `read`, the model has all its
    shapes; the motion is bitwise the same. Raises `PlantError` if the model is of another arm, or an error exceeds what
    it allows.
    """
    n, path = plant.robot.n, plant.robot.model
    build = Build(robot=plant.robot, drives=plant.drives, earlier=earlier, step=step)
    with compiled(f"{path} with a payload of {plant.payload.mass:g} kg" if loaded else path):
        spec = read(path, plant.robot.flange)
        if len(spec.joints) != n:
            raise PlantError(f"robot model {path}: {len(spec.joints)} joints, but {plant.robot.name} has {n}")
        mount_payload(spec, plant.payload if loaded else None)
        for actuator in spec.actuators:  # those of the model file are ignored
            spec.delete(actuator)
        for j, joint in enumerate(joints := list(spec.joints)):
            drive = spec.add_actuator(name=f"drive{j + 1}", target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
            if plant.robot.transmission is not None:
                motor = spec.add_tendon(name=f"{joint.name}{MOTOR}")
                for each, ratio in zip(joints, plant.robot.transmission[j], strict=True):
                    if ratio:
                        motor.wrap_joint(each.name, ratio)
                drive.target, drive.trntype = motor.name, mujoco.mjtTrn.mjTRN_TENDON
            drive.gaintype, drive.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
        for effect in EFFECTS.values():
            effect.before_compile(plant.errors, spec, build)
        spec.option.timestep = step
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        model = spec.compile()
    _inject(model, plant, build)
    return model


@silenced()
def bare_arm(
    mjcf: Path, rotor_inertia: Array, flange: str | None = None, payload: PayloadBody | None = None
) -> mujoco.MjModel:
    """Compile the arm of a model file with rotors Ia [kg m^2], shape (n,), without friction: the controller's model."""
    with compiled(mjcf):
        spec = lean_spec(mjcf, flange)
        mount_payload(spec, payload)
        model = spec.compile()
    if model.nv != len(rotor_inertia):
        believed = len(rotor_inertia)
        raise PlantError(f"robot model {mjcf}: {model.nv} joints, but the controller's model has {believed}")
    model.dof_armature[:] = rotor_inertia
    model.dof_damping[:] = model.dof_frictionloss[:] = 0.0
    model.jnt_limited[:] = 0
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def mount_payload(spec: mujoco.MjSpec, payload: PayloadBody | None) -> mujoco.MjsBody:
    """Weld the payload, or an empty body in its place, to the last link; its frame has its origin on the last joint."""
    joint = spec.joints[-1]
    body = joint.parent.add_body(name="payload", pos=joint.pos, explicitinertial=True)
    if payload is not None:
        body.mass, body.ipos, body.fullinertia = payload.mass, payload.com, payload.inertia
    return body


@silenced()
def resting(plant: Plant, model: mujoco.MjModel, q: Array) -> Array:
    """Return the equilibrium positions of all joints [rad], (nq,), with the driven ones at q (n,)."""
    state = np.zeros(model.nq)
    state[driven_joints(model)] = q
    for effect in EFFECTS.values():
        effect.settle(plant.errors, model, state)
    if model.nv > model.nu:
        sag(model, state)
    return state


def _inject(model: mujoco.MjModel, plant: Plant, build: Build) -> None:
    drives, (kind, motors) = plant.drives, places_of_motors(model)[0]
    model.actuator_gainprm[:, 0] = drives.gain
    model.actuator_biasprm[:, 0] = -drives.gain * drives.amplifier_offset - drives.coulomb_asymmetry
    model.actuator_ctrlrange[:] = np.outer(drives.current_limit, (-1.0, 1.0))
    model.actuator_ctrllimited[:] = 1
    for of_joints in (model.dof_armature, model.dof_damping, model.dof_frictionloss) if kind == "tendon" else ():
        of_joints[driven_joints(model)] = 0.0
    getattr(model, f"{kind}_armature")[motors] = drives.rotor_inertia
    getattr(model, f"{kind}_damping")[motors] = drives.viscous_friction
    getattr(model, f"{kind}_frictionloss")[motors] = drives.coulomb_friction
    for effect in EFFECTS.values():
        effect.after_compile(plant.errors, model, build)
    time_constant, damping_ratio = FRICTION_SOLREF
    model.dof_solref[:] = model.tendon_solref_fri[:] = (time_constant * build.step, damping_ratio)
    model.dof_solimp[:] = model.tendon_solimp_fri[:] = FRICTION_SOLIMP
    model.jnt_range[model.jnt_limited == 0] = 0.0
    model.jnt_limited[:] = 0  # reaching a limit is an error of the run, so the limit exerts no torque
    mujoco.mj_setConst(model, mujoco.MjData(model))
