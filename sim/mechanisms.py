"""Model errors as parts of a MuJoCo model: moved frames, a tilted base, tendons and motors of their own.

    tilted base         option.gravity, turned the other way
    frames 3 and 4      body_pos, stretched
    gravity spring      spatial tendon between a site on link 1 and one on link 2
    wrist coupling      fixed tendon q5 + q6 with the armature and friction of motor 6
    joint elasticity    a hinge of its own for every motor, fixed tendon q_motor - q_link with stiffness and damping

Everything here changes a model before it is compiled; what is zero leaves no trace.
"""

from pathlib import Path

import mujoco
import numpy as np

from ident.arrays import Array
from sim.errors import PlantError
from sim.plant import Plant

WRIST = (4, 5)
"""The joints, counted from zero, whose sum motor 6 turns with: RX family, axes 5 and 6."""
COUPLING = "wrist_coupling"
"""Name of the tendon that motor 6 pulls when it turns with q5 + q6."""
TRANSMISSION = "_transmission"
"""Ending of the name of an elastic joint's tendon."""
COUPLED_VISCOUS = 2.4
"""Viscous friction of motor 6 that turns with q5 + q6 [N m s/rad]; assumed, as every value of the coupling."""
COUPLED_COULOMB = 2.5
"""Coulomb friction of motor 6 that turns with q5 + q6 [N m]; assumed."""
SPRING_PUBLISHED = 20295.0
"""Stiffness of the RX-90's spring [N/m]; published (INRIA HuMAnS, SpringForce.c)."""
SPRING_FREE_LENGTH = 6257.75 / SPRING_PUBLISHED
"""Length without force [m]; published as the prestress force 6257.75 N over the stiffness."""
SPRING_RADIUS, SPRING_DISTANCE = 0.06, 0.45
"""Distances of the ends of the spring from axis 2 [m]; published (the same)."""
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
    return plant.mjcf, errors.joint_compliance is not None, errors.wrist_coupling > 0.0, errors.gravity_spring > 0.0


def add_model_errors(spec: mujoco.MjSpec, plant: Plant, step: float) -> None:
    """Put the model errors of a plant into the model of its arm.

    Args:
        spec: The arm as drawn; changed in place.
        plant: The truth.
        step: Physics step, for the refusal of stiff transmissions [s].

    Raises:
        PlantError: If the arm has no such joint or frame, or a transmission is too stiff for the step.
    """
    errors = plant.errors
    if errors.base_tilt_x or errors.base_tilt_y:
        spec.option.gravity = _tilt(errors.base_tilt_x, errors.base_tilt_y).T @ spec.option.gravity
    if errors.gravity_spring:
        _add_gravity_spring(spec, errors.gravity_spring)
    for joint, name in ((2, "d3_error"), (3, "r4_error")):
        if getattr(errors, name):
            _stretch(spec, joint, name, getattr(errors, name))
    if errors.joint_compliance is not None:
        _add_motors(spec, plant, np.array(errors.joint_compliance), step)
    if errors.wrist_coupling:
        _couple_wrist(spec, plant.drives.rotor_inertia, errors.wrist_coupling)


def own_parts(plant: Plant) -> tuple[Array, Array, Array]:
    """What every drive has on its own, without the part of motor 6 that turns with q5 + q6.

    Returns:
        Rotor inertia [kg m^2], viscous friction [N m s/rad], Coulomb friction [N m], each (n,).

    Raises:
        PlantError: If the coupled part is more than a drive has.
    """
    drives, share = plant.drives, plant.errors.wrist_coupling
    inertia, viscous, coulomb = (
        np.array(x, dtype=np.float64) for x in (drives.rotor_inertia, drives.viscous_friction, drives.coulomb_friction)
    )
    if share:
        first, second = WRIST
        inertia[[first, second]] -= share * inertia[second]
        viscous[[first, second]] -= share * COUPLED_VISCOUS
        coulomb[second] -= share * COUPLED_COULOMB
        for name, values, unit in (
            ("rotor_inertia", inertia, "kg m^2"),
            ("viscous_friction", viscous, "N m s/rad"),
            ("coulomb_friction", coulomb, "N m"),
        ):
            if (values < 0.0).any():
                j = int(np.argmin(values))
                raise PlantError(
                    f"errors: wrist_coupling = {share:g} leaves joint {j + 1} a {name} of {values[j]:.3g} {unit}; "
                    "use a smaller share or drives with more"
                )
    return inertia, viscous, coulomb


def coupling_tendon(model: mujoco.MjModel) -> slice:
    """Where the tendon of the wrist coupling stands among those of a compiled model; empty without one."""
    found = [k for k in range(model.ntendon) if model.tendon(k).name == COUPLING]
    return slice(found[0], found[0] + 1) if found else slice(0)


