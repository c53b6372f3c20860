"""Verification of a robot model: Pinocchio and MuJoCo must read it in the same way.

Parsers support different parts of a format and silently ignore the rest. A misread link gives wrong gains with small
standard deviations. A model is therefore used only if both parsers agree on all joint axes and on gravity. MuJoCo reads
an MJCF file itself, and of a URDF the reduced form of `ident.model.files`: links and joints without meshes. If MuJoCo
cannot read a URDF, only Pinocchio's result is used.
"""

from pathlib import Path

import mujoco
import numpy as np

from ident.model.arm import Arm, load_arm
from ident.model.files import minimal_model
from ident.support.arrays import Array
from ident.support.captured_stderr import captured_stderr
from ident.support.errors import RobotModelError
from ident.support.naming import one_line
from sim.errors import ModelFileError
from sim.model_spec import hold_all_but_arm

STATES = 4
"""Number of random positions of all joints for the comparison; a single one could miss a difference by coincidence."""
TOLERANCE = 1e-6
"""Largest difference of an axis or of gravity, relative to its size, and of an anchor, relative to the arm's reach."""
UNUSED = (
    "geoms", "meshes", "materials", "textures", "hfields", "skins", "sites", "cameras", "lights", "sensors",
    "actuators", "tendons", "keys", "pairs", "excludes", "equalities", "tuples", "numerics", "texts", "flexes",
)  # fmt: skip
"""Elements of a model that do not affect joint axes; mesh files are often missing."""


def read_arm(path: Path, couplings: tuple[tuple[int, int], ...], *, flange: str | None = None) -> Arm:
    """Read an arm and check its kinematics with MuJoCo.

    Args:
        path: MJCF or URDF file.
        couplings: Pairs of coupled joints, from 0.
        flange: Last body of the arm; joints outside the chain to it are locked.

    Raises:
        RobotModelError: If it cannot be read, or the two parsers differ; the message names the first joint that
            differs.
    """
    arm = load_arm(path, couplings, flange=flange)
    model = _mujoco_model(path, flange)
    if model is not None:
        check_same_kinematics(arm, model, path)
    return arm


def check_same_kinematics(arm: Arm, model: mujoco.MjModel, path: Path) -> None:
    """Compare joints, their anchors and axes at random states, and gravity of both parsers.

    Raises:
        RobotModelError: If they differ; the message names the difference.
    """
    where = f"robot model {one_line(path)}: Pinocchio and MuJoCo read it differently"
    advice = "; save it with MuJoCo (mj_saveLastXML) and use that file"
    names = tuple(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, j) for j in range(model.njnt))
    if model.njnt != arm.n:
        raise RobotModelError(f"{where}: {arm.n} joints against {model.njnt}{advice}")
    revolute = model.jnt_type == int(mujoco.mjtJoint.mjJNT_HINGE)
    for j in range(arm.n):
        if names[j] not in (None, arm.joint_names[j]):
            raise RobotModelError(f"{where}: joint {j + 1} is {arm.joint_names[j]} against {names[j]}{advice}")
        if revolute[j] != arm.revolute[j]:
            raise RobotModelError(
                f"{where}: joint {arm.joint_names[j]} is revolute in one and prismatic in the other{advice}"
            )
    if np.abs(arm.gravity - model.opt.gravity).max() > TOLERANCE * max(1.0, float(np.abs(arm.gravity).max())):
        raise RobotModelError(f"{where}: gravity is {arm.gravity} against {model.opt.gravity} m/s^2{advice}")
    data, reach = mujoco.MjData(model), 1.0 + float(np.linalg.norm(arm.translation, axis=1).sum())
    rng = np.random.default_rng(0)
    for q in rng.uniform(-2.0, 2.0, (STATES, arm.n)):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        anchor, axis = joint_places(arm, q)
        turned = data.xmat[model.jnt_bodyid].reshape(-1, 3, 3)
        there = data.xpos[model.jnt_bodyid] + np.einsum("nij,nj->ni", turned, model.jnt_pos)
        off = np.abs(anchor - there).max(axis=1) / reach, np.abs(axis - data.xaxis).max(axis=1)
        for j in np.flatnonzero(np.maximum(*off) > TOLERANCE):
            what = "axis" if off[1][j] > TOLERANCE else "place"
            raise RobotModelError(f"{where}: the {what} of joint {arm.joint_names[j]}{advice}")


def joint_places(arm: Arm, q: Array) -> tuple[Array, Array]:
    """Return anchor [m] (of prismatic joints on the moving part) and axis of every joint in the world, both (n, 3).

    Positions `q` [rad or m] have the shape (n,).
    """
    R, p = np.eye(3), np.zeros(3)
    anchor, axis = np.empty((arm.n, 3)), np.empty((arm.n, 3))
    for j in range(arm.n):
        p, R = p + R @ arm.translation[j], R @ arm.rotation[j]
        axis[j] = R @ arm.axis[j]
        if arm.revolute[j]:
            R = R @ _turned(arm.axis[j], float(q[j]))
        else:
            p = p + axis[j] * q[j]
        anchor[j] = p
    return anchor, axis


def _turned(axis: Array, angle: float) -> Array:
    """Rotation about a unit axis (Rodrigues)."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K


def _mujoco_model(path: Path, flange: str | None) -> mujoco.MjModel | None:
    """Return MuJoCo's model of a file, without elements that do not affect joints; None if it cannot read a URDF."""
    minimal = minimal_model(path, flange)
    try:
        with captured_stderr():
            spec = (
                mujoco.MjSpec.from_file(str(path))
                if minimal.kind == "mjcf"
                else mujoco.MjSpec.from_string(minimal.text)
            )
            hold_all_but_arm(spec, flange if minimal.kind == "mjcf" else None)
            for kind in UNUSED:
                for element in list(getattr(spec, kind)):
                    spec.delete(element)
            spec.compiler.boundmass = spec.compiler.boundinertia = 1.0
            spec.compiler.balanceinertia = True
            return spec.compile()
    except ModelFileError as error:
        raise RobotModelError(f"robot model {one_line(path)}: {error}") from error
    except ValueError as error:
        if minimal.kind == "urdf":
            return None
        reason = one_line(" ".join(str(error).split()))
        raise RobotModelError(f"robot model {one_line(path)}: MuJoCo cannot read it: {reason}") from error
