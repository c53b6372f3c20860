"""The commands of `rx90`: one file each, with its arguments (`add_arguments`) and what it does (`main`)."""

import argparse
from importlib import import_module
from typing import Protocol, cast

from scenarios.command_line.status import Status

GROUPS: dict[str, dict[str, str]] = {
    "try it": {
        "list": "built-in scenarios, a line each",
        "run": "simulate a scenario, identify its gains, judge them",
        "view": "show the motions of a scenario, live or as a picture",
        "paper": "repeat the paper's experiment: tables 2 to 4, figure 3",
    },
    "your robot": {
        "new-robot": "start with your own arm, from its model file",
        "excite": "search for a motion that shows a scenario's gains best",
        "payload": "design a weight that shows every joint's gain",
    },
    "record": {
        "recipe": "recording instructions: what to command, mount and log",
        "trajectory": "a scenario's motion for a controller: CSV, ROS 2, URScript",
        "convert": "any log to a recording: CSV, UR, ROS 2, Parquet, NumPy",
        "check": "detect faults of recordings or of the model",
    },
    "identify": {
        "identify": "identify the gains of a robot from recordings",
    },
    "prove": {
        "verify": "weigh a known mass with the gains, or cross-validate",
        "compare-gains": "compare two sets of gains: significant changes",
    },
    "use": {
        "payload-of": "an unknown payload, from its currents and the gains",
        "torque": "joint torques with intervals, from currents and gains",
        "patch": "a copy of a URDF or MJCF with what was identified",
    },
    "study": {
        "predict": "error budget to first order: nothing is simulated",
        "sensitivity": "error budget by simulation: effect of each error source",
        "monte-carlo": "repeat a scenario many times: errors, coverage, pass rates",
        "compare": "methods side by side on scenarios, yours included",
    },
    "hand on": {
        "report": "one page of a result for any browser, whole in one file",
    },
    "around it": {
        "schema": "what files and --json hold, as JSON Schema",
        "completion": "let the shell complete commands, options and names",
    },
}
"""What one can do, in the order one would: each command with a one-line summary."""
COMMANDS = {name: summary for group in GROUPS.values() for name, summary in group.items()}
"""All of them; `monte-carlo` is the module `monte_carlo` here."""


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
