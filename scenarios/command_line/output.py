"""Standard output of a command: which form, how wide, in colour or not."""

import argparse
import os
import shutil
import sys

from scenarios.command_line.progress import NO_CURSOR
from scenarios.command_line.streams_and_signals import tell
from scenarios.reports.content import Report
from scenarios.reports.renderers import RENDERERS, Page, renderer


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
    """Whether colours are shown: on a terminal that has them, unless NO_COLOR is set; elsewhere if FORCE_COLOR is.

    Args:
        terminal: Whether somebody looks at it.
    """
    if os.environ.get("NO_COLOR"):
        return False
    return bool(os.environ.get("FORCE_COLOR")) or (terminal and os.environ.get("TERM") not in NO_CURSOR)
