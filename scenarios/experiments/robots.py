"""Robots by name or file: model files verified with both parsers, their links, and the simulated robots.

Parsers support different parts of a format and silently ignore the rest. A misread link gives wrong gains with small
standard deviations. A model is therefore used only if Pinocchio and MuJoCo agree on all joint axes, on gravity, and,
for a simulated robot, on the place of a payload. MuJoCo reads an MJCF file itself, and of a URDF the reduced form of
`ident.model.arm`: links and joints without meshes. If MuJoCo cannot read a URDF, only Pinocchio's result is used.
"""

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from ident.model.arm import Arm, check_own_motors, load_joints, with_transmission
from ident.model.mjcf import MinimalModel
from ident.model.parameters import INERTIAL, STANDARD
from ident.model.regressor import joint_pose, regressor
from ident.model.structure import BaseParameters, Structure, structure_of
from ident.parameters.links import ModelLinks
from ident.payload.payload import standard_parameters
from ident.support.arrays import Array
from ident.support.errors import RobotModelError
from ident.support.files import LARGEST, captured_stderr, check_file
from ident.support.naming import nearest, one_line, shown
from scenarios.experiments.scenario_files import BUILT_IN, CATALOG, ROBOT
from scenarios.support.errors import ScenarioError, WrongValue
from sim.errors import PlantError
from sim.model_spec import compiled, hold_all_but_arm, lean_spec, silenced

if TYPE_CHECKING:
    from sim.robot import Robot  # imported where a simulated robot is read: identification needs none

STATES = 4
"""Number of random positions of all joints for a comparison; a single one could miss a difference by coincidence."""
TOLERANCE = 1e-6
"""Largest difference of an axis, of gravity or of a torque, relative to its size, and of an anchor, relative to the
arm's reach."""
ROUNDING = 1e-12
"""Rounding error of subtracted torques, as a share of their size; for an arm of a ton it exceeds a payload's
millionth."""
UNUSED = (
    "geoms", "meshes", "materials", "textures", "hfields", "skins", "sites", "cameras", "lights", "sensors",
    "actuators", "tendons", "keys", "pairs", "excludes", "equalities", "tuples", "numerics", "texts", "flexes",
)  # fmt: skip
"""Elements of a model that do not affect joint axes; mesh files are often missing."""
SIMULATED = (
    "body_mass", "body_inertia", "body_ipos", "body_iquat", "body_pos", "body_quat", "jnt_type", "jnt_pos", "jnt_axis",
    "jnt_range",
)  # fmt: skip
"""Fields of a compiled model file that affect a simulation, besides gravity."""
ADVICE = "save it with MuJoCo (mj_saveLastXML) and use that file"
PLACEHOLDER = standard_parameters(1.0, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
"""Placeholder of every link in a model that `ident.model.arm` reduced to its kinematics."""
KINEMATICS_ONLY = "the model file has the kinematics only, without link masses"


def read_arm(path: Path, couplings: tuple[tuple[int, int], ...], *, flange: str | None = None) -> Arm:
    """Return the arm of `joints_of_both`; a motor of the file that turns several joints is a `RobotModelError` too."""
    arm, minimal = joints_of_both(path, couplings, flange)
    check_own_motors(arm, minimal)
    return arm


def joints_of_both(path: Path, couplings: tuple[tuple[int, int], ...], flange: str | None) -> tuple[Arm, MinimalModel]:
    """Read an arm of an MJCF or URDF file, and its reduced form, and check its kinematics with MuJoCo.

    Couplings are pairs of joints, from 0; joints outside the chain to the flange are locked. Raises
    `RobotModelError` if it cannot be read, or the two parsers differ; the message names the first joint.
    """
    arm, minimal = load_joints(path, couplings, flange=flange)
    mjcf = minimal.kind == "mjcf"
    try:
        with captured_stderr():
            spec = mujoco.MjSpec.from_file(str(path)) if mjcf else mujoco.MjSpec.from_string(minimal.text)
            hold_all_but_arm(spec, flange if mjcf else None)
            for element in (each for kind in UNUSED for each in list(getattr(spec, kind))):
                spec.delete(element)
            spec.compiler.boundmass = spec.compiler.boundinertia = 1.0
            spec.compiler.balanceinertia = True
            model = spec.compile()
    except PlantError as error:
        raise RobotModelError(f"robot model {one_line(path)}: {error}") from error
    except ValueError as error:
        if not mjcf:
            return arm, minimal
        reason = one_line(" ".join(str(error).split()))
        raise RobotModelError(f"robot model {one_line(path)}: MuJoCo cannot read it: {reason}") from error
    check_same_kinematics(arm, model, path)
    return arm, minimal


def check_same_kinematics(arm: Arm, model: mujoco.MjModel, path: Path) -> None:
    """Compare joints, their anchors and axes at random states, and gravity; raises `RobotModelError` if they differ."""

    def differ(what: str) -> RobotModelError:
        where = f"robot model {one_line(path)}: Pinocchio and MuJoCo read it differently"
        return RobotModelError(f"{where}: {what}; {ADVICE}")

    if model.njnt != arm.n:
        raise differ(f"{arm.n} joints against {model.njnt}")
    for j, own in enumerate(arm.joint_names):
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, j)
        if name not in (None, own):
            raise differ(f"joint {j + 1} is {own} against {name}")
        if (model.jnt_type[j] == int(mujoco.mjtJoint.mjJNT_HINGE)) != arm.revolute[j]:
            raise differ(f"joint {own} is revolute in one and prismatic in the other")
    if np.abs(arm.gravity - model.opt.gravity).max() > TOLERANCE * max(1.0, float(np.abs(arm.gravity).max())):
        raise differ(f"gravity is {arm.gravity} against {model.opt.gravity} m/s^2")
    data, reach = mujoco.MjData(model), 1.0 + float(np.linalg.norm(arm.translation, axis=1).sum())
    for q in np.random.default_rng(0).uniform(-2.0, 2.0, (STATES, arm.n)):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        anchor, axis = joint_places(arm, q)
        turned = data.xmat[model.jnt_bodyid].reshape(-1, 3, 3)
        there = data.xpos[model.jnt_bodyid] + np.einsum("nij,nj->ni", turned, model.jnt_pos)
        off = np.abs(anchor - there).max(axis=1) / reach, np.abs(axis - data.xaxis).max(axis=1)
        for j in np.flatnonzero(np.maximum(*off) > TOLERANCE):
            raise differ(f"the {'axis' if off[1][j] > TOLERANCE else 'place'} of joint {arm.joint_names[j]}")


