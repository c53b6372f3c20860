"""Arguments that name recordings: bare, loaded with a payload, and a motion that was not used in any fit."""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments
from ident.support.naming import one_line
from scenarios.command_line.log_arguments import read_unrepaired
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from ident.recordings.formats.description import LogDescription
    from ident.recordings.motion import Motion

UNLOADED, LOADED, PAYLOAD = "--unloaded", "--loaded", "--payload"
HELP = {
    UNLOADED: ("A", "+", "recordings with a bare flange"),
    LOADED: ("B", "+", "recordings with one payload"),
    PAYLOAD: ("P", 1, "payload of the preceding --loaded, TOML"),
}


@dataclass(frozen=True, slots=True)
class MountedFiles:
    """Files of motions with the same payload, in the order given; no payload for a bare flange."""

    recordings: tuple[Path, ...]
    payload: Path | None


@dataclass(frozen=True, slots=True)
class Given:
    """One option of the command line and its files."""

    option: str
    files: tuple[Path, ...]

    def __str__(self) -> str:
        """The option as given."""
        return " ".join([self.option, *map(one_line, self.files)])


class _InOrder(argparse.Action):
    """Action that keeps options in the order of the command line."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Path] | None,
        option_string: str | None = None,
    ) -> None:
        """Append an option."""
        given = Given(self.option_strings[0], tuple(map(Path, values or ())))
        setattr(namespace, self.dest, (*getattr(namespace, self.dest), given))


def add_motion_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    group = parser.add_argument_group(
        "recordings",
        "Each --loaded belongs to the --payload after it; all three may be repeated. Motions are sorted by "
        "time if all files have absolute time (seconds since 1970), otherwise they are taken in the order "
        "given.",
    )
    for option, (metavar, many, said) in HELP.items():
        group.add_argument(
            option,
            type=arguments.file,
            nargs=many,
            action=_InOrder,
            dest="given",
            default=(),
            metavar=metavar,
            help=said,
        )


def mounted_files(given: Sequence[Given]) -> tuple[MountedFiles, ...]:
    """Return recordings with payloads, in the order of the command line.

    A single payload and a single loaded group belong together in either order.

    Raises:
        ScenarioError: If there is no recording, or payloads and loaded recordings do not match.
    """
    if not any(each.option != PAYLOAD for each in given):
        raise ScenarioError(f"no recording is given; expected {UNLOADED} A and {LOADED} B {PAYLOAD} P")
    found: list[MountedFiles] = []
    waiting: Given | None = None
    for each in _payload_last(given):
        if each.option == PAYLOAD:
            if waiting is None:
                raise ScenarioError(
                    f"{each}: no {LOADED} without a payload precedes it; give one payload to each {LOADED}"
                )
            found.append(MountedFiles(waiting.files, each.files[0]))
            waiting = None
            continue
        _check_described(waiting)
        if each.option == LOADED:
            waiting = each
        else:
            found.append(MountedFiles(each.files, None))
    _check_described(waiting)
    return tuple(found)


def _payload_last(given: Sequence[Given]) -> Sequence[Given]:
    """Return the options, with a single payload moved after a single loaded group."""
    payloads, loaded = ([each for each in given if each.option == option] for option in (PAYLOAD, LOADED))
    if len(payloads) != 1 or len(loaded) != 1:
        return given
    others = [each for each in given if each.option != PAYLOAD]
    place = others.index(loaded[0]) + 1
    return [*others[:place], *payloads, *others[place:]]


def _check_described(waiting: Given | None) -> None:
    if waiting is not None:
        raise ScenarioError(f"{waiting}: no payload follows it; describe what was mounted, {PAYLOAD} P.toml")


def add_unseen_arguments(parser: argparse.ArgumentParser, said: str) -> None:
    """Declare the motion and its payload."""
    group = parser.add_argument_group("a motion that was not used in any fit", said)
    group.add_argument("--unseen", type=arguments.file, metavar="LOG", help="its recording")
    said = "payload that it carries, with its centre of mass; without it a bare flange"
    group.add_argument("--unseen-payload", type=arguments.file, metavar="P", help=said)


def unseen_log(options: argparse.Namespace, said: "LogDescription") -> "Motion | None":
    """Return the named motion, None if there is none.

    Raises:
        ScenarioError: If only a payload is named.
        RecordingError: If it cannot be read.
        PayloadError: If its payload cannot be read.
    """
    if options.unseen is None:
        if options.unseen_payload is not None:
            raise ScenarioError("--unseen-payload: no motion is given that carries it; add --unseen LOG")
        return None
    from ident.payload.files import read_payload
    from ident.recordings.motion import Motion

    payload = None if options.unseen_payload is None else read_payload(options.unseen_payload)
    return Motion(read_unrepaired([options.unseen], said)[0], payload)
