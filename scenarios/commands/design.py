"""Commands that design an experiment: `rx90 new-robot` from a model file, `excite` a motion, `payload` a payload."""

import argparse
import shlex
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from ident.support.naming import one_line
from scenarios.command_line import arguments, output
from scenarios.command_line.process import Status, complain, ending
from scenarios.experiments.workers import add_worker_options, open_workers
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from scenarios.design.excitation import Design
    from scenarios.design.search import Found, Judge, Series
    from scenarios.experiments.schema import Scenario
    from sim.trajectory import FourierTrajectory

FEW = 1000
"""Number of motions below which starting processes takes longer than the search."""
FASTEST = 5.0
"""Highest harmonic [Hz] that the search samples twice per period."""
PROTOCOLS = {
    "motion": "joints move together, up to their limits",
    "holds": "slow sweeps between poses that are held; --duration 72 and --evaluations 3000 unless given",
}
USUAL = {
    "motion": {"harmonics": 20, "duration": 20.0, "evaluations": 40000},
    "holds": {"duration": 72.0, "evaluations": 3000},
}
"""Defaults of a search."""
HARMONICS = arguments.count_from(
    2, 100, "a motion with 1 cannot begin and end at rest, a search cannot handle more than 100"
)
DURATION = arguments.number_from(5.0, 600.0, "s", "a shorter motion has too few rows, a longer one is not simulated")
EVALUATIONS = arguments.count_from(1, 10**7, "the largest number takes half a day")
TORQUE = arguments.number_from(1e-3, 1e6, "N m or N", "check the unit")
MASS = arguments.number_from(1e-3, 2000.0, "kg", "check the unit")
"""As `LIGHTEST` and `HEAVIEST` of `ident.payload.payload`."""
USUAL_EVALUATIONS = 400
"""Motions to try for a new robot."""
STEEL = 7850.0
DENSITY = arguments.number_from(500.0, 23000.0, "kg/m^3", "wood to tungsten")
NOMINAL = "Nominal values of a designed {shape}: weigh the finished payload and enter its mass."


def searched(
    design: "Design", series: "Series", options: argparse.Namespace, own: "FourierTrajectory | None" = None
) -> "tuple[list[Found], KeyboardInterrupt | None]":
    """Search with the given options from random motions, or from an `own` one, with progress on stderr.

    Returns the states of the search, the best motion last, and what stopped it.
    """
    import numpy as np

    from scenarios.design.search import SMALL_STEP, STEP, Found, random_point, search, starts

    kept, stopped = list[Found](), None
    try:
        with _judge(design, series, options) as judge:
            if own is None:
                at = starts(design, design.plant.robot.home, np.random.default_rng(options.seed))
                first, step = random_point(series, at, options.seed, judge), STEP
            else:
                x = series.point(own)
                first, step = Found(x=x, cost=judge([x])[0], tried=0), SMALL_STEP
            with output.under_way(options, "motions", options.evaluations) as progress:
                for found in search(first, step, options.seed, options.evaluations, judge):
                    kept.append(found)
                    progress.reach(
                        found.tried,
                        lambda x=found.x: f"{100.0 * design.worst(series.motion(x)):.3g} % on the worst joint",
                    )
    except KeyboardInterrupt as interrupt:
        stopped = interrupt
    return kept, stopped


@contextmanager
def _judge(design: "Design", series: "Series", options: argparse.Namespace) -> "Generator[Judge]":
    """Return the evaluation of motions, in this process if they are few, otherwise in others."""
    from scenarios.design.search import judge_in

    if options.jobs == 1 or options.evaluations < FEW:
        yield lambda points: [design.cost(series.motion(x)) for x in points]
        return
    with open_workers(options) as workers:
        pool = workers.open()
        try:
            yield judge_in(pool, workers.count(), design, series)
        finally:
            workers.close(pool)


