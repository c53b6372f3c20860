"""`rx90 monte-carlo`."""

import argparse

import scenarios.commands.arguments as arguments
from scenarios.commands.status import Status
from scenarios.commands.study import add_study_arguments, carried_out, resuming_command, summary_of
from scenarios.workers.choice import prepare_workers


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("-n", type=arguments.count, required=True, dest="trials", metavar="N", help="number of trials")
    add_study_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Carry out, sum up, plot; 1 if some joint contradicts the scenario's pass rate."""
    prepare_workers(options)
    from scenarios.commands.output import terminal
    from scenarios.files.schema import load_scenario
    from scenarios.studies.monte_carlo import monte_carlo

    scenario = load_scenario(options.scenario)
    study = monte_carlo(scenario, options.trials, options.seed)
    folder = carried_out(study, options, resuming_command("monte-carlo", options, ["-n", str(options.trials)]))

    from scenarios.reports.monte_carlo import print_monte_carlo, write_monte_carlo  # plots: after the work
    from scenarios.studies.pass_rule import FALSE_ALARM
    from scenarios.studies.statistics import COLUMNS, joint_statistics

    rows = folder.table([*COLUMNS, "tolerance"])
    statistics = joint_statistics(rows, wanted=scenario.table.tolerance.pass_rate, false_alarm=FALSE_ALARM)
    trials = statistics[0].trials
    more = f" (the folder holds more than the {options.trials} asked for)" if trials > options.trials else ""
    console = terminal()
    console.print(f"Scenario {scenario.name}, {trials} trials from seed {options.seed}{more}")
    print_monte_carlo(statistics, rows, console)
    with summary_of(options.out):
        written = write_monte_carlo(statistics, rows, scenario, options.out)
    console.print(f"Rows in {options.out / 'trials'}; {', '.join(path.name for path in written)} in {options.out}.")
    return Status.PASSED if all(joint.held for joint in statistics) else Status.MISSED
