"""`rx90 payload-of`."""

import argparse

import scenarios.commands.arguments as arguments
from scenarios.commands.log_arguments import add_log_arguments
from scenarios.commands.output import add_form_arguments, show
from scenarios.commands.progress import under_way
from scenarios.commands.robot_model import add_model_arguments
from scenarios.commands.status import Status
from scenarios.commands.weighing import add_gains_argument, add_overlay_arguments, weigh


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("logs", type=arguments.file, nargs="+", metavar="LOG", help="recordings with the unknown payload")
    add("--unloaded", type=arguments.file, nargs="+", required=True, metavar="A", help="recordings with a bare flange")
    add_gains_argument(parser, needed=True, said="drive gains, as identify --gains-out writes them")
    add_model_arguments(parser)
    add_log_arguments(parser)
    add_overlay_arguments(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Read, find the payload, tell."""
    from ident.weighing.accord import accord, check_mass
    from ident.weighing.body import body_of
    from scenarios.files.gains import read_gains
    from scenarios.reports.payload_of import payload_report

    file = read_gains(options.gains)
    with under_way(options, "weighing"):
        found, diagnosed = weigh(options, file, options.unloaded, options.logs)
        body = body_of(found)
        check_mass(body)
        joints = accord(found, body, file.known)
    show(payload_report(found, body, joints, diagnosed), options)
    return Status.PASSED
