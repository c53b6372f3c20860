"""Robots by the name that a scenario calls them."""

from functools import lru_cache

import rx90_mjcf
from sim.robot import Robot
from sim.robot_files import read_robot

ROBOTS = {"rx90": rx90_mjcf.ROBOT}
"""Robot files of the built-in robots."""
DEFAULT = "rx90"
"""The robot of a scenario that names none."""


@lru_cache(maxsize=16)
def robot(name: str = DEFAULT) -> Robot:
    """A built-in robot, read once a process.

    Args:
        name: Of `ROBOTS`.

    Raises:
        RobotError: If its file cannot be read.
    """
    return read_robot(ROBOTS[name])
