"""Common parts of commands that run studies: arguments, workers, interruption, resuming command."""

import argparse
import os
import shlex
import sys
import threading
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments
from scenarios.command_line.output import add_form_arguments, console
from scenarios.command_line.process import complain, ending
from scenarios.experiments.workers import add_worker_options, open_workers, worker_words
from scenarios.rendering.content import Paragraph
from scenarios.support.errors import StudyError

if TYPE_CHECKING:
    from scenarios.experiments.study import Study
    from scenarios.experiments.study_folder import StudyFolder

PATIENCE = 5.0
"""Timeout for the end of an interrupted study [s]."""


def add_study_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare scenario, folder, seed, workers and output format."""
    parser.add_argument("scenario", metavar="SCENARIO", help="a built-in name or the path of a TOML file")
    said = "folder of the study; finished trials in it are kept"
    parser.add_argument("--out", type=arguments.folder, required=True, metavar="DIR", help=said)
    parser.add_argument("--seed", type=arguments.seed, default=0, help="seed of the first trial (default 0)")
    add_worker_options(parser)
    add_form_arguments(parser)


def carried_out(study: "Study", options: argparse.Namespace, command: str) -> "StudyFolder":
    """Run a study with the workers of the options."""
    from scenarios.experiments.study import carry_out

    with interruptible(command), open_workers(options) as workers:
        return carry_out(study, options.out, workers, command=command, console=console(options))


def resuming_command(name: str, options: argparse.Namespace, own: Sequence[str]) -> str:
    """Return the command that repeats or resumes a study."""
    words = ["rx90", name, options.scenario, *own, "--out", str(options.out), "--seed", str(options.seed)]
    return shlex.join([*words, *worker_words(options)])


@contextmanager
def summary_of(folder: Path) -> Generator[None]:
    """Write a summary; an error loses no rows."""
    try:
        yield
    except OSError as error:
        raise StudyError(
            f"{folder}: the summary cannot be written: {error.strerror or error}; its trials are saved; free "
            "disk space and repeat the command"
        ) from error


def files_part(folder: Path, written: Sequence[Path]) -> Paragraph:
    """Return the last line of a report, on the location of rows and files."""
    files = ", ".join(path.name for path in written)
    return Paragraph(f"Rows in {folder / 'trials'}; {files} in {folder}.")


@contextmanager
def interruptible(command: str) -> Generator[None]:
    """On Ctrl-C or a signal, print how to continue."""
    try:
        yield
    except KeyboardInterrupt as interrupt:
        complain(f"stopped; finished trials are kept; continue with: {command}")
        status = ending(interrupt)
        leave = threading.Timer(PATIENCE, os._exit, [status])  # in case Python waits for an interrupted pool
        leave.daemon = True
        leave.start()
        sys.unraisablehook = lambda _: None  # errors at exit are irrelevant
        raise SystemExit(status) from None
