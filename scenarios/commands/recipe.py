"""`rx90 recipe`."""

import argparse

import scenarios.commands.arguments as arguments
from scenarios.commands import COMMANDS
from scenarios.commands.output import add_form_arguments, show
from scenarios.commands.parser import printable
from scenarios.commands.status import Status
from scenarios.store.claim import claim


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("scenario", metavar="SCENARIO", help="gives robot, motions, weights and options")
    add("--out", type=arguments.file, required=True, metavar="FILE", help="page to write, Markdown")
    arguments.add_force_argument(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Prepare the scenario, write the page."""
    held = claim(options.out.parent, [options.out.name], command="rx90 recipe", force=options.force)
    from scenarios.build import bench
    from scenarios.files.loading import load_scenario
    from scenarios.reports.content import Report
    from scenarios.reports.files import write_markdown
    from scenarios.reports.recipe import recipe_report
    from sim.bearable import check_bearable

    prepared = bench(load_scenario(options.scenario))
    check_bearable(prepared.experiments)
    report = recipe_report(prepared, options.scenario, COMMANDS)
    with held.writing():
        write_markdown(report, options.out)
    show(Report(printable(f"{options.out}: {report.title}"), (), {"out": str(options.out)}), options)
    return Status.PASSED
