"""Robots of the command line: a model file, `robot.toml`, or a built-in robot's name."""

from dataclasses import dataclass
from pathlib import Path

from ident.model.structure import Structure, structure_of
from ident.support.arrays import Array
from ident.support.naming import shown
from scenarios.experiments.robot_models import read_arm
from scenarios.support.errors import ScenarioError, UnknownName


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
        word: MJCF or URDF file, `robot.toml`, or a name in `robots.ROBOTS`.
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
    from scenarios.experiments.robots import robot, structure  # only these need a simulated robot

    named = robot(word)
    if flange is not None:
        raise ScenarioError(f"--flange: for model files only; {shown(word)} states its own last body, so remove it")
    own = tuple((each.turns_with, each.motor) for each in named.couplings)
    return NamedRobot(structure(named, couplings or own), named.drives.gain, named.model, named.flange)
