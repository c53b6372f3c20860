"""`rx90 excite`."""

import argparse
import shlex

import scenarios.commands.arguments as arguments
from scenarios.commands.lifetime import tell
from scenarios.commands.parser import complain, printable
from scenarios.commands.status import Status
from scenarios.errors import MotionTooFine, NoJointWanted
from scenarios.store.claim import claim

FASTEST = 5.0
"""Fastest harmonic [Hz] that the search samples twice a period."""
HARMONICS = arguments.count_from(2, 100, "2 to be at rest at both ends, at most what a search can handle")
DURATION = arguments.number_from(5.0, 600.0, "s", "shorter motions hold too few rows, longer ones are not simulated")
AGAINST = {"noise": "of the currents", "all": "noise and the scenario's error sources"}
EVALUATIONS = arguments.count_from(1, 10**7, "that takes half a day")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("scenario", metavar="SCENARIO", help="gives arm, drives, payload and wanted joints")
    add("--out", type=arguments.file, required=True, metavar="FILE", help="motion file to write, TOML")
    add("--seed", type=arguments.seed, default=0, help="seed of the search (default 0)")
    add("--harmonics", type=HARMONICS, default=20, help="harmonics of the series (default 20)")
    add("--duration", type=DURATION, default=20.0, help="period [s] (default 20)")
    add("--evaluations", type=EVALUATIONS, default=40000, help="motions to try (default 40000)")
    what = "; ".join(f"{name}: {words}" for name, words in AGAINST.items())
    add("--against", choices=AGAINST, default="noise", help=f"errors to make small: {what} (default noise)")
    arguments.add_force_argument(parser)


def main(options: argparse.Namespace) -> Status:
    """Search, write the motion, tell what it predicts."""
    held = claim(options.out.parent, [options.out.name], command="rx90 excite", force=options.force)
    if options.harmonics > FASTEST * options.duration:
        raise MotionTooFine(
            f"--harmonics {options.harmonics} in --duration {options.duration:g}: the fastest has "
            f"{options.harmonics / options.duration:.3g} Hz; a search sees up to {FASTEST:g} Hz"
        )
    import numpy as np

    from scenarios.build import bench, cell
    from scenarios.design.against import Sourced, nothing_added
    from scenarios.design.excitation import Design, robot_limits, search
    from scenarios.files.loading import load_scenario
    from scenarios.files.motions import write_motion

    scenario = load_scenario(options.scenario)
    prepared = cell(scenario)  # whose motion may be the one that is to be found
    plant = prepared.plant
    wanted = np.flatnonzero(prepared.scenario.table.tolerance.identifiable)
    if not wanted.size:
        raise NoJointWanted(f"{options.scenario}: tolerance.identifiable wants no joint's gain")
    added = nothing_added
    if options.against == "all":
        added = Sourced(scenario, wanted).reduced(bench(scenario).experiments[0].trajectory, 10.0)
        complain(f"searching against noise and {', '.join(added.names)}")
    design = Design(plant, prepared.structure, robot_limits(plant), wanted, added)
    motion = search(
        design,
        plant.robot.home,
        options.seed,
        harmonics=options.harmonics,
        duration=options.duration,
        evaluations=options.evaluations,
        progress=complain,
    )
    found = 100.0 * design.predicted_std(motion)[0]
    words = ["rx90", "excite", options.scenario]
    for name in ("seed", "harmonics", "duration", "evaluations"):
        words += [f"--{name}", f"{getattr(options, name):.12g}"]
    words += ["--against", options.against] if options.against != "noise" else []
    predicted = ", ".join(f"{std:.2g}" for std in found)
    comments = [
        f"Found by: {printable(shlex.join(words))} --out FILE",
        f"Predicted standard deviation of the gains [%], joints 1 to {len(found)}: {predicted}",
        "(for a residual of 2 % of each joint's rms torque at 20 rows a second)",
    ]
    with held.writing():
        write_motion(motion, options.out, comments)
    tell(f"{options.out}: predicted standard deviation of the gains [%]: {predicted}\n")
    return Status.PASSED
