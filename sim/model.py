"""The compiled MuJoCo model of a plant: the truth written into MuJoCo's own fields, and nowhere else.

    drive      tau = g (v - v0) - Fcoff     actuator_gainprm = g, actuator_biasprm = -g v0 - Fcoff, ctrlrange = v_max
    rotor      Ia ddq                       dof_armature
    friction   -Fv dq - Fc sign(dq)         dof_damping, dof_frictionloss
    payload    a body welded to link n      body `payload`

so the model can be saved and opened in any MuJoCo viewer. Dry friction is a constraint that MuJoCo softens:
`FRICTION_SOLREF` and `FRICTION_SOLIMP` make it as stiff as the step allows.
"""

from pathlib import Path

import mujoco
import numpy as np

from ident.arrays import Array
from sim.errors import ModelFileError
from sim.mechanisms import add_model_errors, coupling_tendons, own_parts, transmission_tendons
from sim.plant import PayloadBody, Plant

FRICTION_SOLREF = (2.0, 1.0)
"""Time constant in steps, the stiffest that MuJoCo takes, and damping ratio."""
FRICTION_SOLIMP = (0.99, 0.999, 0.001, 0.5, 2.0)
"""Impedance near 1: 1 % of a friction torque is needed to hold a joint, instead of MuJoCo's default 10 %."""
SAG_ITERATIONS = 20
"""Each brings a sagging link nearer to rest by the ratio of gravity's stiffness to the transmission's, about 0.03."""


def plant_model(plant: Plant, *, loaded: bool, step: float) -> mujoco.MjModel:
    """Compile a plant, with its payload or with a bare flange.

    Both have the same layout (the bare flange carries an empty body), so that they run in one batch.

    Args:
        plant: The truth.
        loaded: Whether the payload is mounted.
        step: Physics step [s].

    Raises:
        ModelFileError: If the model file cannot be compiled or is of another arm.
        EffectError: If a model error is more than the robot, its drives or the step allow.
    """
    n = plant.robot.n
    try:
        spec = mujoco.MjSpec.from_file(str(plant.robot.model))
        if len(spec.joints) != n:
            raise ModelFileError(
                f"robot model {plant.robot.model}: {len(spec.joints)} joints, but {plant.robot.name} has {n}"
            )
        mount_payload(spec, plant.payload if loaded else None)
        _give_drives(spec)
        add_model_errors(spec, plant, step)
        spec.option.timestep = step
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
        model = spec.compile()
    except ValueError as error:
        mounted = f" with a payload of {plant.payload.mass:g} kg" if loaded else ""
        raise ModelFileError(f"robot model {plant.robot.model}{mounted}: {str(error).splitlines()[0]}") from error
    _inject(model, plant, loaded=loaded, step=step)
    return model


def bare_arm(mjcf: Path, rotor_inertia: Array) -> mujoco.MjModel:
    """Compile the arm as drawn, with rotors and without friction: what a controller knows of it.

    Args:
        mjcf: Model file.
        rotor_inertia: Ia [kg m^2], shape (n,).

    Raises:
        ModelFileError: If the model file cannot be compiled or has another number of joints.
    """
    try:
        spec = mujoco.MjSpec.from_file(str(mjcf))
        mount_payload(spec, None)
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
        model = spec.compile()
    except ValueError as error:
        raise ModelFileError(f"robot model {mjcf}: {str(error).splitlines()[0]}") from error
    if model.nv != len(rotor_inertia):
        raise ModelFileError(
            f"robot model {mjcf}: {model.nv} joints, but the controller believes in {len(rotor_inertia)}"
        )
    model.dof_armature[:] = rotor_inertia
    model.dof_damping[:] = model.dof_frictionloss[:] = 0.0
    model.jnt_limited[:] = 0
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def mount_payload(spec: mujoco.MjSpec, payload: PayloadBody | None) -> mujoco.MjsBody:
    """Weld the payload, or an empty body in its place, to the last link."""
    last = spec.joints[-1].parent
    body = last.add_body(name="payload", explicitinertial=True)
    if payload is not None:
        body.mass, body.ipos, body.fullinertia = payload.mass, payload.com, payload.inertia
    return body


def _give_drives(spec: mujoco.MjSpec) -> None:
    """One torque drive a joint, whatever the model file has: a servo there is not this plant's."""
    for actuator in spec.actuators:
        spec.delete(actuator)
    for j, joint in enumerate(spec.joints):
        drive = spec.add_actuator(name=f"drive{j + 1}", target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        drive.gaintype, drive.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE


def resting(model: mujoco.MjModel, q: Array) -> Array:
    """Positions of all joints at rest with the driven ones at q.

    Links on elastic transmissions sag until transmission and gravity balance.

    Args:
        model: A compiled plant.
        q: Positions of the driven joints [rad], shape (n,).

    Returns:
        Positions [rad], shape (nq,); q itself on a rigid arm.
    """
    n, links = len(q), model.nq - len(q)
    state = np.concatenate([q[:links], q])
    if not links:
        return state
    compliance, data = 1.0 / model.tendon_stiffness[transmission_tendons(model)], mujoco.MjData(model)
    for _ in range(SAG_ITERATIONS):
        data.qpos[:] = state
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        state[:n] += compliance * (data.qfrc_passive - data.qfrc_bias)[:n]
    return state


def friction_constants(model: mujoco.MjModel) -> Array:
    """Dry friction of the driven joints, then of the coupled motors [N m], shape (n + c,)."""
    return np.concatenate((model.dof_frictionloss[-model.nu :], model.tendon_frictionloss[coupling_tendons(model)]))


def _inject(model: mujoco.MjModel, plant: Plant, *, loaded: bool, step: float) -> None:
    drives, driven = plant.drives, slice(model.nv - model.nu, None)
    inertia, viscous, coulomb = own_parts(plant)
    model.actuator_gainprm[:, 0] = drives.gain
    model.actuator_biasprm[:, 0] = -drives.gain * drives.amplifier_offset - drives.coulomb_asymmetry
    model.actuator_ctrlrange[:] = np.outer(drives.current_limit, (-1.0, 1.0))
    model.actuator_ctrllimited[:] = 1
    model.dof_armature[driven] = inertia
    model.dof_damping[driven] = viscous
    model.dof_frictionloss[driven] = coulomb
    if loaded:
        _drift(model, plant)
    time_constant, damping_ratio = FRICTION_SOLREF
    model.dof_solref[:] = model.tendon_solref_fri[:] = (time_constant * step, damping_ratio)
    model.dof_solimp[:] = model.tendon_solimp_fri[:] = FRICTION_SOLIMP
    model.jnt_limited[:] = 0  # reaching a limit is an error of the run, not a stop to lean on
    mujoco.mj_setConst(model, mujoco.MjData(model))


def _drift(model: mujoco.MjModel, plant: Plant) -> None:
    """Friction of the loaded motion, motors with the wrist coupling; a transmission's damping is not friction."""
    dry, viscous = 1.0 + plant.errors.coulomb_drift, 1.0 + plant.errors.viscous_drift
    model.dof_frictionloss *= dry
    model.tendon_frictionloss *= dry
    model.dof_damping *= viscous
    model.tendon_damping[coupling_tendons(model)] *= viscous
