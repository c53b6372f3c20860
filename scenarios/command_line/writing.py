"""Write access of commands: never to files that they read, to files of others only with --force; folder of `--save`."""

import argparse
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

import scenarios.command_line.arguments as arguments
from scenarios.results.write_access import Claim, claim

WRITTEN = frozenset({"out", "save", "gains_out", "ros_params", "render"})
"""Options that name written files."""


def right_to_write(options: argparse.Namespace, folder: Path, names: Iterable[str], *, command: str) -> Claim:
    """Check whether a command may and can write files of a folder.

    Raises:
        ScenarioError: If the folder is not writable; if a file is one that the command reads; if a file exists that the
            command did not write, without --force.
        OSError: If a file cannot be written.
    """
    names = tuple(names)
    if any(name.endswith(".parquet") for name in names):
        import pyarrow  # noqa: F401 # pyright: ignore[reportUnusedImport] # told before the work, not after it

    return claim(folder, names, command=command, force=options.force, reads=files_read(options))


def files_read(options: argparse.Namespace) -> tuple[Path, ...]:
    """Return all paths of a command line except written ones, including words that are existing paths."""
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


def add_save_argument(parser: argparse.ArgumentParser) -> None:
    """Declare the folder."""
    said = "folder for recordings, payloads, options and result, for `rx90 report DIR`"
    parser.add_argument("--save", type=arguments.folder, metavar="DIR", help=said)


def claimed_folder(options: argparse.Namespace, motions: int, command: str) -> Claim | None:
    """Return the permission to write the requested folder, None if there is none.

    Raises:
        ScenarioError: If a file exists that the command did not write.
        OSError: If it cannot be written.
    """
    if options.save is None:
        return None
    from scenarios.results.record import saved_files

    return right_to_write(options, options.save, saved_files(motions), command=command)
