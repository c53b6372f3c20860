"""Arguments for the model of a robot."""

import argparse
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments

if TYPE_CHECKING:
    from ident.model.structure import Structure


def add_model_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the robot's model."""
    parser.add_argument("--model", type=arguments.file, required=True, metavar="ROBOT", help="MJCF or URDF file")
    add_reading_arguments(parser)


def add_reading_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare properties of the arm that a model file does not state."""
    add = parser.add_argument
    add("--flange", metavar="BODY", help="last body of the arm, if the file has more; joints beyond it are locked")
    said = "motor J turns by the sum of joints I and J, e.g. 5 6 on Staubli wrists"
    add("--coupling", type=arguments.count, nargs=2, action="append", default=[], metavar=("I", "J"), help=said)


def named_structure(options: argparse.Namespace) -> "Structure":
    """Return the structure of the arm of the command line.

    Raises:
        RobotModelError: If the file is not an arm.
    """
    from ident.model.structure import structure_of
    from scenarios.experiments.robot_models import read_arm

    couplings = tuple((i - 1, j - 1) for i, j in options.coupling)
    return structure_of(read_arm(options.model, couplings, flange=options.flange))
