"""Model errors as parts of a MuJoCo model: moved frames, a tilted base, tendons and motors of their own.

    tilted base         option.gravity, turned the other way
    moved frames        body_pos, stretched
    gravity spring      spatial tendon between a site on the link before the joint and one on the link that it moves
    wrist coupling      fixed tendon, sum of two joints, with the armature and friction of the motor that turns with it
    joint elasticity    a hinge of its own for every motor, fixed tendon q_motor - q_link with stiffness and damping

Everything here changes a model before it is compiled; what is zero leaves no trace.
"""

from pathlib import Path

import mujoco
import numpy as np

from ident.arrays import Array
from sim.errors import EffectError
from sim.plant import Plant
from sim.robot import Robot

COUPLING = "_coupling"
"""Ending of the name of the tendon that a motor pulls when it turns with the sum of two joints."""
TRANSMISSION = "_transmission"
"""Ending of the name of an elastic joint's tendon."""
TRANSMISSION_DAMPING = 0.05
"""Damping ratio of an elastic transmission on its rotor; assumed."""
FASTEST_MODE = 4.0 * TRANSMISSION_DAMPING
"""Largest natural frequency of rotor on transmission, times the physics step [rad].

Stiffness Ke acts explicitly, damping De implicitly, so a link of any inertia is stable if Ke step^2 <= 2 De step. With
`De = 2 zeta sqrt(Ke Ia)` this is `sqrt(Ke / Ia) step <= 4 zeta`.
"""
MASSLESS = 1e-12
"""Mass [kg] and inertia [kg m^2] of a motor's body, which MuJoCo wants above zero; its inertia is its armature."""

Layout = tuple[Path, bool, bool, bool]


def layout(plant: Plant) -> Layout:
    """Plants of equal layout have compiled models of equal sizes, and may run in one batch."""
    errors = plant.errors
    return (
        plant.robot.model,
        errors.joint_compliance is not None,
        errors.wrist_coupling > 0.0,
        errors.gravity_spring > 0.0,
    )


def add_model_errors(spec: mujoco.MjSpec, plant: Plant, step: float) -> None:
    """Put the model errors of a plant into the model of its arm.

    Args:
        spec: The arm as drawn; changed in place.
        plant: The truth.
        step: Physics step, for the refusal of stiff transmissions [s].

    Raises:
        EffectError: If the arm has no such joint or frame, or a transmission is too stiff for the step.
    """
    errors = plant.errors
    if errors.base_tilt_x or errors.base_tilt_y:
        spec.option.gravity = _tilt(errors.base_tilt_x, errors.base_tilt_y).T @ spec.option.gravity
    if errors.gravity_spring:
        _add_gravity_spring(spec, plant.robot, errors.gravity_spring)
    for frame, name in (("d3", "d3_error"), ("r4", "r4_error")):
        if getattr(errors, name):
            _stretch(spec, plant.robot, frame, name, getattr(errors, name))
    if errors.joint_compliance is not None:
        _add_motors(spec, plant, np.array(errors.joint_compliance), step)
    if errors.wrist_coupling:
        _couple_motors(spec, plant, errors.wrist_coupling)


def own_parts(plant: Plant) -> tuple[Array, Array, Array]:
    """What every drive has on its own, without the part of coupled motors that turns with two joints.

    Returns:
        Rotor inertia [kg m^2], viscous friction [N m s/rad], Coulomb friction [N m], each (n,).

    Raises:
        EffectError: If the coupled part is more than a drive has.
    """
    drives, share = plant.drives, plant.errors.wrist_coupling
    inertia, viscous, coulomb = (
        np.array(x, dtype=np.float64) for x in (drives.rotor_inertia, drives.viscous_friction, drives.coulomb_friction)
    )
    if share:
        for coupling in plant.robot.couplings:
            pair = [coupling.turns_with, coupling.motor]
            inertia[pair] -= share * float(drives.rotor_inertia[coupling.motor])
            viscous[pair] -= share * coupling.viscous_friction
            coulomb[coupling.motor] -= share * coupling.coulomb_friction
        for name, values, unit in (
            ("rotor_inertia", inertia, "kg m^2"),
            ("viscous_friction", viscous, "N m s/rad"),
            ("coulomb_friction", coulomb, "N m"),
        ):
            if (values < 0.0).any():
                j = int(np.argmin(values))
                raise EffectError(
                    f"errors: wrist_coupling = {share:g} leaves joint {j + 1} a {name} of {values[j]:.3g} {unit}; "
                    "use a smaller share or drives with more"
                )
    return inertia, viscous, coulomb


def coupling_tendons(model: mujoco.MjModel) -> slice:
    """Where the tendons of coupled motors stand among those of a compiled model; empty without one."""
    return _tendons(model, COUPLING)


def transmission_tendons(model: mujoco.MjModel) -> slice:
    """Where the elastic transmissions stand, joint by joint; empty on a rigid arm."""
    return _tendons(model, TRANSMISSION)


def _tendons(model: mujoco.MjModel, ending: str) -> slice:
    """Where tendons that were added one after another stand."""
    found = [k for k in range(model.ntendon) if model.tendon(k).name.endswith(ending)]
    return slice(found[0], found[-1] + 1) if found else slice(0)