def excite_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare scenario, written file, and kind and size of the search."""
    add = parser.add_argument
    add("scenario", metavar="SCENARIO", help="gives arm, drives, payload and the joints to identify")
    add("--out", type=arguments.file, required=True, metavar="FILE", help="motion file to write, TOML")
    what = "; ".join(f"{name}: {words}" for name, words in PROTOCOLS.items())
    add("--protocol", choices=PROTOCOLS, default="motion", help=f"kind of motion: {what} (default motion)")
    add("--seed", type=arguments.seed, default=0, help="seed of the search (default 0)")
    add("--harmonics", type=HARMONICS, help="harmonics of the series (default 20)")
    add("--duration", type=DURATION, help="period [s] (default 20)")
    add("--evaluations", type=EVALUATIONS, help="number of motions to try (default 40000)")
    add_worker_options(parser, dask=False)
    add("--improve", action="store_true", help="start from the scenario's own motion, and never write a worse one")
    output.add_force_argument(parser)


def excite_command(options: argparse.Namespace) -> Status:
    """Search, write the motion, report the predicted accuracy; write the best motion so far of a stopped search."""
    claim = output.right_to_write(options, options.out, command="rx90 excite")
    holds = options.protocol == "holds"
    if holds and vars(options)["harmonics"] is not None:
        raise ScenarioError(
            "--harmonics cannot be combined with --protocol holds, whose motions are not a harmonic series"
        )
    for name, value in USUAL[options.protocol].items():
        if getattr(options, name) is None:
            setattr(options, name, value)
    if not holds and options.harmonics > FASTEST * options.duration:
        raise ScenarioError(
            f"--harmonics {options.harmonics} in --duration {options.duration:g}: the highest harmonic is at "
            f"{options.harmonics / options.duration:.3g} Hz; the search resolves up to {FASTEST:g} Hz"
        )
    import numpy as np

    from scenarios.design.excitation import Design, finite, percents
    from scenarios.design.search import Searched, Series, best_fitted, hold_design
    from scenarios.experiments.motions import write_motion
    from scenarios.experiments.scenario import load_scenario, setup_without_motion
    from scenarios.prediction.deviations import RESIDUAL, ROWS_PER_SECOND
    from sim.errors import TrajectoryError

    scenario = load_scenario(options.scenario)
    design = Design.of(setup_without_motion(scenario))
    unloaded = np.zeros(design.plant.robot.n, dtype=bool)
    if holds:
        design, unloaded = hold_design(design)
        series = Series.holds(design.limits, options.duration)
        if joints := ", ".join(str(j + 1) for j in unloaded.nonzero()[0]):
            torque = f"gravity of the payload puts no torque on joint {joints}"
            complain(f"{torque}: holds and slow sweeps do not identify its gain")
    else:
        series = Series.harmonic(design.limits, options.harmonics, options.duration)
    own = _own_motion(scenario, series) if options.improve else None
    kept, interrupt = searched(design, series, options, own)
    if interrupt is not None and not kept:
        raise interrupt
    try:
        motion = best_fitted(design, series, kept)
    except TrajectoryError as error:
        if interrupt is None:
            raise
        complain(f"stopped; nothing is written: {error}")
        return ending(interrupt)
    if own is not None and design.keeps_limits(own) and design.cost(own) < design.cost(motion):
        complain(
            f"the largest standard deviation of a gain is {100.0 * design.worst(own):.3g} % by the scenario's own "
            f"motion, {100.0 * design.worst(motion):.3g} % by that found, so the scenario's own motion is written"
        )
        motion = own
    deviations = np.where(unloaded, np.inf, design.deviations(motion))
    comments = [
        f"Found by: {found_by(options)} --out FILE",
        *[f"Stopped after {kept[-1].tried} of {options.evaluations} motions."] * (interrupt is not None),
        f"Predicted standard deviation of the gains [%], joints 1 to {len(deviations)}: {percents(deviations)}",
        f"(for a residual of {100.0 * RESIDUAL:g} % of each joint's rms torque at {ROWS_PER_SECOND:g} rows per second)",
    ]
    with claim.writing():
        write_motion(motion, options.out, comments)
    result = Searched(
        out=str(options.out),
        tried=kept[-1].tried,
        cost_of_start=kept[0].cost,
        cost=kept[-1].cost,
        predicted_rel_std=list(map(finite, deviations)),
        worst_of_start=finite(design.worst(series.motion(kept[0].x))),
        worst=finite(design.worst(motion)),
    )
    if interrupt is not None:
        complain(
            f"stopped; the best motion so far is in {options.out}; to continue, state it as the scenario's "
            "experiment.motion and add --improve"
        )
        return ending(interrupt)
    return output.show(result.report(f"Motion found for {scenario.name}, in {options.out}"), options)


def _own_motion(scenario: "Scenario", series: "Series") -> "FourierTrajectory":
    """Return the motion of a scenario; raises `ScenarioError` if there is none that the search can start from."""
    from scenarios.experiments.motions import read_motion

    name = scenario.table.experiment.motion
    motion = read_motion(name, scenario.folder)
    n, harmonics = motion.sine.shape
    if n != series.n or harmonics > series.harmonics or motion.duration != series.duration:
        raise ScenarioError(
            f"{scenario.name}: motion {name!r} has {harmonics} harmonics of {n} joints in {motion.duration:g} s; to "
            f"improve it, search with --duration {motion.duration:g} and --harmonics {harmonics} or more, on an arm of "
            f"{n} joints"
        )
    return motion


def found_by(options: argparse.Namespace) -> str:
    """Return the command that finds the same motion."""
    words = ["rx90", "excite", options.scenario]
    words += ["--protocol", options.protocol] if options.protocol != "motion" else []
    for name in ("seed", "harmonics", "duration", "evaluations"):
        if getattr(options, name) is not None:
            words += [f"--{name}", f"{getattr(options, name):.12g}"]
    words += ["--improve"] if options.improve else []
    return one_line(shlex.join(words))


def payload_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare scenario, material and written file."""
    add = parser.add_argument
    text = "a built-in name or TOML file: gives arm, drives, motion and what is known of the payload"
    add("scenario", metavar="SCENARIO", help=text)
    add("--out", type=arguments.file, metavar="FILE", help="payload file to write, TOML")
    text = "density of the material [kg/m^3] (default 7850, steel)"
    add("--density", type=DENSITY, default=STEEL, metavar="D", help=text)
    add("--seed", type=arguments.seed, default=0, help="seed of the search (default 0)")
    output.add_force_argument(parser)


