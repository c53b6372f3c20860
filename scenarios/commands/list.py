"""`rx90 list`."""

import argparse
import textwrap

from scenarios.command_line.output import add_form_arguments, form, page, show
from scenarios.command_line.process import Status, write
from scenarios.experiments.scenario_files import builtin_names, scenario_table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """List every built-in scenario with its description."""
    described = {name: str(scenario_table(name)[0].get("description", "")) for name in builtin_names()}
    if form(options) != "text":
        from scenarios.results.written import ListedScenarios

        show(ListedScenarios.of(described).report("Built-in scenarios"), options)
        return Status.PASSED
    width, indent = page().width, max(map(len, described)) + 2
    for name, said in described.items():
        line = f"{name:<{indent}}{said}"
        write((textwrap.fill(line, width, subsequent_indent=" " * indent) if width else line) + "\n")
    return Status.PASSED
