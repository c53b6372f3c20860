"""`rx90 new-robot`."""

import argparse
from functools import partial
from typing import TYPE_CHECKING

import scenarios.commands.arguments as arguments
from scenarios.commands.output import add_form_arguments, show
from scenarios.commands.searching import searched
from scenarios.commands.status import Status
from scenarios.workers.processes import PROCESSES

if TYPE_CHECKING:
    from scenarios.design.excitation import Design
    from scenarios.design.search import Found, Series

EVALUATIONS = arguments.count_from(1, 10**6, "that takes an hour")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("model", metavar="MODEL", type=arguments.file, help="MJCF or URDF file of the arm")
    add("--out", type=arguments.folder, required=True, metavar="DIR", help="folder for robot, scenario and motion")
    add("--flange", metavar="BODY", help="last body of the arm, where the file has more; joints beyond are held")
    add("--name", help="of the robot (default: that of the model)")
    add("--seed", type=arguments.seed, default=0, help="seed of the search for a motion (default 0)")
    add("--evaluations", type=EVALUATIONS, default=400, help="motions to try (default 400)")
    add("--jobs", type=PROCESSES.checked, metavar=PROCESSES.metavar, help=PROCESSES.help)
    arguments.add_force_argument(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Write robot and scenario by rules of thumb, find a motion, tell what is assumed."""
    PROCESSES.prepare()
    from scenarios.commands.writing import right_to_write
    from scenarios.design.new_robot import described, moved
    from scenarios.files.motions import write_motion
    from scenarios.reports.new_robot import new_robot_report
    from scenarios.store.new_robot import FILES, MOTION, SCENARIO, scenario_text, write_robot

    held = right_to_write(options, options.out, FILES, command="rx90 new-robot")
    new = described(options.model, options.out, flange=options.flange, name=options.name)
    with held.writing():
        robot = write_robot(new, held.folder)
        found = moved(new, robot, partial(_searched, options))
        comments = ["Found by rx90 new-robot, within the limits of robot.toml; rx90 excite finds a better one"]
        write_motion(found.motion, held.folder / MOTION, comments)
        (held.folder / SCENARIO).write_text(scenario_text(new, found), encoding="utf-8")
    show(new_robot_report(new, found, held.folder), options)
    return Status.PASSED


def _searched(options: argparse.Namespace, design: "Design", series: "Series", attempt: int) -> "tuple[Found, ...]":
    """Better and better motions that a search with another seed each time finds.

    Raises:
        KeyboardInterrupt: If it is stopped.
    """
    chosen = argparse.Namespace(
        seed=options.seed + attempt, evaluations=options.evaluations, jobs=options.jobs, quiet=options.quiet
    )
    outcome = searched(design, series, chosen, None)
    if outcome.interrupt is not None or not outcome.kept:
        raise outcome.interrupt or AssertionError("a search that is not stopped finds a motion")
    return outcome.kept
