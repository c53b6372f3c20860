"""The mounting face of payloads: the face of the flange in the frame of the last link."""

from dataclasses import dataclass

import mujoco
import numpy as np

from ident.support.arrays import Array
from sim.errors import ModelFileError
from sim.model_spec import compiler_reason, full_spec
from sim.robot import Robot
from sim.silenced_mujoco import silenced

NAMES = ("flange", "attachment_site", "attachment", "tool0", "ee_link")
"""Names of sites and bodies at a flange; the first one found is used."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Flange:
    """A flange's face.

    Attributes:
        origin: Its centre in the frame of the last link [m], shape (3,), relative to the last joint, as for a payload.
        rotation: Rotation matrix from the flange's axes to those of the last link, shape (3, 3); z points away from the
            arm.
        name: Name of the site or body that defines the flange; empty if the last joint's axis is used.
    """

    origin: Array
    rotation: Array
    name: str


@silenced()
def flange_of(robot: Robot) -> Flange:
    """The flange of an arm.

    Raises:
        ModelFileError: If its model file cannot be compiled.
    """
    try:
        model = full_spec(robot.model, robot.flange).compile()
    except ValueError as error:
        raise ModelFileError(f"robot model {robot.model}: {compiler_reason(error)}") from error
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    last = int(model.jnt_bodyid[-1])
    R, p = data.xmat[last].reshape(3, 3), data.xanchor[-1]
    for name in NAMES:
        for kind, places, turns, bodies in (
            (mujoco.mjtObj.mjOBJ_SITE, data.site_xpos, data.site_xmat, model.site_bodyid),
            (mujoco.mjtObj.mjOBJ_BODY, data.xpos, data.xmat, np.arange(model.nbody)),
        ):
            k = mujoco.mj_name2id(model, kind, name)
            if k >= 0 and model.body_weldid[bodies[k]] == model.body_weldid[last]:
                return Flange(origin=R.T @ (places[k] - p), rotation=R.T @ turns[k].reshape(3, 3), name=name)
    return Flange(origin=np.zeros(3), rotation=_toward(model.jnt_axis[-1]), name="")


def _toward(axis: Array) -> Array:
    """Return the smallest rotation that maps z to a unit vector."""
    z = axis / np.linalg.norm(axis)
    quat = np.empty(4)
    mujoco.mju_quatZ2Vec(quat, z)
    R = np.empty(9)
    mujoco.mju_quat2Mat(R, quat)
    return R.reshape(3, 3)
