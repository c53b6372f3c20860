"""`rx90 list`."""

import argparse

from scenarios.commands.output import terminal
from scenarios.commands.status import Status
from scenarios.files.tables import builtin_names, scenario_table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """It has none."""


def main(options: argparse.Namespace) -> Status:
    """Name every built-in scenario with its description."""
    console, names = terminal(), builtin_names()
    width = max(len(name) for name in names)
    for name in names:
        description = scenario_table(name)[0].get("description", "")
        console.print(f"{name:<{width}}  {description}", no_wrap=True, overflow="ellipsis")
    return Status.PASSED
