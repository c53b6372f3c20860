"""Access to simulated robots by a built-in name or a `robot.toml`."""

import hashlib
from functools import lru_cache
from pathlib import Path

import numpy as np

import rx90_mjcf
from ident.model.arm import Arm
from ident.model.parameters import INERTIAL, STANDARD
from ident.model.regressor import regressor
from ident.model.structure import Structure, structure_of
from ident.payload.payload import standard_parameters
from ident.support.errors import RobotModelError
from ident.support.files import LARGEST, check_file
from ident.support.naming import nearest, one_line, shown
from scenarios.experiments.robot_models import ADVICE, STATES, TOLERANCE, read_arm
from scenarios.experiments.scenario_files import CATALOG, ROBOT
from scenarios.support.errors import UnknownName, UnreadableFile
from sim.compile import bare_arm
from sim.controller import inverse_dynamics
from sim.plant import PayloadBody
from sim.robot import Robot
from sim.robot_files import read_robot

ROBOTS = {ROBOT: rx90_mjcf.ROBOT, **{path.parent.name: path for path in sorted(CATALOG.glob("robots/*/robot.toml"))}}
"""Robot files of the built-in robots."""
ROUNDING = 1e-12
"""Rounding error of subtracted torques, as a share of their size; for an arm of a ton it exceeds a payload's
millionth."""
PROBE = PayloadBody(mass=2.3, com=(0.11, -0.07, 0.16), inertia=(0.031, 0.027, 0.019, 0.004, -0.003, 0.002))
"""A payload without any symmetry."""
DRAWN = (
    "body_mass", "body_inertia", "body_ipos", "body_iquat", "body_pos", "body_quat", "jnt_type", "jnt_pos", "jnt_axis",
)  # fmt: skip
"""Fields of a compiled model file that affect a simulation, besides ranges and gravity."""


def robot(name: str = ROBOT, folder: Path | None = None) -> Robot:
    """Return a built-in robot or the robot of a file; cached unless the file changes.

    Args:
        name: A name in `ROBOTS`, or the path of a `robot.toml`.
        folder: Base of a relative path; the working folder if None.

    Raises:
        UnknownName: If it is neither.
        RobotError: If its file cannot be read.
    """
    path = robot_file(name, folder)
    return _read(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=16)
def _read(path: Path, stamp: int) -> Robot:
    return read_robot(path)


def robot_file(name: str, folder: Path | None = None) -> Path:
    """Path of a robot's file.

    Raises:
        UnknownName: If it is neither built-in nor an existing file.
        UnreadableFile: If the file cannot be read.
    """
    if name in ROBOTS:
        return ROBOTS[name]
    path = (folder or Path()) / name
    if path.suffix != ".toml":
        advice = f"; did you mean {name}/robot.toml?" if (path / "robot.toml").is_file() else nearest(name, ROBOTS)
        raise UnknownName(
            f"unknown robot {shown(name)}{advice}; built-in: {', '.join(ROBOTS)}; for your own robot, give the "
            "path of its robot.toml (`rx90 new-robot` writes it)"
        )
    check_file(path, most_bytes=LARGEST, error=UnreadableFile)
    return path.resolve()


def structure(arm: Robot, couplings: tuple[tuple[int, int], ...]) -> Structure:
    """Return the identification model of a robot, checked with MuJoCo; cached unless a file changes.

    Args:
        arm: The robot.
        couplings: Pairs of coupled joints, from 0, in the identification model.

    Raises:
        RobotModelError: If the model file is not an arm, or the parsers differ.
    """
    return _structure(arm, arm.model.stat().st_mtime_ns, couplings)


@lru_cache(maxsize=16)
def _structure(arm: Robot, stamp: int, couplings: tuple[tuple[int, int], ...]) -> Structure:
    found = read_arm(arm.model, couplings, flange=arm.flange)
    check_same_payload(found, arm)
    return structure_of(found)


def check_same_payload(arm: Arm, robot: Robot) -> None:
    """Compare the torques of a payload at random states, by the identification model and by MuJoCo.

    Its frame, that of the last link, must be the same for both.

    Raises:
        RobotModelError: If they differ.
    """
    q, dq, ddq = np.random.default_rng(0).uniform(-2.0, 2.0, (3, STATES, arm.n))
    models = (bare_arm(robot.model, robot.drives.rotor_inertia, robot.flange, body) for body in (PROBE, None))
    loaded, bare = (inverse_dynamics(model, q, dq, ddq) for model in models)
    W = regressor(arm, q, dq, ddq)[..., len(STANDARD) * (arm.n - 1) :][..., : len(INERTIAL)]
    torque = W @ standard_parameters(PROBE.mass, PROBE.com, PROBE.inertia)
    if np.abs(loaded - bare - torque).max() > TOLERANCE * np.abs(torque).max() + ROUNDING * np.abs(loaded).max():
        raise RobotModelError(
            f"robot model {one_line(robot.model)}: Pinocchio and MuJoCo put a payload on the last link at "
            f"different places; {ADVICE}"
        )


def robot_digests(name: str, folder: Path) -> dict[str, str]:
    """Return the digests of a robot file and of its model, 16 hexadecimal digits each.

    Raises:
        RobotError: If they cannot be read.
    """
    arm = robot(name, folder)
    model = bare_arm(arm.model, arm.drives.rotor_inertia, arm.flange)
    drawn = hashlib.sha256(np.asarray(model.opt.gravity).tobytes())
    for field in (*DRAWN, "jnt_range"):
        drawn.update(getattr(model, field).tobytes())
    own = hashlib.sha256(robot_file(name, folder).read_bytes())
    return {"robot": own.hexdigest()[:16], "model": drawn.hexdigest()[:16]}
