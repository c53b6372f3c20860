"""`rx90 payload-of`."""

import argparse

import scenarios.command_line.arguments as arguments
from scenarios.command_line.gains import add_gains_argument, add_overlay_arguments, weigh
from scenarios.command_line.logs import add_log_arguments, add_model_arguments
from scenarios.command_line.output import add_form_arguments, show, under_way
from scenarios.command_line.process import Status


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
    """Read, estimate the payload, report."""
    from ident.parameters.weighing import joint_agreement
    from scenarios.experiments.gains_file import read_gains
    from scenarios.gains_in_use.weighing import FoundPayload

    file = read_gains(options.gains)
    with under_way(options, "weighing"):
        found, diagnosed, _ = weigh(options, file, options.unloaded, options.logs)
        found.body.check_mass()
        joints = joint_agreement(found, found.body, file.known)
    show(FoundPayload.of(found, joints, diagnosed).report("Payload estimated from currents"), options)
    return Status.PASSED