def payload_command(options: argparse.Namespace) -> Status:
    """Search for the best payload of each shape, report, write its file; status 1 if a joint is not identifiable."""
    claim = output.may_write(options, options.out, command="rx90 payload")
    from ident.payload.payload import payload_from_table, write_payload
    from scenarios.design.payload_design import STEPS, design_payload
    from scenarios.experiments.scenario import load_scenario, setup_of

    setup = setup_of(load_scenario(options.scenario))
    with output.under_way(options, "weights", STEPS) as progress:
        design = design_payload(setup, density=options.density, seed=options.seed, tell=progress.reach)
    if claim is not None:
        comment = f"# {NOMINAL.format(shape=design.after.shape)}"
        with claim.writing():
            write_payload(payload_from_table(design.after.payload), claim.folder / claim.names[0], comment=comment)
    report = design.report(f"Payload for scenario {design.scenario}")
    return output.show(report, options, passed=all(each.shown for each in design.after.joints))


def new_robot_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare model, written folder, and what the model does not state."""
    add = parser.add_argument
    add("model", metavar="MODEL", type=arguments.file, help="MJCF or URDF file of the arm")
    add("--out", type=arguments.folder, required=True, metavar="DIR", help="folder for robot, scenario and motion")
    add("--flange", metavar="BODY", help="last body of the arm, if the file has more; joints beyond it are locked")
    what = "largest torque of each joint [N m, N] (default: from the file, or by a rule of thumb)"
    add("--torque", type=TORQUE, nargs="+", metavar="T", help=what)
    add("--rated-load", type=MASS, metavar="KG", help="rated load of the arm, an upper limit for the payload")
    what = "what is mounted: payload file, or mass [kg] of a steel bar (default: a bar that the arm can carry)"
    add("--payload", type=_file_or_mass, metavar="FILE|KG", help=what)
    what = "start pose [rad, m], one number per joint (default: from the file, or a pose clear of floor and arm)"
    add("--home", type=arguments.number, nargs="+", metavar="Q", help=what)
    add("--seed", type=arguments.seed, default=0, help="seed of the search for a motion (default 0)")
    text = "motions to try (default %(default)d)"
    add("--evaluations", type=EVALUATIONS, default=USUAL_EVALUATIONS, help=text)
    add_worker_options(parser, dask=False)
    output.add_force_argument(parser)


def _file_or_mass(text: str) -> Path | float:
    try:
        arguments.number(text)
    except argparse.ArgumentTypeError:
        return arguments.file(text)
    return MASS(text)


def new_robot_command(options: argparse.Namespace) -> Status:
    """Write robot and scenario with rules of thumb, search for a motion, report assumed values."""
    from scenarios.design.new_robot import new_robot
    from scenarios.design.robot_folder import FILES, found_motion, write_new_robot

    claim = output.right_to_write(options, options.out, FILES, command="rx90 new-robot")
    stated = {name: getattr(options, name) for name in ("flange", "home", "torque", "rated_load", "payload")}
    new = new_robot(options.model, **stated)

    def search(design: "Design", series: "Series", attempt: int) -> "Sequence[Found]":
        seeded = argparse.Namespace(**{**vars(options), "seed": options.seed + attempt})
        kept, interrupt = searched(design, series, seeded)
        if interrupt is not None:
            raise interrupt
        return kept

    advice = (
        f"try more motions (--evaluations {max(USUAL_EVALUATIONS, 4 * options.evaluations)}), other motions (--seed), "
        "another pose (--home) or a lighter payload (--payload)"
    )
    motion, result = found_motion(new, claim.folder, search, advice=advice)
    with claim.writing():
        write_new_robot(new, motion, result.predicted_rel_std, claim.folder)
    return output.show(result.report(f"Robot {result.robot}: {len(result.joints)} joints"), options)
