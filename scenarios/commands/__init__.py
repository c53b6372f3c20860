"""The commands of `rx90`, related ones in a module: `X_arguments` declares its arguments, `X_command` runs X."""

import argparse
from collections.abc import Callable
from importlib import import_module
from importlib.resources import files
from typing import NamedTuple

from scenarios.command_line.process import Status

GROUPS: dict[str, dict[str, str]] = {
    "try it": {
        "list": "list the built-in scenarios",
        "run": "simulate a scenario, identify its gains, test them",
        "view": "show the motions of a scenario, live or as a picture",
        "paper": "repeat the paper's experiment: tables 2 to 4, figure 3",
    },
    "your robot": {
        "new-robot": "create a robot and scenario from a model file",
        "excite": "search for the motion with the smallest gain uncertainty",
        "payload": "design a payload that identifies every gain",
    },
    "record": {
        "record": "what to command, mount and log: instructions, motion for the controller",
        "convert": "convert a log: CSV, UR, ROS 2, Parquet, NumPy",
        "check": "detect faults of recordings or of the model",
    },
    "identify": {"identify": "identify the gains of a robot from recordings"},
    "validate": {"verify": "test gains with a known payload, or compare two sets"},
    "use": {
        "payload-of": "estimate an unknown payload from currents and gains",
        "torque": "estimate joint torques from currents and gains",
        "patch": "write identified values into a copy of a URDF or MJCF",
    },
    "study": {
        "predict": "first-order error budget, without simulation",
        "sensitivity": "error budget by simulation: effect of each error source",
        "monte-carlo": "repeat a scenario many times: errors, coverage, pass rates",
        "compare": "compare methods on scenarios, your own included",
    },
    "report": {"report": "write a saved result as one HTML page"},
    "schemas": {"schema": "JSON Schemas of files and of --json output"},
}
"""Commands in the order of use, each with a one-line summary."""
EXAMPLES = files(__name__).joinpath("examples.txt").read_text(encoding="utf-8").splitlines()
"""Two command lines of each command, in the order of use; those on `rx90` use the folders that `run` writes."""
FIRST = [next(line for line in EXAMPLES if line.startswith(f"rx90 {name} ")) for name in ("run", "check", "identify")]
"""The commands that one needs first."""
COMMANDS = {name: summary for group in GROUPS.values() for name, summary in group.items()}
MODULES = {
    "catalog": ("list", "view", "report", "schema"),
    "design": ("new-robot", "excite", "payload"),
    "recordings": ("record", "convert", "check"),
    "identification": ("run", "paper", "identify"),
    "validation": ("verify", "payload-of", "torque", "patch"),
    "studies": ("predict", "sensitivity", "monte-carlo", "compare"),
}
"""Modules here, each with its commands; another command is in a module of its own name."""
NEEDED = {
    **dict.fromkeys(("excite", "payload", "paper", "sensitivity", "monte-carlo", "compare"), "study"),
    "report": "pages",
    "view": "film",
}
"""The package extra that a command needs, if any."""


UNREPORTED = ("view", "report", "schema")
"""Commands that print no report, which would have several formats."""


class Command(NamedTuple):
    """A command: what declares its arguments, and what runs it with the parsed ones."""

    add_arguments: Callable[[argparse.ArgumentParser], None]
    main: Callable[[argparse.Namespace], Status]


def command(name: str) -> Command:
    """Import a command in `COMMANDS`."""
    prefix = name.replace("-", "_")
    module = next((module for module, names in MODULES.items() if name in names), prefix)
    found = import_module(f"{__name__}.{module}")

    def add_arguments(parser: argparse.ArgumentParser) -> None:
        if declare := getattr(found, f"{prefix}_arguments", None):
            declare(parser)
        if name not in UNREPORTED:
            from scenarios.command_line.output import add_form_arguments

            add_form_arguments(parser)

    return Command(add_arguments, getattr(found, f"{prefix}_command"))
