"""`rx90 excite`."""

import argparse
import math
import shlex
from dataclasses import replace

import scenarios.commands.arguments as arguments
from scenarios.commands.lifetime import ending
from scenarios.commands.output import add_form_arguments, show
from scenarios.commands.parser import complain, printable
from scenarios.commands.searching import add_search_arguments, check_harmonics, searched
from scenarios.commands.status import Status
from scenarios.commands.writing import right_to_write
from scenarios.workers.processes import PROCESSES

OPTIONS = ("seed", "harmonics", "duration", "evaluations")
"""Options that the motion depends on."""
AGAINST = {"noise": "of the currents", "all": "noise and the scenario's error sources"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("scenario", metavar="SCENARIO", help="gives arm, drives, payload and wanted joints")
    add(
        "--out",
        type=arguments.file,
        required=True,
        metavar="FILE",
        help="motion file to write, TOML; a search that was stopped goes on from what it left there",
    )
    add_search_arguments(parser)
    what = "; ".join(f"{name}: {words}" for name, words in AGAINST.items())
    add("--against", choices=AGAINST, default="noise", help=f"errors to make small: {what} (default noise)")
    arguments.add_force_argument(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Search, write the motion, tell what it predicts; of a search that is stopped, write the best so far."""
    held = right_to_write(options, options.out.parent, [options.out.name], command="rx90 excite")
    check_harmonics(options)
    PROCESSES.prepare()
    from scenarios.build import bench, cell
    from scenarios.design.against import Sourced
    from scenarios.design.excitation import SEARCHED_HZ, Design
    from scenarios.design.prediction import RESIDUAL
    from scenarios.design.problem import design_problem
    from scenarios.design.search import Series
    from scenarios.files.loading import load_scenario
    from scenarios.reports.content import Report
    from scenarios.store.searched_motion import SearchedMotion, unfinished, write_searched
    from sim.errors import TrajectoryError

    command = found_by(options)
    before = unfinished(options.out, command)
    scenario = load_scenario(options.scenario)
    problem = design_problem(cell(scenario))
    if options.against == "all":
        sourced = Sourced(scenario, problem.joints).reduced(bench(scenario).experiments[0].trajectory, SEARCHED_HZ)
        complain(f"searching against noise and {', '.join(sourced.names)}")
        problem = replace(problem, added=sourced)
    design = Design(problem)
    series = Series(limits=problem.limits, harmonics=options.harmonics, duration=options.duration)
    outcome = searched(design, series, options, before)
    first, found, interrupt = outcome.first, outcome.found, outcome.interrupt
    if first is None or found is None:
        raise interrupt or AssertionError("a search that is not stopped finds a motion")
    complain(f"cost of the start {first.cost:.4f}, of the motion found {found.cost:.4f}")
    try:
        motion = design.fitted(series.motion(found.x))
    except TrajectoryError as error:
        if interrupt is None:
            raise
        complain(f"stopped; nothing is written: {error}")
        return ending(interrupt)
    result = SearchedMotion(
        motion=motion,
        command=command,
        tried=found.tried,
        wanted=found.tried if interrupt is None else options.evaluations,
        deviations=design.deviations(design.rows(motion)).total,
    )
    with held.writing():
        write_searched(result, options.out, RESIDUAL)
    if interrupt is not None:
        complain(f"stopped; the best so far is in {options.out}, the same command goes on from there")
        return ending(interrupt)
    said = f"{options.out}: predicted standard deviation of the gains [%]: {result.predicted}"
    document = {
        "out": str(options.out),
        "tried": result.tried,
        "cost_of_start": first.cost,
        "cost": found.cost,
        "predicted_rel_std": [std if math.isfinite(std) else None for std in result.deviations.tolist()],
    }
    show(Report(said, (), document), options)
    return Status.PASSED


def found_by(options: argparse.Namespace) -> str:
    """The command that finds the same motion."""
    words = ["rx90", "excite", options.scenario]
    for name in OPTIONS:
        words += [f"--{name}", f"{getattr(options, name):.12g}"]
    words += ["--against", options.against] if options.against != "noise" else []
    return printable(shlex.join(words))