def joint_places(arm: Arm, q: Array) -> tuple[Array, Array]:
    """Return anchor [m] (of prismatic joints on the moving part) and axis of each joint in the world at q, (n, 3)."""
    R, p = np.eye(3), np.zeros(3)
    anchor, axis = np.empty((arm.n, 3)), np.empty((arm.n, 3))
    for j in range(arm.n):
        E, arrow = joint_pose(arm, j, q[j : j + 1])
        p = p + R @ [float(np.squeeze(x)) for x in arrow]
        R = R @ E[..., 0].T
        anchor[j], axis[j] = p, R @ arm.axis[j]
    return anchor, axis


@silenced()
def nominal_links(path: Path, flange: str | None) -> ModelLinks:
    """Read the links up to the flange with MuJoCo, each in the axes of its body and with the origin on its joint."""
    model = _compiled(path, flange)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    own, carried = np.zeros((2, model.njnt, 10))
    joint_of = {int(body): j for j, body in enumerate(model.jnt_bodyid)}
    for body in range(1, model.nbody):
        root = int(model.body_weldid[body])  # the moving body to which it is fixed
        if root in joint_of:  # others stand still, as the world and mocap bodies
            j = joint_of[root]
            R = data.xmat[root].reshape(3, 3)
            axes = R.T @ data.ximat[body].reshape(3, 3)
            J = (axes * model.body_inertia[body]) @ axes.T
            inertia = (J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2])
            com = R.T @ (data.xipos[body] - data.xanchor[j])
            (own if body == root else carried)[j] += standard_parameters(float(model.body_mass[body]), com, inertia)
    return ModelLinks(own=own, carried=carried, motor=model.dof_armature.copy(), offset=model.jnt_pos.copy())


def _compiled(path: Path, flange: str | None) -> mujoco.MjModel:
    with compiled(one_line(path)):
        return lean_spec(path, flange).compile()


def model_links(path: Path, flange: str | None) -> Array | None:
    """Return the standard parameters of links with the bodies fixed to them, shape (n, 10); None if unreadable."""
    try:
        return nominal_links(path, flange).whole
    except PlantError:  # identification needs no masses
        return None


@silenced()
def model_base(path: Path, flange: str | None, base: BaseParameters) -> Array:
    """Return the base parameters of a model file, including armature, damping and friction loss of its joints, (b,)."""
    model, links = _compiled(path, flange), nominal_links(path, flange)
    if is_placeholder(links):
        raise PlantError(f"{path}: {KINEMATICS_ONLY}; give one that has them")
    damping = model.dof_damping.reshape(model.nv, -1)[:, 0]
    own = {"Ia": model.dof_armature, "Fv": damping, "Fc": model.dof_frictionloss}
    return base.regrouping @ base.standard(links.whole, own)


def is_placeholder(links: ModelLinks) -> bool:
    """Return whether the links are placeholders, as in the kinematics file of `rx90 run --save`."""
    return bool(np.allclose(links.own, PLACEHOLDER, rtol=0.0, atol=1e-9))