def _tilt(x: float, y: float) -> Array:
    """Rotation of a base that is turned about its x axis and then about its own y axis, shape (3, 3)."""
    cx, sx, cy, sy = np.cos(x), np.sin(x), np.cos(y), np.sin(y)
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    return about_x @ np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])


def _stretch(spec: mujoco.MjSpec, robot: Robot, frame: str, name: str, error: float) -> None:
    if frame not in robot.frames:
        raise EffectError(f"errors: {name} = {error:g} m: {robot.name} has no frame {frame}; leave it at 0")
    body = spec.body(robot.frames[frame])
    if body is None:
        raise EffectError(f"errors: {name}: {robot.model} has no body {robot.frames[frame]!r}, which {frame} leads to")
    drawn = float(np.linalg.norm(body.pos))
    if not drawn or drawn + error <= 0.0:
        raise EffectError(
            f"errors: {name} = {error:g} m: {body.name} is drawn {drawn:g} m from its parent; leave it at 0"
        )
    body.pos = (1.0 + error / drawn) * body.pos


def _add_gravity_spring(spec: mujoco.MjSpec, robot: Robot, stiffness: float) -> None:
    """A spring between the link before a joint, above its axis, and the far end of the link that the joint moves.

    Its torque depends on the angle between both ends alone, so it does not matter which of them is the near one.
    """
    spring = robot.gravity_spring
    if spring is None:
        raise EffectError(f"errors: gravity_spring = {stiffness:g} N/m: {robot.name} has none; leave it at 0")
    link, beyond = spec.joints[spring.joint].parent, spec.joints[spring.joint + 1].parent
    if not (length := float(np.linalg.norm(beyond.pos))):
        raise EffectError(f"errors: gravity_spring = {stiffness:g} N/m: {link.name} has no length to hook it to")
    along = beyond.pos / length  # of the link, in its own frame
    upright = np.empty(3)
    mujoco.mju_rotVecQuat(upright, along, link.quat / np.linalg.norm(link.quat))
    link.parent.add_site(name="spring_near", pos=link.pos + spring.radius * upright)
    link.add_site(name="spring_far", pos=spring.distance * along)
    tendon = spec.add_tendon(name="gravity_spring", springlength=[spring.free_length] * 2)
    tendon.stiffness[0] = stiffness
    tendon.wrap_site("spring_near")
    tendon.wrap_site("spring_far")


def _couple_motors(spec: mujoco.MjSpec, plant: Plant, share: float) -> None:
    if not plant.robot.couplings:
        raise EffectError(f"errors: wrist_coupling = {share:g}: {plant.robot.name} has no coupling; leave it at 0")
    for coupling in plant.robot.couplings:
        tendon = spec.add_tendon(name=f"{spec.joints[coupling.motor].name}{COUPLING}")
        tendon.armature = share * plant.drives.rotor_inertia[coupling.motor]
        tendon.damping[0] = share * coupling.viscous_friction
        tendon.frictionloss = share * coupling.coulomb_friction
        for joint in sorted((coupling.motor, coupling.turns_with)):
            tendon.wrap_joint(spec.actuators[joint].target, 1.0)


def _add_motors(spec: mujoco.MjSpec, plant: Plant, compliance: Array, step: float) -> None:
    """Hang every drive on a motor of its own, behind the arm in the state, and a transmission between both."""
    stiffness, inertia = 1.0 / compliance, np.asarray(plant.drives.rotor_inertia)
    _refuse_stiff(stiffness, inertia, step)
    damping = 2.0 * TRANSMISSION_DAMPING * np.sqrt(stiffness * inertia)
    links = [joint.name for joint in spec.joints]
    pairs = [(coupling.motor, coupling.turns_with) for coupling in plant.robot.couplings]
    motors: list[mujoco.MjsBody] = []
    for j, link in enumerate(links):
        # MuJoCo's inertia matrix holds entries within one branch alone, and a coupling has one between its two motors.
        parent = motors[-1] if any(min(pair) < j <= max(pair) for pair in pairs) else spec.worldbody
        motor = parent.add_body(name=f"{link}_motor", explicitinertial=True, mass=MASSLESS, inertia=[MASSLESS] * 3)
        motor.add_joint(name=motor.name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
        motors.append(motor)
        tendon = spec.add_tendon(name=f"{link}{TRANSMISSION}", springlength=[0.0, 0.0])
        tendon.stiffness[0], tendon.damping[0] = stiffness[j], damping[j]
        tendon.wrap_joint(motor.name, 1.0)
        tendon.wrap_joint(link, -1.0)
        spec.actuators[j].target = motor.name


def _refuse_stiff(stiffness: Array, inertia: Array, step: float) -> None:
    if not inertia.all():
        raise EffectError("errors: joint_compliance needs a rotor_inertia above 0 kg m^2 at every joint")
    mode = np.sqrt(stiffness / inertia)  # (n,) rad/s
    j = int(np.argmax(mode))
    if mode[j] * step > FASTEST_MODE:
        softest, longest = (
            1.01 * step**2 / (FASTEST_MODE**2 * inertia[j]),
            0.99 * FASTEST_MODE / mode[j],
        )  # to be rounded
        raise EffectError(
            f"errors: joint_compliance of joint {j + 1} = {1.0 / stiffness[j]:.3g} rad/(N m) is too stiff for a step "
            f"of {step:g} s; use a step of {longest:.3g} s at most, or {softest:.3g} rad/(N m) at least"
        )
