"""`rx90 list`."""

import argparse
import textwrap

from scenarios.commands.lifetime import tell
from scenarios.commands.output import page
from scenarios.commands.status import Status
from scenarios.files.tables import builtin_names, scenario_table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """It has none."""


def main(options: argparse.Namespace) -> Status:
    """Name every built-in scenario with its description, a line each where that fits."""
    names, width = builtin_names(), page().width
    indent = max(len(name) for name in names) + 2
    for name in names:
        line = f"{name:<{indent}}{scenario_table(name)[0].get('description', '')}"
        tell((textwrap.fill(line, width, subsequent_indent=" " * indent) if width else line) + "\n")
    return Status.PASSED
