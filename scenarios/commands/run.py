"""`rx90 run`."""

import argparse

import scenarios.command_line.arguments as arguments
import scenarios.command_line.gains as gains_arguments
from scenarios.command_line.output import add_form_arguments, show, under_way
from scenarios.command_line.process import Status


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("scenario", metavar="SCENARIO", help="a built-in name or the path of a TOML file")
    parser.add_argument("--seed", type=arguments.seed, default=0, help="seed of every random number (default 0)")
    said = "folder for recordings, payloads, true values and result"
    parser.add_argument("--save", "--out", type=arguments.folder, metavar="DIR", help=said)
    gains_arguments.add_gains_out(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Simulate, identify, judge; status 1 if a tolerance is missed."""
    from scenarios.command_line.writing import right_to_write
    from scenarios.experiments.run import run
    from scenarios.experiments.scenario import load_scenario, setup_of
    from scenarios.rendering.content import Line, Paragraph
    from scenarios.results.gains import Result
    from scenarios.results.gains_file import gains_file
    from scenarios.results.run_folder import identify_command, origin, run_files, save_run, scene_digest

    setup, held, more = setup_of(load_scenario(options.scenario)), None, ()
    if options.save is not None:
        held = right_to_write(options, options.save, run_files(setup), command="rx90 run --save")
    out = gains_arguments.claimed(options, "rx90 run")
    with under_way(options, "preparing") as stages:
        result = run(setup, options.seed, stages=stages)
    if out is not None:
        gains_arguments.write(gains_file(result.estimate, origin(result)), out)
    if held is not None:
        with held.writing():
            scene = scene_digest(setup.scenario)
            save_run(result, held.folder, command=options.command_line, named=options.scenario, scene=scene)
        saved = Paragraph(f"Saved in {options.save}. To repeat the estimate from these files:")
        more = (saved, Line(identify_command(result.setup, held.folder)))
    title = f"Scenario {setup.scenario.name}, seed {options.seed}: {setup.scenario.table.description}"
    show(Result.of_run(result).report(title, *more), options)
    return Status.PASSED if result.passed else Status.MISSED
