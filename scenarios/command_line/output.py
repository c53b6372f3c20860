"""Standard output of a command: which form, how wide, in colour or not."""

import argparse
import os
import shutil
import sys
from dataclasses import replace

from scenarios.command_line.progress import NO_CURSOR
from scenarios.command_line.streams_and_signals import tell
from scenarios.reports.content import Mood, Paragraph, Part, Report
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
    asked = form(options)
    tell(renderer(asked)(verdict_first(report) if asked == "html" else report, page()))


def verdict_first(report: Report) -> Report:
    """The report with its verdict before all else: a page is read from its top, a terminal from its end."""
    last = len(report.parts) - 1
    verdicts = [k for k, part in enumerate(report.parts) if _concludes(part, last=k == last)]
    if not verdicts:
        return report
    parts = list(report.parts)
    return replace(report, parts=(parts.pop(verdicts[-1]), *parts))


def _concludes(part: Part, *, last: bool) -> bool:
    """Whether a part is a verdict; strong and doubtful words are one at the end only, before it they warn."""
    return isinstance(part, Paragraph) and part.strong and (last or part.mood in (Mood.GOOD, Mood.BAD))


def form(options: argparse.Namespace) -> str:
    """The form asked for."""
    return "json" if options.json else options.format or "text"


def page() -> Page:
    """As wide as the terminal; of any width into a pipe or file."""
    if not sys.stdout.isatty():
        return Page(colour=coloured(terminal=False))
    return Page(width=shutil.get_terminal_size().columns, colour=coloured(terminal=True))


def coloured(*, terminal: bool) -> bool:
    """Whether colours are shown: on a terminal that has them, unless NO_COLOR is set; elsewhere if FORCE_COLOR is.

    Args:
        terminal: Whether somebody looks at it.
    """
    if os.environ.get("NO_COLOR"):
        return False
    return bool(os.environ.get("FORCE_COLOR")) or (terminal and os.environ.get("TERM") not in NO_CURSOR)
