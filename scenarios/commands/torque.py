"""`rx90 torque`."""

import argparse

import scenarios.command_line.arguments as arguments
from scenarios.command_line.arguments import add_force_argument
from scenarios.command_line.gains import add_gains_argument
from scenarios.command_line.logs import add_log_arguments, log_description, told
from scenarios.command_line.output import add_form_arguments, show
from scenarios.command_line.process import Status
from scenarios.command_line.writing import right_to_write


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("log", type=arguments.file, metavar="LOG", help="a recording")
    add_gains_argument(parser, needed=True, said="drive gains, as identify --gains-out writes them")
    said = "Parquet file: t, and for each joint tau with the limits tau_low, tau_high (two standard deviations)"
    parser.add_argument("--out", type=arguments.file, required=True, metavar="FILE", help=said)
    add_log_arguments(parser)
    add_force_argument(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Read, compute torques, write."""
    held = right_to_write(options, options.out.parent, [options.out.name], command="rx90 torque")
    from ident.estimation.joint_torque import joint_torque
    from ident.recordings.files import read_log
    from ident.support.naming import one_line
    from scenarios.experiments.gains_file import read_gains
    from scenarios.gains_in_use.known_gains_problem import check_currents
    from scenarios.gains_in_use.torques import Torques
    from scenarios.rendering.content import joints_named
    from scenarios.results.torque_file import write_torque

    file = read_gains(options.gains)
    names = tuple(entry.name for entry in file.gains if entry.name is not None)
    said = log_description(options, names if len(names) == len(file.gains) else None)
    (recording,) = told([read_log(options.log, said)])
    check_currents(file, recording)
    found = joint_torque(recording, file.known)
    with held.writing():
        write_torque(found, file, options.out)
    result = Torques.of(found, file, options.out)
    title = f"{one_line(result.out)}: {result.samples} samples, {joints_named(result.joints)}"
    show(result.report(title), options)
    return Status.PASSED
