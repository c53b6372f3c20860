"""The right of a command to write files: none that it reads, and others' only with --force."""

import argparse
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from scenarios.results.write_access import Claim, claim

WRITTEN = frozenset({"out", "save", "gains_out", "ros_params", "render", "seal"})
"""Options that name what a command writes."""


def right_to_write(options: argparse.Namespace, folder: Path, names: Iterable[str], *, command: str) -> Claim:
    """Find out whether a command may write files of a folder, and can.

    Args:
        options: Parsed.
        folder: Where.
        names: Of the files.
        command: The command.

    Raises:
        ScenarioError: If the folder cannot be written; if a file is one that the command line names to be read; if one
            is there that the command did not write, and --force is not given.
        OSError: If a file cannot be written.
    """
    names = tuple(names)
    if any(name.endswith(".parquet") for name in names):
        import pyarrow  # noqa: F401 # pyright: ignore[reportUnusedImport] # told before the work, not after it

    return claim(folder, names, command=command, force=options.force, reads=files_read(options))


def files_read(options: argparse.Namespace) -> tuple[Path, ...]:
    """Every path of a command line but those that are written; a word is one too if it names what is there."""
    return tuple(path for name, value in vars(options).items() if name not in WRITTEN for path in _paths(value))


def _paths(value: object) -> Iterator[Path]:
    if isinstance(value, Path):
        yield value
    elif isinstance(value, str):
        if os.path.lexists(value):
            yield Path(value)
    else:
        several = value if isinstance(value, list | tuple) else getattr(value, "files", ())
        for each in several:  # pyright: ignore[reportUnknownVariableType]
            yield from _paths(each)  # pyright: ignore[reportUnknownArgumentType]