def robot(name: str = ROBOT, folder: Path | None = None) -> "Robot":
    """Return a built-in robot, or that of a file relative to a folder; cached unless the file changes."""
    path = robot_file(name, folder)
    return _read(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=16)
def _read(path: Path, stamp: int) -> "Robot":
    from sim.robot import read_robot

    return read_robot(path)


def robot_file(name: str, folder: Path | None = None) -> Path:
    """Path of a robot's file; raises `ScenarioError` unless it exists."""
    built_in = BUILT_IN["robot"]
    if name in built_in:
        import rx90_mjcf

        return rx90_mjcf.ROBOT if name == ROBOT else CATALOG / "robots" / name / "robot.toml"
    path = (folder or Path()) / name
    if path.suffix != ".toml":
        advice = f"; did you mean {name}/robot.toml?" if (path / "robot.toml").is_file() else nearest(name, built_in)
        raise WrongValue(
            f"unknown robot {shown(name)}{advice}; built-in: {', '.join(built_in)}; for your own robot, give the "
            "path of its robot.toml (`rx90 new-robot` writes it)"
        )
    check_file(path, most_bytes=LARGEST, error=ScenarioError)
    return path.resolve()


def structure(arm: "Robot", couplings: tuple[tuple[int, int], ...]) -> Structure:
    """Return the identification model of a robot, checked with MuJoCo; cached unless the model file changes."""
    return _structure(arm, arm.model.stat().st_mtime_ns, couplings)


@lru_cache(maxsize=16)
def _structure(arm: "Robot", stamp: int, couplings: tuple[tuple[int, int], ...]) -> Structure:
    found, minimal = joints_of_both(arm.model, couplings, arm.flange)
    if arm.transmission is None:
        check_own_motors(found, minimal)
    check_same_payload(found, arm)
    return structure_of(found if arm.motors is None else with_transmission(found, arm.motors))


def check_same_payload(arm: Arm, robot: "Robot") -> None:
    """Raise `RobotModelError` unless a payload in the frame of the last link has the same torques in both models."""
    from sim.controller import inverse_dynamics
    from sim.plant import PayloadBody, bare_arm

    body = PayloadBody(mass=2.3, com=(0.11, -0.07, 0.16), inertia=(0.031, 0.027, 0.019, 0.004, -0.003, 0.002))
    q, dq, ddq = np.random.default_rng(0).uniform(-2.0, 2.0, (3, STATES, arm.n))
    models = (bare_arm(robot.model, robot.drives.rotor_inertia, robot.flange, each) for each in (body, None))
    loaded, bare = (inverse_dynamics(model, q, dq, ddq) for model in models)
    W = regressor(arm, q, dq, ddq)[..., len(STANDARD) * (arm.n - 1) :][..., : len(INERTIAL)]
    torque = W @ standard_parameters(body.mass, body.com, body.inertia)
    if np.abs(loaded - bare - torque).max() > TOLERANCE * np.abs(torque).max() + ROUNDING * np.abs(loaded).max():
        raise RobotModelError(
            f"robot model {one_line(robot.model)}: Pinocchio and MuJoCo put a payload on the last link at "
            f"different places; {ADVICE}"
        )


def robot_digests(name: str, folder: Path) -> dict[str, str]:
    """Return the digests of a robot file and of its model, 16 hexadecimal digits each."""
    from sim.plant import bare_arm

    arm = robot(name, folder)
    model = bare_arm(arm.model, arm.drives.rotor_inertia, arm.flange)
    read = hashlib.sha256(np.asarray(model.opt.gravity).tobytes())
    for field in SIMULATED:
        read.update(getattr(model, field).tobytes())
    own = hashlib.sha256(robot_file(name, folder).read_bytes())
    return {"robot": own.hexdigest()[:16], "model": read.hexdigest()[:16]}


@dataclass(frozen=True, slots=True, eq=False)
class NamedRobot:
    """A robot of a command line."""

    structure: Structure
    gain: Array | None  # assumed gains [N m / drive unit], None if unknown
    model: Path
    flange: str | None  # last body of the arm, None if all joints of the file belong to it


def named_robot(word: str, couplings: tuple[tuple[int, int], ...] = (), *, flange: str | None = None) -> NamedRobot:
    """Return a robot by model file, `robot.toml` or built-in name; couplings are by default those of its file."""
    if not word:
        raise WrongValue("expected a model file, robot.toml, or the name of a built-in robot, not an empty word")
    if Path(word).suffix.lower() not in ("", ".toml"):
        return NamedRobot(structure_of(read_arm(Path(word), couplings, flange=flange)), None, Path(word), flange)
    named = robot(word)
    if flange is not None:
        raise ScenarioError(f"--flange: for model files only; {shown(word)} states its own last body, so remove it")
    own = tuple((each.turns_with, each.motor) for each in named.coupling)
    return NamedRobot(structure(named, couplings or own), named.drives.gain, named.model, named.flange)
