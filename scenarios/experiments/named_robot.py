"""A robot by whatever names it on a command line: a model file, a `robot.toml`, a built-in name."""

from dataclasses import dataclass
from pathlib import Path

from ident.model.files import MODEL_FILES
from ident.model.structure import Structure, structure_of
from ident.support.arrays import Array
from scenarios.experiments.robot_models import read_arm
from scenarios.experiments.robots import robot, structure


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
