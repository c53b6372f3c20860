"""The command line `rx90`: finds the requested command, imports only it, and converts its outcome to a status."""

import os
import shlex
import sys
import traceback
from collections.abc import Sequence

from ident.support.errors import IdentificationError
from ident.support.extras import needed_extra
from ident.support.naming import nearest
from scenarios.command_line.arguments import escaped, is_text, quoted
from scenarios.command_line.parser import complain
from scenarios.command_line.status import Status
from scenarios.command_line.streams_and_signals import (
    NoOutput,
    abandon_output,
    ending,
    open_streams,
    signals_as_interrupts,
    tell,
)
from scenarios.command_line.surroundings import foreign_packages, without_opengl
from scenarios.commands import COMMANDS, NEEDED, command
from scenarios.commands.overview import overview, parser_of
from scenarios.experiments.files.tables import find_scenario
from scenarios.support.errors import ScenarioError
from sim.errors import SimulationError

TRACEBACK = "RX90_TRACEBACK"
"""Environment variable that requests the traceback of an unexpected error."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; by default with the arguments of the process.

    Returns:
        The exit status; a command line that cannot be parsed exits at once with status 2, help with 0.
    """
    try:
        open_streams()
        with signals_as_interrupts(), without_opengl():
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
    except ModuleNotFoundError as error:
        return _absent(error, list(sys.argv[1:] if arguments is None else arguments))
    except Exception as error:  # a traceback would end with status 1, that of a missed tolerance
        return _unforeseen(error)


def _absent(error: ModuleNotFoundError, arguments: Sequence[str]) -> Status:
    """Report a missing package, of an extra or for an unknown reason."""
    extra = needed_extra(error.name, NEEDED.get(next(iter(arguments), "")))
    if extra is None:
        return _unforeseen(error)
    complain(extra)
    return Status.BAD_INPUT


def _unforeseen(error: Exception) -> Status:
    """Report an unexpected error, or one of another package."""
    if os.environ.get(TRACEBACK):
        traceback.print_exc()
    foreign = foreign_packages(error)
    if foreign is not None:
        complain(foreign)
        return Status.BAD_INPUT
    complain(f"{type(error).__name__}: {error}: internal error; please report it ({TRACEBACK}=1 shows where)")
    return Status.UNFORESEEN


def _carried_out(arguments: list[str]) -> Status:
    """Parse and run a command; output is written before the status is known."""
    try:
        return _command(arguments)
    finally:
        tell("")


def _command(arguments: list[str]) -> Status:
    """Parse and run; only the requested command is imported."""
    if not arguments:
        tell(f"{overview()}\n")
        return Status.PASSED
    name = next((word for word in arguments if not word.startswith("-")), None)
    parser = parser_of([] if name is None else [name])
    if name is not None and name not in COMMANDS:
        advice = nearest(name, COMMANDS) or f"; known: {', '.join(COMMANDS)}"
        parser.error(f"no command {quoted(name)}{advice}")
    unreadable = next((word for word in arguments if not is_text(word)), None)
    if unreadable is not None:
        parser.error(f"{escaped(unreadable)}: the name is not UTF-8; rename the file or folder")
    options = parser.parse_args(arguments)
    if name is None:
        parser.error("which command?")
    if "scenario" in options:
        find_scenario(options.scenario)  # report a mistyped name before slow imports
    options.command_line = shlex.join([parser.prog, *arguments])  # for the records
    return command(name).main(options)
