"""Write access of commands: checked before the work; files of others are not overwritten.

A command writes `.rx90.json` with its name and the digest of each of its files. It may overwrite these files; other or
changed files only with --force; files that it reads never.
"""

import hashlib
import json
import os
from collections.abc import Generator, Iterable
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile

from ident.support.naming import one_line
from scenarios.support.errors import ScenarioError

RECORD = ".rx90.json"


@dataclass(frozen=True, slots=True)
class Claim:
    """Permission of a command to write some files of a folder."""

    folder: Path
    names: tuple[str, ...]
    command: str

    @property
    def said(self) -> str:
        """The path that the user stated: a file or the folder."""
        return one_line(self.folder / self.names[0] if len(self.names) == 1 else self.folder)

    @contextmanager
    def writing(self) -> Generator[None]:
        """Create the folder, and record the written files, also if the command is interrupted.

        Raises:
            ScenarioError: If the folder cannot be created, or a file or the record cannot be written.
        """
        make_folder(self.folder)
        try:
            yield
        except BaseException as error:
            with suppress(OSError):  # the disk may be full
                self._record()
            if isinstance(error, OSError) and error.filename is None:  # of a write
                raise ScenarioError(f"{self.said}: cannot be written: {_reason(error)}") from error
            raise
        try:
            self._record()
        except OSError as error:
            raise ScenarioError(f"{self.said}: {RECORD} beside it cannot be written: {_reason(error)}") from error

    def _record(self) -> None:
        records, there = _records(self.folder), [name for name in self.names if (self.folder / name).is_file()]
        files = {**records.get(self.command, {}), **{name: _digest(self.folder / name) for name in there}}
        text = json.dumps({**records, self.command: files}, indent=2)
        (self.folder / RECORD).write_text(text + "\n", encoding="utf-8")


def make_folder(folder: Path) -> None:
    """Create a folder and its parents.

    Raises:
        ScenarioError: If it cannot be created.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ScenarioError(f"cannot create {one_line(folder)}: {_reason(error)}") from error


def claim(folder: Path, names: Iterable[str], *, command: str, force: bool, reads: Iterable[Path]) -> Claim:
    """Check whether a command may and can write files.

    Files of others are overwritten with `force`, files that it `reads` never.

    Raises:
        ScenarioError: If the folder is not writable; if a file is one that the command reads; if a file exists that the
            command did not write, or that was changed since.
        OSError: If a file cannot be written.
    """
    held, above = Claim(folder, tuple(names), command), folder.absolute()
    while not os.path.exists(above) and above != above.parent:
        above = above.parent
    try:
        with TemporaryFile(dir=above) as tried:
            tried.write(b"0")
            tried.flush()
    except OSError as error:
        raise ScenarioError(f"{held.said}: cannot be written: {one_line(above)}: {_reason(error)}") from error
    there = [path for path in reads if os.path.exists(path)]
    ours = _records(folder).get(command, {})
    for path in (folder / name for name in held.names if (folder / name).exists()):
        if not path.is_file():
            raise ScenarioError(f"{path}: not a regular file")
        if not os.access(path, os.W_OK):
            raise PermissionError(13, os.strerror(13), str(path))
        if any(path.samefile(read) for read in there):
            said = f"{command} reads this file and would overwrite it; give another path"
            raise ScenarioError(f"{one_line(path)}: {said}")
        if not force and path.name not in ours:
            raise ScenarioError(f"{path}: {command} did not write this file; give another path, or add --force")
        if not force and ours[path.name] != _digest(path):
            raise ScenarioError(f"{path}: changed since {command} wrote it; give another path, or add --force")
    return held


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