def transmission_tendons(model: mujoco.MjModel) -> slice:
    """Where the elastic transmissions stand, joint by joint; empty on a rigid arm."""
    found = [k for k in range(model.ntendon) if model.tendon(k).name.endswith(TRANSMISSION)]
    return slice(found[0], found[-1] + 1) if found else slice(0)


def _tilt(x: float, y: float) -> Array:
    """Rotation of a base that is turned about its x axis and then about its own y axis, shape (3, 3)."""
    cx, sx, cy, sy = np.cos(x), np.sin(x), np.cos(y), np.sin(y)
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    return about_x @ np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])


def _link(spec: mujoco.MjSpec, joint: int, name: str) -> mujoco.MjsBody:
    if len(spec.joints) <= joint:
        raise PlantError(f"errors: {name} needs joint {joint + 1}, but the arm has {len(spec.joints)}; leave it at 0")
    return spec.joints[joint].parent


def _stretch(spec: mujoco.MjSpec, joint: int, name: str, error: float) -> None:
    body = _link(spec, joint, name)
    drawn = float(np.linalg.norm(body.pos))
    if not drawn or drawn + error <= 0.0:
        raise PlantError(
            f"errors: {name} = {error:g} m: {body.name} is drawn {drawn:g} m from its parent; leave it at 0"
        )
    body.pos = (1.0 + error / drawn) * body.pos


def _add_gravity_spring(spec: mujoco.MjSpec, stiffness: float) -> None:
    """A spring between link 1, above axis 2, and the far end of link 2.

    Its torque depends on the angle between both ends alone, so it does not matter which of them is the near one.
    """
    second, elbow = _link(spec, 1, "gravity_spring"), _link(spec, 2, "gravity_spring")
    along = elbow.pos / np.linalg.norm(elbow.pos)  # of link 2, in its own frame
    upright = np.empty(3)
    mujoco.mju_rotVecQuat(upright, along, second.quat / np.linalg.norm(second.quat))
    second.parent.add_site(name="spring_near", pos=second.pos + SPRING_RADIUS * upright)
    second.add_site(name="spring_far", pos=SPRING_DISTANCE * along)
    tendon = spec.add_tendon(name="gravity_spring", springlength=[SPRING_FREE_LENGTH] * 2)
    tendon.stiffness[0] = stiffness
    tendon.wrap_site("spring_near")
    tendon.wrap_site("spring_far")


def _couple_wrist(spec: mujoco.MjSpec, rotor_inertia: Array, share: float) -> None:
    if len(rotor_inertia) <= WRIST[1]:
        raise PlantError(f"errors: wrist_coupling = {share:g} couples joints 5 and 6; leave it at 0")
    tendon = spec.add_tendon(name=COUPLING)
    tendon.armature = share * rotor_inertia[WRIST[1]]
    tendon.damping[0] = share * COUPLED_VISCOUS
    tendon.frictionloss = share * COUPLED_COULOMB
    for joint in WRIST:
        tendon.wrap_joint(spec.actuators[joint].target, 1.0)


def _add_motors(spec: mujoco.MjSpec, plant: Plant, compliance: Array, step: float) -> None:
    """Hang every drive on a motor of its own, behind the arm in the state, and a transmission between both."""
    stiffness, inertia = 1.0 / compliance, np.asarray(plant.drives.rotor_inertia)
    _refuse_stiff(stiffness, inertia, step)
    damping = 2.0 * TRANSMISSION_DAMPING * np.sqrt(stiffness * inertia)
    links = [joint.name for joint in spec.joints]
    motors: list[mujoco.MjsBody] = []
    for j, link in enumerate(links):
        # MuJoCo's inertia matrix holds entries within one branch alone, and the wrist coupling has one.
        parent = motors[WRIST[0]] if j == WRIST[1] else spec.worldbody
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
        raise PlantError("errors: joint_compliance needs a rotor_inertia above 0 kg m^2 at every joint")
    mode = np.sqrt(stiffness / inertia)  # (n,) rad/s
    j = int(np.argmax(mode))
    if mode[j] * step > FASTEST_MODE:
        softest, longest = (
            1.01 * step**2 / (FASTEST_MODE**2 * inertia[j]),
            0.99 * FASTEST_MODE / mode[j],
        )  # to be rounded
        raise PlantError(
            f"errors: joint_compliance of joint {j + 1} = {1.0 / stiffness[j]:.3g} rad/(N m) is too stiff for a step "
            f"of {step:g} s; use a step of {longest:.3g} s at most, or {softest:.3g} rad/(N m) at least"
        )
