"""The compiled MuJoCo model of a plant: the truth written into MuJoCo's own fields, and nowhere else.

    drive      tau = g (v - v0) - Fcoff     actuator_gainprm = g, actuator_biasprm = -g v0 - Fcoff, ctrlrange = v_max
    rotor      Ia ddq                       dof_armature
    friction   -Fv dq - Fc sign(dq)         dof_damping, dof_frictionloss
    payload    a body welded to link n      body `payload`

so the model can be saved and opened in any MuJoCo viewer. Dry friction is a constraint that MuJoCo softens:
`FRICTION_SOLREF` and `FRICTION_SOLIMP` make it as stiff as the step allows.
"""

import mujoco
import numpy as np

from sim.errors import PlantError
from sim.plant import PayloadBody, Plant

FRICTION_SOLIMP = (0.99, 0.999, 0.001, 0.5, 2.0)
"""Impedance near 1: 1 % of a friction torque is needed to hold a joint, instead of MuJoCo's default 10 %."""


def plant_model(plant: Plant, *, loaded: bool, step: float) -> mujoco.MjModel:
    """Compile a plant, with its payload or with a bare flange.

    Both have the same layout (the bare flange carries an empty body), so that they run in one batch.

    Args:
        plant: The truth.
        loaded: Whether the payload is mounted.
        step: Physics step [s].

    Raises:
        PlantError: If the model file cannot be compiled, or does not have one drive a joint.
    """
    try:
        spec = mujoco.MjSpec.from_file(str(plant.mjcf))
        mount_payload(spec, plant.payload if loaded else None)
        spec.option.timestep = step
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        model = spec.compile()
    except ValueError as error:
        mounted = f" with a payload of {plant.payload.mass:g} kg" if loaded else ""
        raise PlantError(f"robot model {plant.mjcf}{mounted}: {str(error).splitlines()[0]}") from error
    n = len(plant.drives.gain)
    if model.nv != n or model.nu != n:
        raise PlantError(f"robot model {plant.mjcf}: {model.nv} joints and {model.nu} drives, but the plant has {n}")
    _inject(model, plant, step)
    return model


def mount_payload(spec: mujoco.MjSpec, payload: PayloadBody | None) -> mujoco.MjsBody:
    """Weld the payload, or an empty body in its place, to the last link."""
    last = spec.joints[-1].parent
    body = last.add_body(name="payload", explicitinertial=True)
    if payload is not None:
        body.mass, body.ipos, body.fullinertia = payload.mass, payload.com, payload.inertia
    return body


def _inject(model: mujoco.MjModel, plant: Plant, step: float) -> None:
    drives = plant.drives
    model.actuator_gainprm[:, 0] = drives.gain
    model.actuator_biasprm[:, 0] = -drives.gain * drives.amplifier_offset - drives.coulomb_asymmetry
    model.actuator_ctrlrange[:] = np.outer(drives.current_limit, (-1.0, 1.0))
    model.actuator_ctrllimited[:] = 1
    model.dof_armature[:] = drives.rotor_inertia
    model.dof_damping[:] = drives.viscous_friction
    model.dof_frictionloss[:] = drives.coulomb_friction
    model.dof_solref[:] = (2.0 * step, 1.0)  # the stiffest time constant MuJoCo takes
    model.dof_solimp[:] = FRICTION_SOLIMP
    model.jnt_limited[:] = 0  # reaching a limit is an error of the run, not a stop to lean on
    mujoco.mj_setConst(model, mujoco.MjData(model))
