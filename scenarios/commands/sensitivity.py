"""`rx90 sensitivity`."""

import argparse

import scenarios.command_line.arguments as arguments
from scenarios.command_line.output import show
from scenarios.command_line.process import Status
from scenarios.command_line.study_arguments import (
    add_study_arguments,
    carried_out,
    files_part,
    resuming_command,
    summary_of,
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "--repeats", type=arguments.count, default=16, help="trials of each source alone, a power of 2 (default 16)"
    )
    parser.add_argument(
        "--samples", type=arguments.count, default=64, help="rows of the Sobol design, a power of 2 (default 64)"
    )
    add_study_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Run both designs, rank the error sources."""
    from scenarios.experiments.scenario import load_scenario
    from scenarios.experiments.study import sensitivity

    scenario = load_scenario(options.scenario)
    study = sensitivity(scenario, repeats=options.repeats, samples=options.samples, seed=options.seed)
    own = ["--repeats", str(options.repeats), "--samples", str(options.samples)]
    folder = carried_out(study, options, resuming_command("sensitivity", options, own))

    from scenarios.results.sensitivity import Budget, write_files

    found = Budget.of(scenario, study.count, folder, options.seed)
    title = found.title(len(scenario.table.sources))
    with summary_of(options.out):
        written = write_files(found, found.report(title), options.out)
    show(found.report(title, files_part(options.out, written)), options)
    return Status.PASSED
