"""Motions in the forms that controllers take: one file a form, whose `text` writes a sampled motion."""

from collections.abc import Callable
from importlib import import_module

from scenarios.design.motion_formats.sampled import SampledMotion

FORMATS = {
    "csv": "positions, speeds and accelerations, one row per sample",
    "ros": "ROS 2 JointTrajectory, YAML",
    "urscript": "URScript, a slow movej to the start and a list of servoj; six joints that turn",
}
"""Names with what they are; each is a module here, imported when it is used."""
ENDINGS = {".csv": "csv", ".yaml": "ros", ".yml": "ros", ".script": "urscript"}
"""Form by the ending of a file."""


def writer(name: str) -> Callable[[SampledMotion], str]:
    """The function that writes a motion in a form of `FORMATS`.

    It raises `ScenarioError` where the form cannot hold the motion.
    """
    return import_module(f"{__name__}.{name}").text
