"""Arguments for the model of a robot."""

import argparse
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments

if TYPE_CHECKING:
    from scenarios.experiments.named_robots import NamedRobot


def add_model_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the robot's model."""
    said = "MJCF or URDF file, robot.toml, or the name of a built-in robot"
    parser.add_argument("--model", required=True, metavar="ROBOT", help=said)
    add_reading_arguments(parser)


def add_reading_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare properties of the arm that a model file does not state."""
    add = parser.add_argument
    add("--flange", metavar="BODY", help="last body of the arm, if the file has more; joints beyond it are locked")
    said = "motor J turns by the sum of joints I and J, e.g. 5 6 on Staubli wrists"
    add("--coupling", type=arguments.count, nargs=2, action="append", default=[], metavar=("I", "J"), help=said)


def robot_of(options: argparse.Namespace, word: str) -> "NamedRobot":
    """Return the robot of the command line, read as its arguments say; raises as `named_robot`."""
    from scenarios.experiments.named_robots import named_robot

    couplings = tuple((i - 1, j - 1) for i, j in options.coupling)
    return named_robot(word, couplings, flange=options.flange)
