"""Output of commands: results on standard output with format, width and colours; progress on standard error."""

import argparse
import os
import shutil
import sys
from collections.abc import Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from scenarios.command_line.process import write
from scenarios.rendering import RENDERERS, Page, renderer
from scenarios.rendering.content import Report

if TYPE_CHECKING:
    from rich.console import Console

    from scenarios.support.progress import Progress

NO_CURSOR = ("dumb", "unknown")
"""Values of TERM for terminals without colours and cursor control."""


def add_form_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the output format."""
    group = parser.add_mutually_exclusive_group()
    forms = "; ".join(f"{name}: {what}" for name, what in RENDERERS.items())
    group.add_argument("--format", metavar="F", choices=RENDERERS, help=f"{forms} (default text)")
    group.add_argument("--json", action="store_true", help="the same as --format json")


def show(report: Report, options: argparse.Namespace) -> None:
    """Write a report to standard output.

    Raises:
        NoOutput: If it cannot be written.
        BrokenPipeError: If its reader has ended.
    """
    write(renderer(form(options))(report, page()))


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
def under_way(options: argparse.Namespace, stage: str) -> "Generator[Progress]":
    """Show the current stage until the work is done."""
    from scenarios.support.progress import progress_of

    with progress_of(stage, console(options)) as stages:
        yield stages
