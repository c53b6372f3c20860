"""Robots by whatever names them: a built-in name, a `robot.toml`, on a command line a model file."""

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

import rx90_mjcf
from ident.model.files import MODEL_FILES
from ident.model.structure import Structure, structure_of
from ident.support.arrays import Array
from ident.support.file_access import check_file
from ident.support.naming import nearest, shown
from ident.support.toml_files import LARGEST
from scenarios.experiments.files.motions import read_motion
from scenarios.experiments.files.places import MOTION, ROBOT
from scenarios.experiments.files.schema import Scenario
from scenarios.experiments.files.tables import CATALOG
from scenarios.experiments.payload_frames import check_same_payload
from scenarios.experiments.robot_models import read_arm
from scenarios.support.errors import UnknownName, UnreadableFile
from sim.compile import bare_arm
from sim.robot import Robot
from sim.robot_files import read_robot
from sim.trajectory import FourierTrajectory

FOLDER = CATALOG / "robots"
"""Folder of the built-in robots but the RX-90, a folder each."""
ROBOTS = {"rx90": rx90_mjcf.ROBOT, **{path.parent.name: path for path in sorted(FOLDER.glob("*/robot.toml"))}}
"""Robot files of the built-in robots."""
DRAWN = (
    "body_mass", "body_inertia", "body_ipos", "body_iquat", "body_pos", "body_quat", "jnt_type", "jnt_pos", "jnt_axis",
)  # fmt: skip
"""What of a compiled model file a simulation depends on, besides ranges and gravity."""


def robot(name: str = ROBOT, folder: Path | None = None) -> Robot:
    """A built-in robot, or that of a file; read once a process unless it changes.

    Args:
        name: Of `ROBOTS`, or the place of a `robot.toml`.
        folder: What that place is relative to; the working folder if None.

    Raises:
        UnknownName: If it is neither.
        RobotError: If its file cannot be read.
    """
    path = robot_file(name, folder)
    return _read(path, path.stat().st_mtime_ns)


def robot_file(name: str, folder: Path | None = None) -> Path:
    """Path of a robot's file.

    Raises:
        UnknownName: If it is neither built in nor there.
        UnreadableFile: If it is no file that can be read.
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
    """What identification knows of a robot, confirmed by the simulator's reading; once a process unless a file changes.

    Args:
        arm: The robot.
        couplings: Pairs of joints, from 0, that are believed to be coupled.

    Raises:
        RobotModelError: If the model file is no arm, or both readings differ.
    """
    return _structure(arm, arm.model.stat().st_mtime_ns, couplings)


def robot_digests(name: str, folder: Path) -> dict[str, str]:
    """What tells a robot from others, its own file and what its model file draws, 16 hexadecimal digits each.

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


@lru_cache(maxsize=16)
def _read(path: Path, stamp: int) -> Robot:
    return read_robot(path)


@lru_cache(maxsize=16)
def _structure(arm: Robot, stamp: int, couplings: tuple[tuple[int, int], ...]) -> Structure:
    found = read_arm(arm.model, couplings, flange=arm.flange)
    check_same_payload(found, arm)
    return structure_of(found)


@dataclass(frozen=True, slots=True, eq=False)
class NamedRobot:
    """What is known of a robot.

    Attributes:
        structure: Of its arm.
        gain: What its drive gains are about [N m / drive unit], None where no file states them.
        model: File of its model.
        flange: Last body of the model's arm, None where all joints are the arm's.
    """

    structure: Structure
    gain: Array | None
    model: Path
    flange: str | None


def named_robot(word: str, couplings: tuple[tuple[int, int], ...] = (), *, flange: str | None = None) -> NamedRobot:
    """A robot from a command line.

    Args:
        word: MJCF or URDF file, `robot.toml`, or a name in `ROBOTS`.
        couplings: Pairs of coupled joints, from 0; those of a robot's own file where there is none.
        flange: Last body of a model file's arm; None where all joints are the arm's.

    Raises:
        UnknownName: If it is none of these.
        RobotModelError: If the model file is no arm, or the motor of a coupling stands before the other joint.
        RobotError: If the robot's file cannot be read.
    """
    if Path(word).suffix.lower() in MODEL_FILES:
        return NamedRobot(structure_of(read_arm(Path(word), couplings, flange=flange)), None, Path(word), flange)
    named = robot(word)
    own = tuple((each.turns_with, each.motor) for each in named.couplings)
    return NamedRobot(structure(named, couplings or own), named.drives.gain, named.model, named.flange)


def robot_of(scenario: Scenario) -> Robot:
    """The robot.

    Raises:
        UnknownName: If there is none.
        UnreadableFile: If its file cannot be read.
        RobotError: If its file describes none.
    """
    try:
        return robot(scenario.table.robot, scenario.folder)
    except (UnknownName, UnreadableFile) as error:
        raise type(error)(f"{_asking(scenario, 'robot')}: {error}") from error


def motion_of(scenario: Scenario) -> FourierTrajectory:
    """The motion.

    Raises:
        UnknownName: If there is none.
        UnreadableFile: If its file cannot be read.
        ScenarioError: If its file holds none.
    """
    try:
        return read_motion(scenario.table.experiment.motion, scenario.folder)
    except UnknownName as error:
        raise UnknownName(f"{_asking(scenario, MOTION)}: {error}") from error


def _asking(scenario: Scenario, key: str) -> str:
    return f"{scenario.asking.get(key, scenario.name)}: {key}"
