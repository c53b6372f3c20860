"""Output of commands: results on standard output, progress on standard error, files that they may write.

A command writes `.rx90.json` with its name and the digest of each of its files. It may overwrite these files; other or
changed files only with --force; files that it reads never. This is checked before the work.
"""

import argparse
import hashlib
import json
import os
import shutil
import sys
from collections.abc import Generator, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING

from ident.support.naming import one_line
from scenarios.command_line import arguments
from scenarios.command_line.process import Status, write
from scenarios.rendering import RENDERERS, Page, renderer
from scenarios.rendering.content import Report
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from rich.console import Console

    from scenarios.support.progress import Progress

RECORD = ".rx90.json"
NO_CURSOR = ("dumb", "unknown")
"""Values of TERM for terminals without colours and cursor control."""
WRITTEN = frozenset({"out", "save", "gains_out", "description_out", "ros_params", "render"})
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
    """Return the width of the terminal or COLUMNS, 80 for a pipe, and colours by TERM, NO_COLOR and FORCE_COLOR."""
    terminal = sys.stdout.isatty() and os.environ.get("TERM") not in NO_CURSOR
    colour = not os.environ.get("NO_COLOR") and (terminal or bool(os.environ.get("FORCE_COLOR")))
    return Page(width=shutil.get_terminal_size().columns, colour=colour)


def console(options: argparse.Namespace) -> "Console":
    """Return the console for progress: bars on a terminal with cursor control, otherwise lines; none if `--quiet`."""
    from rich.console import Console

    moves = sys.stderr.isatty() and os.environ.get("TERM") not in NO_CURSOR
    return Console(stderr=True, quiet=options.quiet, force_terminal=moves)  # FORCE_COLOR makes no pipe a terminal


def under_way(options: argparse.Namespace, stage: str, *amount: int) -> "AbstractContextManager[Progress]":
    """Show the current stage until the work is done; `amount` is the whole work, and the part that is done already."""
    from scenarios.support.progress import progress_of

    return progress_of(stage, console(options), *amount)


def add_force_argument(parser: argparse.ArgumentParser, more: str = "") -> None:
    """Declare --force, which allows overwriting files of others; `more` states what else it allows."""
    parser.add_argument("--force", action="store_true", help=f"overwrite files that this command did not write{more}")


def add_save_argument(parser: argparse.ArgumentParser) -> None:
    """Declare the folder of a saved result."""
    text = "folder for recordings, payloads, options and result, for `rx90 report DIR`"
    parser.add_argument("--save", type=arguments.folder, metavar="DIR", help=text)


@dataclass(frozen=True, slots=True)
class Claim:
    """Permission of a command to write some files of a folder."""

    folder: Path
    names: tuple[str, ...]
    command: str

    @property
    def place(self) -> str:
        """The path that the user stated: a file or the folder."""
        return one_line(self.folder / self.names[0] if len(self.names) == 1 else self.folder)

    @contextmanager
    def writing(self) -> Generator[None]:
        """Create the folder, and record the written files, also if the command is interrupted.

        Raises `ScenarioError` if a file or the record cannot be written, which leaves no part of one, `OSError` if one
        cannot be created.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        recorded, written = self.folder / f"{RECORD}.part", [self.folder / name for name in self.names]
        before = {path: _digest(path) for path in written if path.is_file()}
        try:
            try:
                yield
            finally:
                records = _records(self.folder)
                files = records.get(self.command, {}) | {x.name: _digest(x) for x in written if x.is_file()}
                text = json.dumps({**records, self.command: files}, indent=2)
                recorded.write_text(text + "\n", encoding="utf-8")
                recorded.replace(self.folder / RECORD)
        except OSError as error:
            if error.filename is not None:  # not of a write
                raise
            recorded.unlink(missing_ok=True)
            for path in (each for each in written if each.is_file() and _digest(each) != before.get(each)):
                path.unlink()
            raise ScenarioError(f"{self.place}: cannot be written: {_reason(error)}") from error


def right_to_write(options: argparse.Namespace, path: Path, names: Iterable[str] = (), *, command: str) -> Claim:
    """Check whether a command may and can write a file, or files of these names in a folder.

    A folder is created, but not that of a single file. Raises `ScenarioError` or `OSError` if not. Files of others are
    overwritten with --force, files that the command reads never.
    """
    folder, names = (path, tuple(names)) if names else (path.parent, (path.name,))
    if folder != path and not folder.exists():
        raise ScenarioError(f"{one_line(path)}: there is no folder {one_line(folder)}; create it, or correct the path")
    if any(name.endswith(".parquet") for name in names):
        import pyarrow  # noqa: F401 # pyright: ignore[reportUnusedImport] # its absence is reported before the work
    claimed, above = Claim(folder, names, command), folder.absolute()
    while not os.path.exists(above) and above != above.parent:
        above = above.parent
    try:
        with TemporaryFile(dir=above) as tried:
            tried.write(b"0")
            tried.flush()
    except OSError as error:
        raise ScenarioError(f"{claimed.place}: cannot be written: {one_line(above)}: {_reason(error)}") from error
    given = [value for name, value in vars(options).items() if name not in WRITTEN]
    there = [path for path in _paths(given) if os.path.exists(path)]
    ours = _records(folder).get(command, {})
    for path in (folder / name for name in names if (folder / name).exists()):
        if not path.is_file():
            raise ScenarioError(f"{path}: not a regular file")
        if not os.access(path, os.W_OK):
            raise PermissionError(13, os.strerror(13), str(path))
        if any(path.samefile(read) for read in there):
            text = f"{command} reads this file and would overwrite it; give another path"
            raise ScenarioError(f"{one_line(path)}: {text}")
        if not options.force and (path.name not in ours or ours[path.name] != _digest(path)):
            why = f"changed since {command} wrote it" if path.name in ours else f"{command} did not write this file"
            raise ScenarioError(f"{path}: {why}; give another path, or add --force")
    return claimed


def may_write(
    options: argparse.Namespace, path: Path | None, names: Iterable[str] = (), *, command: str
) -> Claim | None:
    """Check the right to write of an option that may be omitted."""
    return None if path is None else right_to_write(options, path, names, command=command)


def _reason(error: OSError) -> str:
    return error.strerror or one_line(error)


def _records(folder: Path) -> dict[str, dict[str, str]]:
    """Return the digests of files that each command wrote into a folder; empty without a valid record."""
    try:
        records = json.loads((folder / RECORD).read_text(encoding="utf-8"))
        return {str(command): {str(k): str(v) for k, v in files.items()} for command, files in records.items()}
    except (OSError, ValueError, AttributeError):
        return {}


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _paths(value: object) -> Iterator[str | Path]:
    """Yield the paths and words in values of options."""
    if isinstance(value, str | Path):
        yield value
    elif isinstance(value, list | tuple):
        for each in value:  # pyright: ignore[reportUnknownVariableType]
            yield from _paths(each)  # pyright: ignore[reportUnknownArgumentType]
