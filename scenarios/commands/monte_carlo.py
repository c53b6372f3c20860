"""`rx90 monte-carlo`."""

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
    parser.add_argument("-n", type=arguments.count, required=True, dest="trials", metavar="N", help="number of trials")
    add_study_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Run the study, report, plot; status 1 if a joint contradicts the scenario's pass rate."""
    from scenarios.experiments.scenario import load_scenario
    from scenarios.experiments.study import monte_carlo

    scenario = load_scenario(options.scenario)
    study = monte_carlo(scenario, options.trials, options.seed)
    folder = carried_out(study, options, resuming_command("monte-carlo", options, ["-n", str(options.trials)]))

    from scenarios.experiments.statistics import rows_in
    from scenarios.results.monte_carlo import StudyResult, write_files

    rows = rows_in(folder)
    result = StudyResult.of(scenario, options.seed, rows)
    with summary_of(options.out):
        written = write_files(result, rows, options.out)
    show(result.report(result.title(options.trials), files_part(options.out, written)), options)
    return Status.PASSED if result.passed else Status.MISSED
