"""What the commands that carry out a study share: arguments, workers, what an interrupt says, the resuming command."""

import argparse
import os
import shlex
import sys
import threading
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments
from scenarios.command_line.output import add_form_arguments, console
from scenarios.command_line.parser import complain
from scenarios.command_line.streams_and_signals import ending
from scenarios.experiments.workers import add_worker_options, open_workers, worker_words
from scenarios.reports.content import Paragraph, Report
from scenarios.support.errors import StudyError

if TYPE_CHECKING:
    from scenarios.experiments.studies.folder import StudyFolder
    from scenarios.experiments.studies.study import Study

PATIENCE = 5.0
"""How long an interrupted study may take to end [s]."""


def add_study_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare scenario, folder, seed, where trials run and how the result is told."""
    parser.add_argument("scenario", metavar="SCENARIO", help="a built-in name or the path of a TOML file")
    said = "folder of the study; finished trials in it are kept"
    parser.add_argument("--out", type=arguments.folder, required=True, metavar="DIR", help=said)
    parser.add_argument("--seed", type=arguments.seed, default=0, help="seed of the first trial (default 0)")
    add_worker_options(parser)
    add_form_arguments(parser)


def carried_out(study: "Study", options: argparse.Namespace, command: str) -> "StudyFolder":
    """Carry out a study where the options say."""
    from scenarios.experiments.studies.study import carry_out

    with interruptible(command), open_workers(options) as workers:
        return carry_out(study, options.out, workers, command=command, console=console(options))


def resuming_command(name: str, options: argparse.Namespace, own: Sequence[str]) -> str:
    """The command that repeats or resumes a study."""
    words = ["rx90", name, options.scenario, *own, "--out", str(options.out), "--seed", str(options.seed)]
    return shlex.join([*words, *worker_words(options)])


@contextmanager
def summary_of(folder: Path) -> Generator[None]:
    """What cannot be written of a summary loses no row."""
    try:
        yield
    except OSError as error:
        raise StudyError(
            f"{folder}: the summary cannot be written: {error.strerror or error}; its trials are saved; free "
            "disk space and repeat the command"
        ) from error


def with_files(report: Report, folder: Path, written: Sequence[Path]) -> Report:
    """The report with a last line that says where rows and files are."""
    files = ", ".join(path.name for path in written)
    return replace(report, parts=(*report.parts, Paragraph(f"Rows in {folder / 'trials'}; {files} in {folder}.")))


@contextmanager
def interruptible(command: str) -> Generator[None]:
    """On Ctrl-C or a signal that ends, say how to go on."""
    try:
        yield
    except KeyboardInterrupt as interrupt:
        complain(f"stopped; finished trials are kept; continue with: {command}")
        status = ending(interrupt)
        leave = threading.Timer(PATIENCE, os._exit, [status])  # should Python wait for a pool cut off half-way
        leave.daemon = True
        leave.start()
        sys.unraisablehook = lambda _: None  # nor does it matter what Python stumbles over on the way out
        raise SystemExit(status) from None
