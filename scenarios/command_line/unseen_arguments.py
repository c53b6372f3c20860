"""Arguments that name a motion that no fit has seen."""

import argparse
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments
from scenarios.command_line.log_arguments import read_unrepaired
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from ident.recordings.formats.description import LogDescription
    from ident.recordings.motion import Motion


def add_unseen_arguments(parser: argparse.ArgumentParser, said: str) -> None:
    """Declare the motion and its payload.

    Args:
        parser: To add to.
        said: What becomes of it.
    """
    group = parser.add_argument_group("a motion that no fit has seen", said)
    group.add_argument("--unseen", type=arguments.file, metavar="LOG", help="its recording")
    said = "payload that it carries, with its centre of mass; without it a bare flange"
    group.add_argument("--unseen-payload", type=arguments.file, metavar="P", help=said)


def unseen_log(options: argparse.Namespace, said: "LogDescription") -> "Motion | None":
    """The motion that is named, None where none is.

    Raises:
        ScenarioError: If a payload is named alone.
        RecordingError: If it cannot be read.
        PayloadError: If its payload cannot be.
    """
    if options.unseen is None:
        if options.unseen_payload is not None:
            raise ScenarioError("--unseen-payload: no motion is given that carries it; add --unseen LOG")
        return None
    from ident.payload.files import read_payload
    from ident.recordings.motion import Motion

    payload = None if options.unseen_payload is None else read_payload(options.unseen_payload)
    return Motion(read_unrepaired([options.unseen], said)[0], payload)
