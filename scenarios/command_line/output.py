"""What a command writes: a result on standard output, its form, width and colours; progress on standard error."""

import argparse
import os
import shutil
import sys
from collections.abc import Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from scenarios.command_line.streams_and_signals import tell
from scenarios.reports.content import Report
from scenarios.reports.renderers import RENDERERS, Page, renderer

if TYPE_CHECKING:
    from rich.console import Console

    from scenarios.support.stages import Stages

NO_CURSOR = ("dumb", "unknown")
"""What TERM says of terminals without colours, whose cursor goes one way."""


def add_form_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the form that a result is told in."""
    group = parser.add_mutually_exclusive_group()
    forms = "; ".join(f"{name}: {what}" for name, what in RENDERERS.items())
    group.add_argument("--format", metavar="F", choices=RENDERERS, help=f"{forms} (default text)")
    group.add_argument("--json", action="store_true", help="the same as --format json")


def show(report: Report, options: argparse.Namespace) -> None:
    """Tell a report on standard output.

    Raises:
        NoOutput: If it cannot be written.
        BrokenPipeError: If its reader has gone.
    """
    tell(renderer(form(options))(report, page()))


def form(options: argparse.Namespace) -> str:
    """The form asked for."""
    return "json" if options.json else options.format or "text"


def page() -> Page:
    """As wide as the terminal, or as COLUMNS says; 80 characters into a pipe or file."""
    return Page(width=shutil.get_terminal_size().columns, colour=coloured(terminal=sys.stdout.isatty()))


def coloured(*, terminal: bool) -> bool:
    """Whether colours are shown: on a terminal that has them, unless NO_COLOR is set; elsewhere if FORCE_COLOR is."""
    if os.environ.get("NO_COLOR"):
        return False
    return bool(os.environ.get("FORCE_COLOR")) or (terminal and os.environ.get("TERM") not in NO_CURSOR)


def console(options: argparse.Namespace) -> "Console":
    """Where progress is shown: bars on a terminal that can move its cursor, lines elsewhere, nothing with `--quiet`.

    Colours are left to `rich`, which heeds NO_COLOR; FORCE_COLOR makes no terminal of a pipe.
    """
    from rich.console import Console

    moves = sys.stderr.isatty() and os.environ.get("TERM") not in NO_CURSOR
    return Console(stderr=True, quiet=options.quiet, force_terminal=moves)


@contextmanager
def under_way(options: argparse.Namespace, stage: str) -> "Generator[Stages]":
    """Show what is under way until it is done."""
    from scenarios.support.stages import stages_of

    with stages_of(stage, console(options)) as stages:
        yield stages
