"""`rx90 excite`."""

import argparse
import sys

import scenarios.commands.arguments as arguments
from scenarios.commands.lifetime import tell
from scenarios.commands.status import Status
from scenarios.errors import ScenarioError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("scenario", metavar="SCENARIO", help="gives arm, drives, payload and wanted joints")
    add("--out", type=arguments.file, required=True, metavar="FILE", help="motion file to write, TOML")
    add("--seed", type=arguments.seed, default=0, help="seed of the search (default 0)")
    add("--harmonics", type=arguments.harmonics, default=20, help="harmonics of the series (default 20)")
    add("--duration", type=arguments.positive, default=20.0, help="period [s] (default 20)")
    add("--evaluations", type=arguments.count, default=40000, help="motions to try (default 40000)")


def main(options: argparse.Namespace) -> Status:
    """Search, write the motion, tell what it predicts."""
    import numpy as np

    from scenarios.build import bench
    from scenarios.design.excitation import Design, robot_limits, search
    from scenarios.files.motions import write_motion
    from scenarios.files.schema import load_scenario

    if not options.out.parent.is_dir():
        raise ScenarioError(f"{options.out}: no such folder as {options.out.parent}; make it first")
    prepared = bench(load_scenario(options.scenario))
    plant = prepared.experiments[0].plant
    wanted = np.flatnonzero(prepared.scenario.table.tolerance.identifiable)
    if not wanted.size:
        raise ScenarioError(f"{options.scenario}: tolerance.identifiable wants no joint's gain")
    design = Design(plant, prepared.structure, robot_limits(plant), wanted)
    motion = search(
        design,
        plant.robot.home,
        options.seed,
        harmonics=options.harmonics,
        duration=options.duration,
        evaluations=options.evaluations,
        progress=lambda text: print(f"rx90: {text}", file=sys.stderr),  # noqa: T201
    )
    found = 100.0 * design.predicted_std(motion)[0]
    command = (
        f"rx90 excite {options.scenario} --seed {options.seed} --harmonics {options.harmonics} "
        f"--duration {options.duration:g} --evaluations {options.evaluations} --out FILE"
    )
    predicted = ", ".join(f"{std:.2g}" for std in found)
    comments = [
        f"Found by: {command}",
        f"Predicted standard deviation of the gains [%], joints 1 to {len(found)}: {predicted}",
        "(for a residual of 2 % of each joint's rms torque at 20 rows a second)",
    ]
    write_motion(motion, options.out, comments)
    tell(f"{options.out}: predicted standard deviation of the gains [%]: {predicted}\n")
    return Status.PASSED
