"""Robot and motion that a scenario names; where there is none, the message names file and key that ask."""

from scenarios.experiments.files.motions import read_motion
from scenarios.experiments.files.places import MOTION
from scenarios.experiments.files.schema import Scenario
from scenarios.experiments.robots import robot
from scenarios.support.errors import UnknownName, UnreadableFile
from sim.robot import Robot
from sim.trajectory import FourierTrajectory


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
