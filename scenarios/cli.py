"""The command line `rx90`: finds the command that is asked for, imports it alone, and turns its end into a status."""

import argparse
import os
import shlex
import shutil
import sys
import textwrap
import traceback
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version

from ident.errors import IdentificationError
from scenarios.commands import COMMANDS, command
from scenarios.commands.arguments import quoted
from scenarios.commands.lifetime import (
    NoOutput,
    abandon_output,
    ending,
    open_streams,
    signals_as_interrupts,
    tell,
)
from scenarios.commands.parser import OneLineParser, complain
from scenarios.commands.status import MEANINGS, Status
from scenarios.errors import ScenarioError
from sim.errors import SimulationError

DISTRIBUTION = "rx90-drive-gain-testbench"
TRACEBACK = "RX90_TRACEBACK"
"""Environment variable that asks for the place of an error nobody foresaw."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: Without the program's name; those of the process if None.

    Returns:
        The exit status; a command line that cannot be parsed exits at once with status 2, help with 0.
    """
    try:
        open_streams()
        with signals_as_interrupts():
            return _carried_out(list(sys.argv[1:] if arguments is None else arguments))
    except (IdentificationError, SimulationError, ScenarioError) as error:
        complain(str(error))
        return Status.BAD_INPUT
    except KeyboardInterrupt as interrupt:
        complain("stopped")
        return ending(interrupt)
    except BrokenPipeError:
        abandon_output()
        return Status.NOBODY_READS
    except NoOutput as error:
        complain(str(error))
        abandon_output()
        return Status.NO_OUTPUT
    except OSError as error:
        complain(f"{error.filename}: {error.strerror}" if error.filename else str(error))
        return Status.BAD_INPUT
    except Exception as error:  # the last resort: a traceback would end with 1, which is a missed tolerance
        if os.environ.get(TRACEBACK):
            traceback.print_exc()
        complain(f"{type(error).__name__}: {error}: nobody foresaw this; please report it ({TRACEBACK}=1 shows where)")
        return Status.UNFORESEEN


def _carried_out(arguments: list[str]) -> Status:
    """Parse and carry out; what is said is written out before the status is known."""
    try:
        return _command(arguments)
    finally:
        tell("")


def _command(arguments: list[str]) -> Status:
    """Parse and carry out; only the command asked for is imported."""
    name = next((word for word in arguments if not word.startswith("-")), None)
    parser = _parser(name)
    if not arguments:
        parser.print_help()
        return Status.PASSED
    options = parser.parse_args(arguments)
    if name is None:
        parser.error("which command?")
    options.command_line = shlex.join([parser.prog, *arguments])  # for the records of what was done
    return command(name).main(options)


def _parser(wanted: str | None) -> OneLineParser:
    """The parser of the command line, with the arguments of the wanted command."""
    parser = OneLineParser(
        prog="rx90",
        description=textwrap.fill("Testbench and identification of robot drive gains.", _width()),
        epilog=f"rx90 COMMAND --help shows options.\n\nexit statuses:\n{_statuses()}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"rx90 {_version()}")
    if wanted is not None and wanted not in COMMANDS:
        from scenarios.files.tables import nearest

        parser.error(f"no command {quoted(wanted)}{nearest(wanted, COMMANDS)}; there are {', '.join(COMMANDS)}")
    commands = parser.add_subparsers(metavar="COMMAND", title="commands")
    for name, summary in COMMANDS.items():
        below = commands.add_parser(name, help=summary, description=f"{summary[0].upper()}{summary[1:]}.")
        if name == wanted:
            command(name).add_arguments(below)
    return parser


def _statuses() -> str:
    return "\n".join(
        textwrap.fill(meaning, _width(), initial_indent=f"  {status:<4} ", subsequent_indent=" " * 7)
        for status, meaning in MEANINGS.items()
    )


def _width() -> int:
    """Characters to a line, as argparse wraps the rest."""
    return shutil.get_terminal_size().columns - 2


def _version() -> str:
    try:
        return version(DISTRIBUTION)
    except PackageNotFoundError:
        return "(not installed)"
