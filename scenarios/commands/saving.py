"""What was identified or checked, saved as a folder: the argument, the right to write there, the writing."""

import argparse
from typing import TYPE_CHECKING

import scenarios.commands.arguments as arguments
from scenarios.commands.writing import right_to_write
from scenarios.store.claim import Claim

if TYPE_CHECKING:
    from scenarios.store.log_folder import Done


def add_save_argument(parser: argparse.ArgumentParser) -> None:
    """Declare the folder."""
    parser.add_argument(
        "--save",
        type=arguments.folder,
        metavar="DIR",
        help="write recordings, payloads, options and result there, for `rx90 report DIR`",
    )


def claimed_folder(options: argparse.Namespace, motions: int, command: str) -> Claim | None:
    """The right to write the folder that is asked for, None if none is.

    Args:
        options: Parsed.
        motions: Recordings that will be written.
        command: That writes them.

    Raises:
        NotOurs: If a file is there that the command did not write.
        OSError: If it cannot be written.
    """
    if options.save is None:
        return None
    from scenarios.store.log_folder import log_files

    return right_to_write(options, options.save, log_files(motions), command=command)


def save(done: "Done", held: Claim) -> None:
    """Write the folder.

    Raises:
        OSError: If it cannot be written.
    """
    from scenarios.store.log_folder import save_logs

    with held.writing():
        save_logs(done, held.folder)
