"""Access to robots by a built-in name, a `robot.toml` or, on a command line, a model file."""

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

import rx90_mjcf
from ident.model.structure import Structure, structure_of
from ident.support.arrays import Array
from ident.support.file_access import check_file
from ident.support.naming import nearest, shown
from ident.support.toml_files import LARGEST
from scenarios.experiments.robot_models import check_same_payload, read_arm
from scenarios.experiments.scenario_files import CATALOG, ROBOT
from scenarios.support.errors import ScenarioError, UnknownName, UnreadableFile
from sim.compile import bare_arm
from sim.robot import Robot
from sim.robot_files import read_robot

ROBOTS = {ROBOT: rx90_mjcf.ROBOT, **{path.parent.name: path for path in sorted(CATALOG.glob("robots/*/robot.toml"))}}
"""Robot files of the built-in robots."""
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


@dataclass(frozen=True, slots=True, eq=False)
class NamedRobot:
    """A robot of a command line and its known properties.

    Attributes:
        structure: Identifiable structure of the arm.
        gain: A-priori drive gains [N m / drive unit], None if unknown.
        model: Path of the model file.
        flange: Last body of the arm, None if all joints belong to the arm.
    """

    structure: Structure
    gain: Array | None
    model: Path
    flange: str | None


def named_robot(word: str, couplings: tuple[tuple[int, int], ...] = (), *, flange: str | None = None) -> NamedRobot:
    """Return the robot of a command-line argument.

    Args:
        word: MJCF or URDF file, `robot.toml`, or a name in `ROBOTS`.
        couplings: Pairs of coupled joints, from 0; if empty, those of the robot's file.
        flange: Last body of the arm in a model file; None if all joints belong to the arm.

    Raises:
        UnknownName: If it is none of these.
        ScenarioError: If a flange is given for a robot whose file states it.
        RobotModelError: If the model file is not an arm, or the motor of a coupling precedes the other joint.
        RobotError: If the robot's file cannot be read.
    """
    if not word:
        raise UnknownName("expected a model file, robot.toml, or the name of a built-in robot, not an empty word")
    if Path(word).suffix.lower() not in ("", ".toml"):
        return NamedRobot(structure_of(read_arm(Path(word), couplings, flange=flange)), None, Path(word), flange)
    named = robot(word)
    if flange is not None:
        raise ScenarioError(f"--flange: for model files only; {shown(word)} states its own last body, so remove it")
    own = tuple((each.turns_with, each.motor) for each in named.couplings)
    return NamedRobot(structure(named, couplings or own), named.drives.gain, named.model, named.flange)
