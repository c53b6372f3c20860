"""Standard error of a command while it works."""

import argparse
import os
import sys
from collections.abc import Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

    from scenarios.support.stages import Stages


NO_CURSOR = ("dumb", "unknown")
"""What TERM says of terminals without colours, whose cursor goes one way."""


def console(options: argparse.Namespace) -> "Console":
    """Where progress is shown: bars on a terminal that can move its cursor, lines elsewhere, nothing with `--quiet`.

    Colours are left to `rich`, which heeds NO_COLOR; FORCE_COLOR makes no terminal of a pipe.
    """
    from rich.console import Console

    moves = sys.stderr.isatty() and os.environ.get("TERM") not in NO_CURSOR
    return Console(stderr=True, quiet=options.quiet, force_terminal=moves)


@contextmanager
def under_way(options: argparse.Namespace, stage: str) -> "Generator[Stages]":
    """Show what is under way until it is done.

    Args:
        options: Parsed.
        stage: What is done first.
    """
    from scenarios.support.stages import stages_of

    with stages_of(stage, console(options)) as stages:
        yield stages
