"""`rx90 excite`."""

import argparse
import shlex
from dataclasses import replace
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments
from scenarios.command_line.output import add_form_arguments, show
from scenarios.command_line.process import Status, complain, ending, printable
from scenarios.command_line.searching import add_search_arguments, check_harmonics, searched
from scenarios.command_line.writing import right_to_write

if TYPE_CHECKING:
    from ident.support.arrays import Mask
    from scenarios.design.excitation import Design, Problem
    from scenarios.design.search import Searchable
    from scenarios.experiments.build import Setup
    from scenarios.experiments.files.schema import Scenario
    from sim.trajectory import FourierTrajectory

OPTIONS = ("seed", "harmonics", "duration", "evaluations")
"""Options that affect the motion."""
PROTOCOLS = {
    "motion": "joints move together, up to their limits",
    "holds": "slow sweeps between poses that are held; --duration 72 and --evaluations 3000 unless given",
}
USUAL = {
    "motion": {"harmonics": 20, "duration": 20.0, "evaluations": 40000},
    "holds": {"duration": 72.0, "evaluations": 3000},
}
"""Defaults of a search."""
AGAINST = {"noise": "noise of the currents alone", "all": "noise and the scenario's error sources"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("scenario", metavar="SCENARIO", help="gives arm, drives, payload and the joints to identify")
    said = "motion file to write, TOML; an interrupted search continues from it"
    add("--out", type=arguments.file, required=True, metavar="FILE", help=said)
    what = "; ".join(f"{name}: {words}" for name, words in PROTOCOLS.items())
    add("--protocol", choices=PROTOCOLS, default="motion", help=f"kind of motion: {what} (default motion)")
    add_search_arguments(parser)
    parser.set_defaults(harmonics=None, duration=None, evaluations=None)  # defaults depend on the protocol
    what = "; ".join(f"{name}: {words}" for name, words in AGAINST.items())
    add("--improve", action="store_true", help="start from the scenario's own motion, and never write a worse one")
    add("--against", choices=AGAINST, default="noise", help=f"errors to minimise: {what} (default noise)")
    arguments.add_force_argument(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Search, write the motion, report the predicted accuracy; write the best motion so far of a stopped search."""
    held = right_to_write(options, options.out.parent, [options.out.name], command="rx90 excite")
    _fill_in(options)
    import numpy as np

    from scenarios.design.excitation import Design
    from scenarios.design.fitting import best_fitted
    from scenarios.design.results import Searched, finite
    from scenarios.design.search import Series
    from scenarios.design.searched_motion import (
        Unfinished,
        first_motion,
        own_motion,
        percents,
        search_comments,
        unfinished,
    )
    from scenarios.experiments.build import setup_without_motion
    from scenarios.experiments.files.loading import load_scenario
    from scenarios.experiments.files.motions import write_motion
    from scenarios.rendering.content import Report
    from sim.errors import TrajectoryError

    command = found_by(options)
    before = unfinished(options.out, command)
    scenario = load_scenario(options.scenario)
    setup = setup_without_motion(scenario)
    problem, series, shown = _searchable(_problem(scenario, setup, options), options)
    design = Design(problem)
    if options.improve and before is None and isinstance(series, Series):
        before = Unfinished(first_motion(setup.scenario, series), tried=0)
    own = None if options.protocol == "holds" else own_motion(setup.scenario, design)
    outcome = searched(design, series, options, before)
    first, found, interrupt = outcome.first, outcome.found, outcome.interrupt
    if first is None or found is None:
        raise interrupt or AssertionError("a search that is not stopped finds a motion")
    complain(
        f"cost of the start {first.cost:.4f}, of the motion found {found.cost:.4f} (logarithms of the gains' predicted "
        "standard deviations)"
    )
    try:
        motion, reason = best_fitted(design, series, outcome.kept)
    except TrajectoryError as error:
        if interrupt is None:
            raise
        complain(f"stopped; nothing is written: {error}")
        return ending(interrupt)
    if reason:
        complain(f"the best motion cannot be scaled to the robot's limits ({reason}); the next best is used")
    if own is not None and (options.improve or interrupt is None) and design.cost(own) < design.cost(motion):
        motion = _beside(own, motion, design, options)
    deviations = np.where(shown, design.deviations(design.rows(motion)).total, np.inf)
    wanted = found.tried if interrupt is None else options.evaluations
    with held.writing():
        comments = search_comments(command, deviations, tried=found.tried, wanted=wanted)
        write_motion(motion, options.out, comments)
    if interrupt is not None:
        complain(f"stopped; the best motion so far is in {options.out}, repeat the command to continue")
        return ending(interrupt)
    result = Searched(
        out=str(options.out),
        tried=found.tried,
        cost_of_start=first.cost,
        cost=found.cost,
        predicted_rel_std=list(map(finite, deviations)),
    )
    said = (
        f"{options.out}: predicted standard deviation of the gains, from {AGAINST[options.against]} [%]: "
        f"{percents(deviations)}"
    )
    show(Report(said, (), result.model_dump(mode="json")), options)
    return Status.PASSED


def _fill_in(options: argparse.Namespace) -> None:
    """Set default options of the protocol."""
    from scenarios.support.errors import ScenarioError

    if options.protocol == "holds":
        for name in ("harmonics", "improve"):
            if getattr(options, name):
                raise ScenarioError(
                    f"--{name} cannot be combined with --protocol holds, whose motions are not a harmonic series"
                )
    for name, value in USUAL[options.protocol].items():
        if getattr(options, name) is None:
            setattr(options, name, value)
    if options.protocol == "motion":
        check_harmonics(options)


def _searchable(problem: "Problem", options: argparse.Namespace) -> "tuple[Problem, Searchable, Mask]":
    """Return the problem of the protocol, the parametrisation of motions, and the joints that it can identify."""
    import numpy as np

    from scenarios.design.holds import Holds, hold_problem
    from scenarios.design.search import Series

    if options.protocol == "motion":
        series = Series(limits=problem.limits, harmonics=options.harmonics, duration=options.duration)
        return problem, series, np.ones(series.n, dtype=bool)
    problem, unloaded = hold_problem(problem)
    joints = ", ".join(str(j + 1) for j in unloaded.nonzero()[0])
    if joints:
        complain(
            f"gravity of the payload puts no torque on joint {joints}: holds and slow sweeps do not identify its gain"
        )
    return problem, Holds(limits=problem.limits, duration=options.duration), ~unloaded


def _problem(scenario: "Scenario", setup: "Setup", options: argparse.Namespace) -> "Problem":
    """Return the problem with the error sources of the options."""
    from scenarios.design.excitation import SEARCHED_HZ, design_problem
    from scenarios.experiments.build import setup_of
    from scenarios.prediction.sources_along import SourcesAlong

    problem = design_problem(setup)
    if options.against != "all":
        return problem
    motion = setup_of(scenario).experiments[0].trajectory
    sourced = SourcesAlong(scenario, problem.joints).reduced(motion, SEARCHED_HZ)
    complain(f"minimising the errors from noise and {', '.join(sourced.names)}")
    return replace(problem, added=sourced)


def _beside(
    own: "FourierTrajectory", found: "FourierTrajectory", design: "Design", options: argparse.Namespace
) -> "FourierTrajectory":
    """Return the motion to write if the scenario's own is better: its own if it was to be improved."""
    said = (
        "the scenario's own motion is better: the largest standard deviation of its gains is "
        f"{100.0 * design.worst(own):.3g} %, that of the motion found {100.0 * design.worst(found):.3g} %"
    )
    if options.improve:
        complain(f"{said}; no better motion was found, so it is written")
        return own
    complain(f"{said}; try more --evaluations, or --improve, which starts from it")
    return found


def found_by(options: argparse.Namespace) -> str:
    """Return the command that finds the same motion."""
    words = ["rx90", "excite", options.scenario]
    words += ["--protocol", options.protocol] if options.protocol != "motion" else []
    for name in (each for each in OPTIONS if getattr(options, each) is not None):
        words += [f"--{name}", f"{getattr(options, name):.12g}"]
    words += ["--improve"] if options.improve else []
    words += ["--against", options.against] if options.against != "noise" else []
    return printable(shlex.join(words))
