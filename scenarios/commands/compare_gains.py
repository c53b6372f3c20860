"""`rx90 compare-gains`."""

import argparse

import scenarios.command_line.gains as gains_arguments
from scenarios.command_line.output import add_form_arguments, show
from scenarios.command_line.process import Status


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "first", type=gains_arguments.gains_path, metavar="A", help="gains, as identify --gains-out writes"
    )
    parser.add_argument(
        "second", type=gains_arguments.gains_path, metavar="B", help="gains identified later, or of another robot"
    )
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Read, compare, report; status 1 if a change is significant."""
    from ident.estimation.gain_comparison import compared
    from scenarios.experiments.files.gains import check_units, read_gains
    from scenarios.reports.compare_gains import comparison_report

    A, B = read_gains(options.first), read_gains(options.second)
    found = compared(A.known, B.known)
    check_units(A, B)
    show(comparison_report(found, A, B), options)
    return Status.MISSED if found.moved else Status.PASSED
