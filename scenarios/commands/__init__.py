"""The commands of `rx90`: one file each, with its arguments (`add_arguments`) and what it does (`main`)."""

import argparse
from importlib import import_module
from typing import Protocol, cast

from scenarios.commands.status import Status

COMMANDS = {
    "list": "built-in scenarios, a line each",
    "new-robot": "start from your own arm: robot, scenario and motion from its model file",
    "run": "simulate a scenario, identify its gains, judge them",
    "monte-carlo": "repeat a scenario many times: errors, coverage, pass rates",
    "predict": "error budget of a scenario to first order: nothing is simulated",
    "sensitivity": "error budget of a scenario: which error source costs how much",
    "compare": "methods side by side on scenarios, yours included",
    "excite": "search for a motion that shows a scenario's gains best",
    "payload": "design a weight that shows every joint's gain",
    "trajectory": "a scenario's motion for a controller: CSV, ROS 2 JointTrajectory, URScript",
    "recipe": "a page to take to the cell: what to command, to mount, to log",
    "view": "show the motions of a scenario, in MuJoCo's viewer or as a picture",
    "convert": "any log to a recording: CSV, UR RTDE, ROS 2 bag, MCAP, Parquet, NumPy",
    "check": "look at recordings before anything is identified: what is wrong with them, or with the model",
    "identify": "identify the gains of a robot from recordings",
    "verify": "weigh another, known mass with the gains found, or predict part of the motions from the rest",
    "payload-of": "mass, centre and inertia of an unknown payload, from its currents and the gains",
    "torque": "joint torques of a recording with intervals, from its currents and the gains",
    "patch": "a copy of a URDF or MJCF with what was identified: efforts, damping, friction, armature",
    "compare-gains": "two sets of gains: what moved beyond its interval",
    "report": "one self-contained page of a result, to hand on: run, study, budget, check, comparison, paper",
    "paper": "repeat the paper's experiment: tables 2 to 4, figure 3",
}
"""Names with a one-line summary, in the order one would use them; `monte-carlo` is the module `monte_carlo` here."""


class Command(Protocol):
    """What the module of a command has. It is imported when the command is asked for, or its help."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Declare the arguments."""
        ...

    def main(self, options: argparse.Namespace) -> Status:
        """Do it."""
        ...


def command(name: str) -> Command:
    """Import the module of a command in `COMMANDS`."""
    return cast(Command, import_module(f"{__name__}.{name.replace('-', '_')}"))
