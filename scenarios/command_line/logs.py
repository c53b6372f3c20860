"""Arguments for what is identified from: the robot's model, recordings with their payloads, and foreign log formats."""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments
from ident.recordings.description import (
    EPISODE,
    LAYOUTS,
    MEANINGS,
    UNKNOWN,
    LogDescription,
    described,
    read_description,
)
from ident.support.naming import one_line
from scenarios.command_line.process import complain
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from ident.recordings.files import Log
    from ident.recordings.recording import Motion, Recording
    from scenarios.experiments.robots import NamedRobot

UNLOADED, LOADED, PAYLOAD = "--unloaded", "--loaded", "--payload"
HELP = {
    UNLOADED: ("A", "+", "recordings with a bare flange"),
    LOADED: ("B", "+", "recordings with one payload"),
    PAYLOAD: ("P", 1, "payload of the preceding --loaded, TOML"),
}


def add_model_arguments(parser: argparse.ArgumentParser, *, needed: bool = True) -> None:
    """Declare the robot's model."""
    said = "MJCF or URDF file, robot.toml, or the name of a built-in robot"
    parser.add_argument("--model", required=needed, metavar="ROBOT", help=said)
    add_reading_arguments(parser)


def add_reading_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare properties of the arm that a model file does not state."""
    add = parser.add_argument
    add("--flange", metavar="BODY", help="last body of the arm, if the file has more; joints beyond it are locked")
    said = "motor J turns by the sum of joints I and J, e.g. 5 6 on Staubli wrists"
    add("--coupling", type=arguments.count, nargs=2, action="append", default=[], metavar=("I", "J"), help=said)


def robot_of(options: argparse.Namespace, word: str) -> "NamedRobot":
    """Return the robot of the command line, read as its arguments say; raises as `named_robot`."""
    from scenarios.experiments.robots import named_robot

    couplings = tuple((i - 1, j - 1) for i, j in options.coupling)
    return named_robot(word, couplings, flange=options.flange)


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
    """Keeps options in the order of the command line."""

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
    """Declare recordings and payloads."""
    said = (
        "Each --loaded belongs to the --payload after it; all three may be repeated. Motions are sorted by time if all "
        "files have absolute time (seconds since 1970), otherwise they are taken in the order given."
    )
    group = parser.add_argument_group("recordings", said)
    for option, (metavar, many, what) in HELP.items():
        group.add_argument(
            option, type=arguments.file, nargs=many, action=_InOrder, dest="given", default=(), metavar=metavar,
            help=what,
        )  # fmt: skip


def mounted_files(given: Sequence[Given]) -> tuple[MountedFiles, ...]:
    """Return recordings with payloads, in the order of the command line.

    A single payload and a single loaded group belong together in either order.

    Raises:
        ScenarioError: If there is no recording, or payloads and loaded recordings do not match.
    """
    if not any(each.option != PAYLOAD for each in given):
        raise ScenarioError(f"no recording is given; expected {UNLOADED} A and {LOADED} B {PAYLOAD} P")
    payloads, loaded = ([each for each in given if each.option == option] for option in (PAYLOAD, LOADED))
    if len(payloads) == len(loaded) == 1:
        given = [each for each in given if each.option != PAYLOAD]
        given.insert(given.index(loaded[0]) + 1, payloads[0])
    found: list[MountedFiles] = []
    for before, each, after in zip([None, *given], given, [*given[1:], None], strict=False):
        if each.option == PAYLOAD:
            if before is None or before.option != LOADED:
                raise ScenarioError(
                    f"{each}: no {LOADED} without a payload precedes it; give one payload to each {LOADED}"
                )
        elif each.option == LOADED:
            if after is None or after.option != PAYLOAD:
                raise ScenarioError(f"{each}: no payload follows it; describe what was mounted, {PAYLOAD} P.toml")
            found.append(MountedFiles(each.files, after.files[0]))
        else:
            found.append(MountedFiles(each.files, None))
    return tuple(found)


def add_unseen_arguments(parser: argparse.ArgumentParser, said: str) -> None:
    """Declare a motion that was not used in any fit, and its payload."""
    group = parser.add_argument_group("a motion that was not used in any fit", said)
    group.add_argument("--unseen", type=arguments.file, metavar="LOG", help="its recording")
    said = "payload that it carries, with its centre of mass; without it a bare flange"
    group.add_argument("--unseen-payload", type=arguments.file, metavar="P", help=said)


def unseen_log(options: argparse.Namespace, said: LogDescription) -> "Motion | None":
    """Return the named motion, None if there is none.

    Raises:
        ScenarioError: If only a payload is named.
        IdentificationError: If recording or payload cannot be read.
    """
    if options.unseen is None:
        if options.unseen_payload is not None:
            raise ScenarioError("--unseen-payload: no motion is given that carries it; add --unseen LOG")
        return None
    from ident.payload.payload import read_payload
    from ident.recordings.recording import Motion

    payload = None if options.unseen_payload is None else read_payload(options.unseen_payload)
    return Motion(read_unrepaired([options.unseen], said)[0], payload)


def add_log_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the description of a foreign log."""
    said = (
        "For logs whose columns are not t, q1.., v1.. in seconds, radians and drive units. The quantity of v cannot be "
        "inferred from its values; declare it: "
    )
    meanings = "; ".join(f"{name}: {kind.words}" for name, kind in MEANINGS.items())
    add = parser.add_argument_group("foreign logs", f"{said}{meanings}.").add_argument
    add("--log-description", type=arguments.file, metavar="FILE", help="description of the log, TOML")
    said = "names and units of its columns: t=time[ms] q=pos_{1..6}[deg] v=cur_{1..6}[mA]"
    add("--columns", nargs="+", metavar="WORD", help=said)
    add("--signal", metavar="KIND", choices=MEANINGS, help="what v is")
    said = f"torque constant [N m/A] of a torque-from-current, or {UNKNOWN}"
    add("--constant", type=_constants, metavar="K,K,..", help=said)
    add("--layout", metavar="L", choices=LAYOUTS, help=f"layout, if not recognised: {', '.join(LAYOUTS)}")
    add("--topic", metavar="T", help="topic of a bag")
    add("--episode", type=arguments.whole, metavar="N", help="episode of a LeRobot dataset, counted from 0")
    add("--joints", type=_names, metavar="J,J,..", help="names of the joints in the log, base to flange")


