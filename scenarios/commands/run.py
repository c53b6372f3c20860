"""`rx90 run`."""

import argparse

import scenarios.commands.arguments as arguments
from scenarios.commands.status import Status


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("scenario", metavar="SCENARIO", help="a built-in name or the path of a TOML file")
    parser.add_argument("--seed", type=arguments.seed, default=0, help="seed of every random number (default 0)")
    parser.add_argument(
        "--save", type=arguments.folder, metavar="DIR", help="write recordings, payload, truth and result there"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of a table")


def main(options: argparse.Namespace) -> Status:
    """Simulate, identify, judge; 1 if a tolerance is missed."""
    from scenarios.build import bench
    from scenarios.commands.output import terminal
    from scenarios.files.schema import load_scenario
    from scenarios.reports.run import print_run
    from scenarios.run import run
    from scenarios.store.run_folder import identify_command, run_document, save_run, to_json

    console = terminal()
    result = run(bench(load_scenario(options.scenario)), options.seed)
    if options.save is not None:
        save_run(result, options.save)
    if options.json:
        console.out(to_json(run_document(result)), highlight=False)
    else:
        print_run(result, console)
        if options.save is not None:
            console.print(f"Saved in {options.save}. The same estimate from these files:")
            console.print(identify_command(result, options.save), soft_wrap=True)
    return Status.PASSED if result.verdict.passed else Status.MISSED
