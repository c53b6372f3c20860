"""A robot model that two parsers read alike: Pinocchio for the identification, MuJoCo against it.

Readers of robot models disagree on what they know of a format, and each leaves out in silence what it does not know.
A misread link gives gains that are wrong and look certain, so a model is used only if both put every joint axis and
gravity at the same place. MuJoCo reads an MJCF file itself, and of a URDF what `ident.model_files` keeps: links and
joints without meshes. Where MuJoCo cannot read a URDF, which is not its format, Pinocchio's reading stands alone.
"""

from pathlib import Path

import mujoco
import numpy as np

from ident.arm import Arm, load_arm
from ident.arrays import Array
from ident.errors import RobotModelError
from ident.model_files import minimal_model
from ident.naming import one_line
from ident.quiet import captured_stderr

STATES = 4
"""Random positions of all joints that are compared; one would do, were no axis ever hit by chance."""
TOLERANCE = 1e-6
"""Difference of an axis or of gravity, as a share of its size, and of an anchor in shares of the arm's reach."""
UNUSED = (
    "geoms", "meshes", "materials", "textures", "hfields", "skins", "sites", "cameras", "lights", "sensors",
    "actuators", "tendons", "keys", "pairs", "excludes", "equalities", "tuples", "numerics", "texts", "flexes",
)  # fmt: skip
"""What a model holds that moves no joint axis; files of meshes are often missing."""


def read_arm(path: Path, couplings: tuple[tuple[int, int], ...]) -> Arm:
    """Read an arm and have MuJoCo confirm its kinematics.

    Args:
        path: MJCF or URDF file.
        couplings: Pairs of coupled joints, from 0.

    Raises:
        RobotModelError: If it cannot be read, or the two readings differ; names the first joint that does.
    """
    arm = load_arm(path, couplings)
    model = _mujoco_model(path)
    if model is not None:
        check_same_kinematics(arm, model, path)
    return arm


def check_same_kinematics(arm: Arm, model: mujoco.MjModel, path: Path) -> None:
    """Compare the joints of two readings of one file, their anchors and axes at random states, and gravity.

    Raises:
        RobotModelError: Naming what differs and where.
    """
    where = f"robot model {one_line(path)}: Pinocchio and MuJoCo read it differently"
    advice = "; let MuJoCo write it anew (mj_saveLastXML), or simplify what is unusual there"
    names = tuple(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, j) for j in range(model.njnt))
    if model.njnt != arm.n:
        raise RobotModelError(f"{where}: {arm.n} joints against {model.njnt}{advice}")
    revolute = model.jnt_type == int(mujoco.mjtJoint.mjJNT_HINGE)
    for j in range(arm.n):
        if names[j] not in (None, arm.joint_names[j]):
            raise RobotModelError(f"{where}: joint {j + 1} is {arm.joint_names[j]} against {names[j]}{advice}")
        if revolute[j] != arm.revolute[j]:
            raise RobotModelError(f"{where}: joint {arm.joint_names[j]} turns for one and slides for the other{advice}")
    if np.abs(arm.gravity - model.opt.gravity).max() > TOLERANCE * max(1.0, float(np.abs(arm.gravity).max())):
        raise RobotModelError(f"{where}: gravity is {arm.gravity} against {model.opt.gravity} m/s^2{advice}")
    data, reach = mujoco.MjData(model), 1.0 + float(np.linalg.norm(arm.translation, axis=1).sum())
    rng = np.random.default_rng(0)
    for q in rng.uniform(-2.0, 2.0, (STATES, arm.n)):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        anchor, axis = joint_places(arm, q)
        off = np.abs(anchor - data.xanchor).max(axis=1) / reach, np.abs(axis - data.xaxis).max(axis=1)
        for j in np.flatnonzero(np.maximum(*off) > TOLERANCE):
            what = "axis" if off[1][j] > TOLERANCE else "place"
            raise RobotModelError(f"{where}: the {what} of joint {arm.joint_names[j]}{advice}")


def joint_places(arm: Arm, q: Array) -> tuple[Array, Array]:
    """Anchor [m] and axis of every joint in the world, both (n, 3), at positions q (n,)."""
    R, p = np.eye(3), np.zeros(3)
    anchor, axis = np.empty((arm.n, 3)), np.empty((arm.n, 3))
    for j in range(arm.n):
        p, R = p + R @ arm.translation[j], R @ arm.rotation[j]
        axis[j] = R @ arm.axis[j]
        if arm.revolute[j]:
            R = R @ _turned(arm.axis[j], float(q[j]))
        anchor[j] = p
        if not arm.revolute[j]:
            p = p + axis[j] * q[j]
    return anchor, axis


def _turned(axis: Array, angle: float) -> Array:
    """Rotation about a unit axis (Rodrigues)."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K


def _mujoco_model(path: Path) -> mujoco.MjModel | None:
    """MuJoCo's reading of a file without what moves no joint; None if it cannot read a URDF."""
    minimal = minimal_model(path)
    try:
        with captured_stderr():
            spec = (
                mujoco.MjSpec.from_file(str(path))
                if minimal.kind == "mjcf"
                else mujoco.MjSpec.from_string(minimal.text)
            )
            for kind in UNUSED:
                for element in list(getattr(spec, kind)):
                    spec.delete(element)
            spec.compiler.boundmass = spec.compiler.boundinertia = 1.0
            spec.compiler.balanceinertia = True
            return spec.compile()
    except ValueError as error:
        if minimal.kind == "urdf":
            return None
        reason = one_line(" ".join(str(error).split()))
        raise RobotModelError(f"robot model {one_line(path)}: MuJoCo cannot read it: {reason}") from error