def log_description(options: argparse.Namespace, joint_names: Sequence[str] | None) -> LogDescription:
    """Return the description of logs. `joint_names`, those of the arm, are the default.

    Raises:
        ScenarioError: If both file and options are given; if the given names are those of the arm in another order, or
            differ in number.
        IdentificationError: If the description is not valid.
    """
    nothing = LogDescription()
    said = nothing if options.log_description is None else read_description(options.log_description)
    words = described(options.columns or ())
    if options.constant is not None:
        words = replace(words, v=replace(words.v, constant=options.constant))
    given = {"signal": options.signal, "layout": options.layout, "topic": options.topic, "joints": options.joints}
    given |= {kind: getattr(words, kind) for kind in "tqv"}
    given["only"] = () if options.episode is None else ((EPISODE, float(options.episode)),)
    changes = {name: value for name, value in given.items() if value != getattr(nothing, name)}
    for name in changes:
        if getattr(said, name) != getattr(nothing, name):
            raise ScenarioError(f"{options.log_description} says {name}, and so does the command line; state it once")
    said = replace(said, **changes)
    if joint_names is None:
        return said
    if said.joints is not None and said.joints != tuple(joint_names):
        expected = ", ".join(joint_names)
        if sorted(said.joints) == sorted(joint_names):
            raise ScenarioError(f"joints are given as {', '.join(said.joints)}; expected the model's order {expected}")
        if len(said.joints) != len(joint_names):
            raise ScenarioError(f"{len(said.joints)} joints are given, the model has {len(joint_names)}: {expected}")
    return replace(said, joints=said.joints or tuple(joint_names))


def read_unrepaired(paths: Sequence[Path], said: LogDescription) -> "list[Recording]":
    """Return recordings for checks and repairs; the interpretation of a foreign log is reported immediately."""
    import ident.recordings.files as files

    return told([files.read_unrepaired(path, said) for path in paths])


def told(logs: "Sequence[Log]") -> "list[Recording]":
    """Return the recordings of logs; their interpretation is reported."""
    for log in logs:
        for note in log.notes:
            complain(f"{log.recording.name}: {note}")
    return [log.recording for log in logs]


def _names(text: str) -> tuple[str, ...]:
    names = tuple(name.strip() for name in text.split(","))
    if not all(names) or len(set(names)) < len(names):
        raise argparse.ArgumentTypeError("expected names, each once, separated by commas")
    return names


def _constants(text: str) -> tuple[float, ...]:
    constants = () if text == UNKNOWN else tuple(arguments.number(word) for word in text.split(","))
    if not all(constants):
        raise argparse.ArgumentTypeError("expected numbers that are not 0")
    return constants
