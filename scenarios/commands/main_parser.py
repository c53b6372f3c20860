"""The parser of the command line: every command by name, with the arguments of those that are wanted."""

import argparse
from collections.abc import Collection

from scenarios.command_line.arguments import add_quiet_argument
from scenarios.command_line.parser import OneLineParser
from scenarios.commands import COMMANDS, command
from scenarios.commands.overview import Version, overview, statuses


def parser_of(wanted: Collection[str]) -> OneLineParser:
    """The parser.

    Args:
        wanted: Commands in `COMMANDS` that are imported, for their arguments.
    """
    parser = OneLineParser(
        prog="rx90",
        usage="rx90 [-h] [--version] COMMAND ...",
        description=overview(),
        epilog=statuses(),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=Version)
    commands = parser.add_subparsers(prog="rx90", metavar="COMMAND", help=argparse.SUPPRESS)
    for name, summary in COMMANDS.items():
        below = commands.add_parser(name, help=summary, description=f"{summary[0].upper()}{summary[1:]}.")
        if name in wanted:
            command(name).add_arguments(below)
            add_quiet_argument(below)
    return parser
