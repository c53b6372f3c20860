"""Output of commands: results on standard output, progress on standard error, files that they may write.

Files that a command reads are never overwritten, files of others only with --force.
"""

import argparse
import os
import shutil
import sys
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.command_line import arguments
from scenarios.command_line.process import Status, write
from scenarios.rendering import RENDERERS, Page, renderer
from scenarios.rendering.content import Report
from scenarios.results.write_access import Claim, claim

if TYPE_CHECKING:
    from rich.console import Console

    from scenarios.support.progress import Progress

NO_CURSOR = ("dumb", "unknown")
"""Values of TERM for terminals without colours and cursor control."""
WRITTEN = frozenset({"out", "save", "gains_out", "ros_params", "render"})
"""Options that name written files."""


def add_form_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the output format."""
    group = parser.add_mutually_exclusive_group()
    forms = "; ".join(f"{name}: {what}" for name, what in RENDERERS.items())
    group.add_argument("--format", metavar="F", choices=RENDERERS, help=f"{forms} (default text)")
    group.add_argument("--json", action="store_true", help="the same as --format json")


def show(report: Report, options: argparse.Namespace, *, passed: bool = True) -> Status:
    """Write a report to standard output, and return the status."""
    write(renderer(form(options))(report, page()))
    return Status.PASSED if passed else Status.MISSED


def form(options: argparse.Namespace) -> str:
    """Return the requested format."""
    return "json" if options.json else options.format or "text"


def page() -> Page:
    """Return the width of the terminal or of COLUMNS; 80 characters for a pipe or file."""
    return Page(width=shutil.get_terminal_size().columns, colour=coloured(terminal=sys.stdout.isatty()))


def coloured(*, terminal: bool) -> bool:
    """Return whether to use colours: on a terminal with colours unless NO_COLOR is set; elsewhere if FORCE_COLOR is."""
    if os.environ.get("NO_COLOR"):
        return False
    return bool(os.environ.get("FORCE_COLOR")) or (terminal and os.environ.get("TERM") not in NO_CURSOR)


def console(options: argparse.Namespace) -> "Console":
    """Return the console for progress: bars on a terminal with cursor control, otherwise lines, nothing with `--quiet`.

    `rich` handles colours and NO_COLOR; FORCE_COLOR does not make a pipe a terminal.
    """
    from rich.console import Console

    moves = sys.stderr.isatty() and os.environ.get("TERM") not in NO_CURSOR
    return Console(stderr=True, quiet=options.quiet, force_terminal=moves)


@contextmanager
def under_way(options: argparse.Namespace, stage: str, *amount: int) -> "Generator[Progress]":
    """Show the current stage until the work is done; `amount` is the whole work, and the part that is done already."""
    from scenarios.support.progress import progress_of

    with progress_of(stage, console(options), *amount) as stages:
        yield stages


def add_force_argument(parser: argparse.ArgumentParser, more: str = "") -> None:
    """Declare --force, which allows overwriting files of others; `more` states what else it allows."""
    parser.add_argument("--force", action="store_true", help=f"overwrite files that this command did not write{more}")


def add_save_argument(parser: argparse.ArgumentParser) -> None:
    """Declare the folder of a saved result."""
    said = "folder for recordings, payloads, options and result, for `rx90 report DIR`"
    parser.add_argument("--save", type=arguments.folder, metavar="DIR", help=said)


def right_to_write(options: argparse.Namespace, path: Path, names: Iterable[str] = (), *, command: str) -> Claim:
    """Check whether a command may and can write a file, or files of these names in a folder; raises as `claim`."""
    folder, names = (path, tuple(names)) if names else (path.parent, (path.name,))
    if any(name.endswith(".parquet") for name in names):
        import pyarrow  # noqa: F401 # pyright: ignore[reportUnusedImport] # its absence is reported before the work
    return claim(folder, names, command=command, force=options.force, reads=files_read(options))


def files_read(options: argparse.Namespace) -> tuple[Path, ...]:
    """Return all paths of a command line except written ones, including words that are existing paths."""
    return tuple(path for name, value in vars(options).items() if name not in WRITTEN for path in _paths(value))


def _paths(value: object) -> Iterator[Path]:
    match value:
        case Path():
            yield value
        case str() if os.path.lexists(value):
            yield Path(value)
        case list() | tuple():
            for each in value:  # pyright: ignore[reportUnknownVariableType]
                yield from _paths(each)  # pyright: ignore[reportUnknownArgumentType]
        case _:
            pass
