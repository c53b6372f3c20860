"""`rx90 new-robot`."""

import argparse
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments
from ident.payload.payload import HEAVIEST, LIGHTEST
from scenarios.command_line.output import add_form_arguments, show
from scenarios.command_line.process import Status
from scenarios.command_line.searching import searched
from scenarios.experiments.workers import PROCESSES

if TYPE_CHECKING:
    from scenarios.design.excitation import Design
    from scenarios.design.parametrisations import Series
    from scenarios.design.search import Found

TORQUE = arguments.number_from(1e-3, 1e6, "N m or N", "check the unit")
MASS = arguments.number_from(LIGHTEST, HEAVIEST, "kg", "check the unit")
EVALUATIONS = arguments.count_from(1, 10**6, "the largest number takes an hour")
USUAL = 400
"""Default number of motions to try."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("model", metavar="MODEL", type=arguments.file, help="MJCF or URDF file of the arm")
    add("--out", type=arguments.folder, required=True, metavar="DIR", help="folder for robot, scenario and motion")
    add("--flange", metavar="BODY", help="last body of the arm, if the file has more; joints beyond it are locked")
    add("--name", help="name of the robot (default: that of the model)")
    what = "largest torque of each joint [N m, N] (default: from the file, or by a rule of thumb)"
    add("--torque", type=TORQUE, nargs="+", metavar="T", help=what)
    add(
        "--rated-load",
        type=MASS,
        metavar="KG",
        help="rated load of the arm, an upper limit for the payload",
    )
    what = "what is mounted: payload file, or mass [kg] of a steel bar (default: a bar that the arm can carry)"
    add("--payload", type=_payload, metavar="FILE|KG", help=what)
    what = "start pose [rad, m], one number per joint (default: from the file, or a pose clear of floor and arm)"
    add("--home", type=arguments.number, nargs="+", metavar="Q", help=what)
    add("--seed", type=arguments.seed, default=0, help="seed of the search for a motion (default 0)")
    add("--evaluations", type=EVALUATIONS, default=USUAL, help="motions to try (default %(default)d)")
    add("--jobs", type=PROCESSES.checked, metavar=PROCESSES.metavar, help=PROCESSES.help)
    arguments.add_force_argument(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Write robot and scenario with rules of thumb, search for a motion, report assumed values."""
    from scenarios.command_line.writing import right_to_write
    from scenarios.design.new_robot import new_robot
    from scenarios.design.robot_folder import FILES, check_no_other_robot, found_motion, write_new_robot

    held = right_to_write(options, options.out, FILES, command="rx90 new-robot")
    if not options.force:
        check_no_other_robot(options.out, options.model)
    new = new_robot(
        options.model,
        flange=options.flange,
        name=options.name,
        home=options.home,
        torque=options.torque,
        rated_load=options.rated_load,
        payload=options.payload,
    )
    more = max(USUAL, 4 * options.evaluations)
    advice = (
        f"try more motions (--evaluations {more}), other motions (--seed), another pose (--home) or a lighter payload "
        "(--payload)"
    )
    motion, result = found_motion(new, held.folder, partial(_searched, options), advice=advice)
    with held.writing():
        write_new_robot(new, motion, result.predicted_rel_std, held.folder)
    show(result.report(f"Robot {result.robot}: {len(result.joints)} joints"), options)
    return Status.PASSED


def _payload(text: str) -> Path | float:
    """Return a mass or a file."""
    try:
        arguments.number(text)
    except argparse.ArgumentTypeError:
        return arguments.file(text)
    return MASS(text)


def _searched(options: argparse.Namespace, design: "Design", series: "Series") -> "list[Found]":
    """Return successively better motions of a search."""
    outcome = searched(design, series, options)
    if outcome.interrupt is not None:
        raise outcome.interrupt
    return outcome.kept
