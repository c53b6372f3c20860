"""`rx90 excite`."""

import argparse
import re
import shlex
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments
from scenarios.command_line.output import add_form_arguments, show
from scenarios.command_line.process import Status, complain, ending, printable
from scenarios.command_line.searching import searched
from scenarios.command_line.writing import right_to_write
from scenarios.experiments.workers import PROCESSES
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from ident.support.arrays import Mask
    from scenarios.design.excitation import Design
    from scenarios.design.parametrisations import Searchable, Series
    from scenarios.experiments.scenario import Setup
    from scenarios.experiments.schema import Scenario
    from sim.trajectory import FourierTrajectory

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
HARMONICS = arguments.count_from(
    2, 100, "a motion with 1 cannot begin and end at rest, a search cannot handle more than 100"
)
DURATION = arguments.number_from(5.0, 600.0, "s", "a shorter motion has too few rows, a longer one is not simulated")
EVALUATIONS = arguments.count_from(1, 10**7, "the largest number takes half a day")
FASTEST = 5.0
"""Highest harmonic [Hz] that the search samples twice per period."""
STOPPED = re.compile(r"# Stopped after (\d+) of \d+ motions")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("scenario", metavar="SCENARIO", help="gives arm, drives, payload and the joints to identify")
    said = "motion file to write, TOML; an interrupted search continues from it"
    add("--out", type=arguments.file, required=True, metavar="FILE", help=said)
    what = "; ".join(f"{name}: {words}" for name, words in PROTOCOLS.items())
    add("--protocol", choices=PROTOCOLS, default="motion", help=f"kind of motion: {what} (default motion)")
    add("--seed", type=arguments.seed, default=0, help="seed of the search (default 0)")
    add("--harmonics", type=HARMONICS, help="harmonics of the series (default 20)")
    add("--duration", type=DURATION, help="period [s] (default 20)")
    add("--evaluations", type=EVALUATIONS, help="number of motions to try (default 40000)")
    add("--jobs", type=PROCESSES.checked, metavar=PROCESSES.metavar, help=PROCESSES.help)
    add("--improve", action="store_true", help="start from the scenario's own motion, and never write a worse one")
    what = "; ".join(f"{name}: {words}" for name, words in AGAINST.items())
    add("--against", choices=AGAINST, default="noise", help=f"errors to minimise: {what} (default noise)")
    arguments.add_force_argument(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Search, write the motion, report the predicted accuracy; write the best motion so far of a stopped search."""
    held = right_to_write(options, options.out.parent, [options.out.name], command="rx90 excite")
    _fill_in(options)
    import numpy as np

    from scenarios.design.excitation import finite, percents
    from scenarios.design.parametrisations import Series
    from scenarios.design.search import Searched, best_fitted
    from scenarios.experiments.motions import write_motion
    from scenarios.experiments.scenario import load_scenario, setup_without_motion
    from scenarios.prediction.deviations import RESIDUAL, ROWS_PER_SECOND
    from sim.errors import TrajectoryError

    command = found_by(options)
    before = unfinished(options.out, command)
    scenario = load_scenario(options.scenario)
    setup = setup_without_motion(scenario)
    design, series, shown = _searchable(_design(scenario, setup, options), options)
    if options.improve and before is None and isinstance(series, Series):
        before = first_motion(setup.scenario, series), 0
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
        motion = best_fitted(design, series, outcome.kept)
    except TrajectoryError as error:
        if interrupt is None:
            raise
        complain(f"stopped; nothing is written: {error}")
        return ending(interrupt)
    if own is not None and (options.improve or interrupt is None) and design.cost(own) < design.cost(motion):
        motion = _beside(own, motion, design, improve=options.improve)
    deviations = np.where(shown, design.deviations(motion), np.inf)
    stopped = f"Stopped after {found.tried} of {options.evaluations} motions; repeat the command to continue."
    comments = [
        f"Found by: {command} --out FILE",
        *[stopped] * (interrupt is not None and found.tried < options.evaluations),
        f"Predicted standard deviation of the gains [%], joints 1 to {len(deviations)}: {percents(deviations)}",
        f"(for a residual of {100.0 * RESIDUAL:g} % of each joint's rms torque at {ROWS_PER_SECOND:g} rows per second)",
    ]
    with held.writing():
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
    show(result.report(said), options)
    return Status.PASSED


def _fill_in(options: argparse.Namespace) -> None:
    """Set default options of the protocol, and check that the sampling rate of the search is sufficient."""
    holds = options.protocol == "holds"
    for name in ("harmonics", "improve") if holds else ():
        if getattr(options, name):
            raise ScenarioError(
                f"--{name} cannot be combined with --protocol holds, whose motions are not a harmonic series"
            )
    for name, value in USUAL[options.protocol].items():
        if getattr(options, name) is None:
            setattr(options, name, value)
    if not holds and options.harmonics > FASTEST * options.duration:
        raise ScenarioError(
            f"--harmonics {options.harmonics} in --duration {options.duration:g}: the highest harmonic is at "
            f"{options.harmonics / options.duration:.3g} Hz; the search resolves up to {FASTEST:g} Hz"
        )


def _searchable(design: "Design", options: argparse.Namespace) -> "tuple[Design, Searchable, Mask]":
    """Return the problem of the protocol, the parametrisation of motions, and the joints that it can identify."""
    import numpy as np

    from scenarios.design.parametrisations import Holds, Series, hold_design

    if options.protocol == "motion":
        series = Series(limits=design.limits, harmonics=options.harmonics, duration=options.duration)
        return design, series, np.ones(series.n, dtype=bool)
    design, unloaded = hold_design(design)
    joints = ", ".join(str(j + 1) for j in unloaded.nonzero()[0])
    if joints:
        complain(
            f"gravity of the payload puts no torque on joint {joints}: holds and slow sweeps do not identify its gain"
        )
    return design, Holds(limits=design.limits, duration=options.duration), ~unloaded


def _design(scenario: "Scenario", setup: "Setup", options: argparse.Namespace) -> "Design":
    """Return the problem with the error sources of the options."""
    from scenarios.design.excitation import SEARCHED_HZ, Design
    from scenarios.experiments.scenario import setup_of
    from scenarios.prediction.sources_along import SourcesAlong

    design = Design.of(setup)
    if options.against != "all":
        return design
    motion = setup_of(scenario).experiments[0].trajectory
    sourced = SourcesAlong(scenario, design.joints).reduced(motion, SEARCHED_HZ)
    complain(f"minimising the errors from noise and {', '.join(sourced.points)}")
    return replace(design, added=sourced)


def own_motion(scenario: "Scenario", design: "Design") -> "FourierTrajectory | None":
    """Return the motion of a scenario; None if there is none that this robot can carry out."""
    from scenarios.experiments.motions import read_motion

    try:
        motion = read_motion(scenario.table.experiment.motion, scenario.folder)
    except ScenarioError:
        return None
    return motion if motion.n == design.plant.robot.n and design.keeps_limits(motion) else None


def first_motion(scenario: "Scenario", series: "Series") -> "FourierTrajectory":
    """Return the motion of a scenario as the start of a search.

    Raises:
        ScenarioError: If the parametrisation cannot represent the motion; if there is none.
    """
    from scenarios.experiments.motions import read_motion

    motion = read_motion(scenario.table.experiment.motion, scenario.folder)
    n, harmonics = motion.sine.shape
    if n != series.n or harmonics > series.harmonics or motion.duration != series.duration:
        raise ScenarioError(
            f"{scenario.name}: motion {scenario.table.experiment.motion!r} has {harmonics} harmonics of {n} joints in "
            f"{motion.duration:g} s; to improve it, search with --duration {motion.duration:g} and --harmonics "
            f"{harmonics} or more, on an arm of {n} joints"
        )
    return motion


def _beside(
    own: "FourierTrajectory", found: "FourierTrajectory", design: "Design", *, improve: bool
) -> "FourierTrajectory":
    """Return the motion to write if the scenario's own is better: its own if it was to be improved."""
    said = (
        "the scenario's own motion is better: the largest standard deviation of its gains is "
        f"{100.0 * design.worst(own):.3g} %, that of the motion found {100.0 * design.worst(found):.3g} %"
    )
    if improve:
        complain(f"{said}; no better motion was found, so it is written")
        return own
    complain(f"{said}; try more --evaluations, or --improve, which starts from it")
    return found


def found_by(options: argparse.Namespace) -> str:
    """Return the command that finds the same motion."""
    words = ["rx90", "excite", options.scenario]
    words += ["--protocol", options.protocol] if options.protocol != "motion" else []
    for name in ("seed", "harmonics", "duration", "evaluations"):
        if getattr(options, name) is not None:
            words += [f"--{name}", f"{getattr(options, name):.12g}"]
    words += ["--improve"] if options.improve else []
    words += ["--against", options.against] if options.against != "noise" else []
    return printable(shlex.join(words))


def unfinished(path: Path, command: str) -> "tuple[FourierTrajectory, int] | None":
    """Return the best motion of a stopped search, and its number of motions, if a file has one of this command.

    Raises:
        ScenarioError: If the file is not a motion.
    """
    from scenarios.experiments.motions import read_motion

    if not path.is_file():
        return None
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    stopped = next((match for match in map(STOPPED.match, lines) if match), None)
    if stopped is None or f"# Found by: {command} --out FILE" not in lines:
        return None
    return read_motion(path.name, path.parent), int(stopped[1])
