"""`rx90 new-robot`."""

import argparse
from typing import TYPE_CHECKING

import scenarios.commands.arguments as arguments
from scenarios.commands.output import add_form_arguments, show
from scenarios.commands.parser import complain
from scenarios.commands.status import Status

if TYPE_CHECKING:
    pass

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
    arguments.add_force_argument(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Write robot and scenario by rules of thumb, find a motion, tell what is assumed."""
    from scenarios.design.new_robot import described, moved
    from scenarios.files.motions import write_motion
    from scenarios.reports.new_robot import new_robot_report
    from scenarios.store.claim import claim
    from scenarios.store.new_robot import FILES, MOTION, SCENARIO, scenario_text, write_robot

    held = claim(options.out, FILES, command="rx90 new-robot", force=options.force)
    new = described(options.model, options.out, flange=options.flange, name=options.name)
    with held.writing():
        robot = write_robot(new, held.folder)
        found = moved(new, robot, seed=options.seed, evaluations=options.evaluations, progress=complain)
        comments = ["Found by rx90 new-robot, within the limits of robot.toml; rx90 excite finds a better one"]
        write_motion(found.motion, held.folder / MOTION, comments)
        (held.folder / SCENARIO).write_text(scenario_text(new, found), encoding="utf-8")
    show(new_robot_report(new, found, held.folder), options)
    return Status.PASSED
