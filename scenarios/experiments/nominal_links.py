"""Links of a model file, with the bodies fixed to each."""

from pathlib import Path

import mujoco
import numpy as np

from ident.arm_parameters.links import ModelLinks
from ident.model.base import BaseParameters
from ident.payload.payload import standard_parameters
from ident.support.arrays import Array
from ident.support.naming import one_line
from sim.errors import ModelFileError
from sim.model_spec import compiler_reason, lean_spec, silenced

PLACEHOLDER = standard_parameters(1.0, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
"""Placeholder of every link in a model that `ident.model.files` reduced to its kinematics."""
KINEMATICS_ONLY = "the model file has the kinematics only, without link masses"


@silenced()
def nominal_links(path: Path, flange: str | None) -> ModelLinks:
    """Read the links of a model file with MuJoCo; joints outside the chain to the flange are locked.

    Raises:
        ModelFileError: If MuJoCo cannot read it, for example because a link has no mass.
    """
    return _links(_compiled(path, flange))


def _compiled(path: Path, flange: str | None) -> mujoco.MjModel:
    try:
        return lean_spec(path, flange).compile()
    except ValueError as error:
        raise ModelFileError(f"robot model {one_line(path)}: {compiler_reason(error)}") from error


def _links(model: mujoco.MjModel) -> ModelLinks:
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    n = model.njnt
    own, carried = np.zeros((n, 10)), np.zeros((n, 10))
    joint_of = {int(body): j for j, body in enumerate(model.jnt_bodyid)}
    for body in range(1, model.nbody):
        root = int(model.body_weldid[body])  # the moving body to which it is fixed
        if root:
            j = joint_of[root]
            (own if body == root else carried)[j] += _parameters(model, data, body, j)
    return ModelLinks(own=own, carried=carried, motor=model.dof_armature.copy(), offset=model.jnt_pos.copy())


def _parameters(model: mujoco.MjModel, data: mujoco.MjData, body: int, joint: int) -> Array:
    """Return a body's standard parameters in the frame of a joint: axes of its body, origin on the joint."""
    frame = int(model.jnt_bodyid[joint])
    R = data.xmat[frame].reshape(3, 3)
    com = R.T @ (data.xipos[body] - data.xanchor[joint])
    axes = R.T @ data.ximat[body].reshape(3, 3)
    J = (axes * model.body_inertia[body]) @ axes.T
    inertia = (J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2])
    return standard_parameters(float(model.body_mass[body]), com, inertia)


@silenced()
def model_base(path: Path, flange: str | None, base: BaseParameters) -> Array:
    """Return the base parameters of a model file, including armature, damping and friction loss of its joints.

    Returns:
        Their values, shape (b,).

    Raises:
        ModelFileError: If MuJoCo cannot read it, for example because a link has no mass; if its links are placeholders.
    """
    model = _compiled(path, flange)
    links = _links(model)
    if is_placeholder(links):
        raise ModelFileError(f"{path}: {KINEMATICS_ONLY}; give one that has them")
    damping = model.dof_damping.reshape(model.nv, -1)[:, 0]
    own = {"Ia": model.dof_armature, "Fv": damping, "Fc": model.dof_frictionloss}
    return base.regrouping @ base.standard(links.whole, own)


def is_placeholder(links: ModelLinks) -> bool:
    """Return whether the links are placeholders, as in the kinematics file of `rx90 run --save`."""
    return bool(np.allclose(links.own, PLACEHOLDER, rtol=0.0, atol=1e-9))


def model_links(path: Path, flange: str | None) -> Array | None:
    """Return the standard parameters of links with the bodies fixed to them, shape (n, 10); None if unreadable."""
    try:
        return nominal_links(path, flange).whole
    except ModelFileError:  # identification needs no masses
        return None
