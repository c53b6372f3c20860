"""Arguments of identifications and of what uses gains: robot, recordings and payloads, log formats, filters, gains."""

import argparse
from collections.abc import Sequence
from dataclasses import Field, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from ident.recordings.description import (
    EPISODE,
    LAYOUTS,
    MEANINGS,
    STATE,
    UNKNOWN,
    Channels,
    LogDescription,
    described,
    read_description,
)
from ident.support.naming import one_line
from ident.support.options import MEASURED, NAMES
from scenarios.command_line import arguments
from scenarios.command_line.process import complain
from scenarios.support.errors import ScenarioError
from scenarios.support.texts import attribute_docs

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from ident.estimation.known_gains import KnownGains
    from ident.model.arm import Arm
    from ident.preparation import Policy
    from ident.recordings.files import Log
    from ident.recordings.recording import Motion, Recording
    from scenarios.experiments.robots import NamedRobot

    Options = TypeVar("Options", bound=DataclassInstance)

UNLOADED, LOADED, PAYLOAD = "--unloaded", "--loaded", "--payload"
Group = tuple[str, tuple[Path, ...]]
"""One of these options, and its files."""


class Mounting(NamedTuple):
    """Files of motions with the same payload, in the order given; no payload for a bare flange."""

    recordings: tuple[Path, ...]
    payload: Path | None


def add_model_arguments(parser: argparse.ArgumentParser, *, needed: bool = True) -> None:
    """Declare the robot's model."""
    text = "MJCF or URDF file, robot.toml, or the name of a built-in robot"
    parser.add_argument("--model", required=needed, metavar="ROBOT", help=text)
    add_reading_arguments(parser)


def add_reading_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare properties of the arm that a model file does not state."""
    add = parser.add_argument
    add("--flange", metavar="BODY", help="last body of the arm, if the file has more; joints beyond it are locked")
    text = "motor J turns by the sum of joints I and J, e.g. 5 6 on Staubli wrists"
    add("--coupling", type=arguments.count, nargs=2, action="append", default=[], metavar=("I", "J"), help=text)


def robot_of(options: argparse.Namespace, word: str) -> "NamedRobot":
    """Return the robot of the command line, read as its arguments say; raises as `named_robot`."""
    from scenarios.experiments.robots import named_robot

    return named_robot(word, tuple((i - 1, j - 1) for i, j in options.coupling), flange=options.flange)


def add_motion_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare recordings and payloads."""
    text = (
        "Each --loaded belongs to the --payload after it; all three may be repeated. Motions are sorted by time if all "
        "files have absolute time (seconds since 1970), otherwise they are taken in the order given."
    )
    add = partial(parser.add_argument_group("recordings", text).add_argument, action="append", dest="given", default=[])
    for option, metavar, count, what in (
        (UNLOADED, "A", "+", "recordings with a bare flange"),
        (LOADED, "B", "+", "recordings with one payload"),
        (PAYLOAD, "P", 1, "payload of the preceding --loaded, TOML"),
    ):
        add(option, type=partial(_with_option, option), nargs=count, metavar=metavar, help=what)


def _with_option(option: str, text: str) -> tuple[str, Path]:
    return option, arguments.file(text)


def mountings(options: Sequence[Sequence[tuple[str, Path]]]) -> tuple[Mounting, ...]:
    """Return recordings with payloads, in the order of the command line.

    A single payload and a single loaded group belong together in either order. Raises `ScenarioError` if there is
    no recording, or payloads and loaded recordings do not match.
    """
    given: list[Group] = [(each[0][0], tuple(path for _, path in each)) for each in options]
    kinds = [option for option, _ in given]
    if not {UNLOADED, LOADED} & set(kinds):
        raise ScenarioError(f"no recording is given; expected {UNLOADED} A and {LOADED} B {PAYLOAD} P")
    if kinds.count(PAYLOAD) == kinds.count(LOADED) == 1:
        payload, given = given[kinds.index(PAYLOAD)], [each for each in given if each[0] != PAYLOAD]
        given.insert([option for option, _ in given].index(LOADED) + 1, payload)
    found, before = list[Mounting](), ""
    for (option, files), (after, below) in zip(given, [*given[1:], ("", ())], strict=True):
        words = " ".join([option, *map(one_line, files)])
        if option == LOADED and after != PAYLOAD:
            raise ScenarioError(f"{words}: no payload follows it; describe what was mounted, {PAYLOAD} P.toml")
        if option == PAYLOAD and before != LOADED:
            remedy = f"give one payload to each {LOADED}"
            raise ScenarioError(f"{words}: no {LOADED} without a payload precedes it; {remedy}")
        if option != PAYLOAD:
            found.append(Mounting(files, next(iter(below)) if option == LOADED else None))
        before = option
    return tuple(found)


def read_motions(mounted: Sequence[Mounting], description: LogDescription) -> "tuple[Motion, ...]":
    """Return the motions of all mountings, in order of time."""
    from ident.payload.payload import read_payload
    from ident.recordings.recording import Motion, in_order_of_time

    motions = list[Motion]()
    for recordings, path in mounted:
        read, payload = read_unrepaired(recordings, description), None if path is None else read_payload(path)
        motions += [Motion(each, payload) for each in read]
    return tuple(in_order_of_time(motions))


def add_unseen_arguments(parser: argparse.ArgumentParser, text: str) -> None:
    """Declare a motion that was not used in any fit, and its payload."""
    group = parser.add_argument_group("a motion that was not used in any fit", text)
    group.add_argument("--unseen", type=arguments.file, metavar="LOG", help="its recording")
    text = "payload that it carries, with its centre of mass; without it a bare flange"
    group.add_argument("--unseen-payload", type=arguments.file, metavar="P", help=text)


def unseen_motion(options: argparse.Namespace, description: LogDescription) -> "Motion | None":
    """Return the motion that was not used in any fit, None if there is none; an error if only a payload is named."""
    if options.unseen is None:
        if options.unseen_payload is not None:
            raise ScenarioError("--unseen-payload: no motion is given that carries it; add --unseen LOG")
        return None
    return read_motions([Mounting((options.unseen,), options.unseen_payload)], description)[0]


def add_log_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the description of a foreign log."""
    text = (
        "For logs whose columns are not t, q1.., v1.. in seconds, radians and drive units. The quantity of v cannot be "
        "inferred from its values; declare it: "
    )
    meanings = "; ".join(f"{name}: {kind.words}" for name, kind in MEANINGS.items())
    add = parser.add_argument_group("foreign logs", f"{text}{meanings}.").add_argument
    add("--log-description", type=arguments.file, metavar="FILE", help="description of the log, TOML")
    text = "lines that the description has too: 'q.factor = [1, 0.5, 1]'; factors are multiplied"
    add(STATE, action="extend", nargs="+", default=[], metavar="LINE", help=text)
    text = "names and units of its columns: t=time[ms] q=pos_{1..6}[deg] v=cur_{1..6}[mA]"
    add("--columns", nargs="+", metavar="WORD", help=text)
    add("--signal", metavar="KIND", choices=MEANINGS, help="what v is")
    text = f"torque constant [N m/A] of a torque-from-current, or {UNKNOWN}"
    add("--constant", type=_constants, metavar="K,K,..", help=text)
    add("--layout", metavar="L", choices=LAYOUTS, help=f"layout, if not recognised: {', '.join(LAYOUTS)}")
    add("--topic", metavar="T", help="topic of a bag")
    add("--episode", type=arguments.whole, metavar="N", help="episode of a LeRobot dataset, counted from 0")
    add("--joints", type=arguments.names, metavar="J,J,..", help="names of the joints in the log, base to flange")


def _constants(text: str) -> tuple[float, ...]:
    constants = () if text == UNKNOWN else arguments.numbers(text)
    if not all(constants):
        raise argparse.ArgumentTypeError("expected numbers that are not 0")
    return constants


def log_description(options: argparse.Namespace, joint_names: Sequence[str] | None) -> LogDescription:
    """Return the description of logs. `joint_names`, those of the arm, are the default.

    Raises `ScenarioError` if both file and options state the same; if the names are those of the arm in another
    order, or differ in number.
    """
    nothing = LogDescription()
    description, words = read_description(options.log_description, options.state), described(options.columns or ())
    if options.constant is not None:
        words = replace(words, v=replace(words.v, constant=options.constant))
    given = {"signal": options.signal, "layout": options.layout, "topic": options.topic, "joints": options.joints}
    given |= {name: getattr(words, name) for name in ("rate_hz", *"tqv")}
    given["only"] = () if options.episode is None else ((EPISODE, float(options.episode)),)
    changes = {name: value for name, value in given.items() if value != getattr(nothing, name)}
    for name in changes:
        known, own = getattr(description, name), changes[name]
        if isinstance(own, Channels) and known.stated.keys().isdisjoint(own.stated):
            changes[name] = replace(own, **known.stated)
        elif known != getattr(nothing, name):
            place = options.log_description or STATE
            raise ScenarioError(f"{place} says {name}, and so does the command line; state it once")
    description = replace(description, **changes)
    if joint_names is None:
        return description
    joints, known = description.joints or tuple(joint_names), ", ".join(joint_names)
    if joints != tuple(joint_names) and sorted(joints) == sorted(joint_names):
        raise ScenarioError(f"joints are given as {', '.join(joints)}; expected the model's order {known}")
    if len(joints) != len(joint_names):
        raise ScenarioError(f"{len(joints)} joints are given, the model has {len(joint_names)}: {known}")
    return replace(description, joints=joints)


def read_unrepaired(paths: Sequence[Path], description: LogDescription) -> "list[Recording]":
    """Return recordings for checks and repairs; the interpretation of a foreign log is reported immediately."""
    from ident.recordings.checks import check_clock
    from ident.recordings.files import read_log

    return recordings_of([read_log(path, description, check=check_clock) for path in paths])


def recordings_of(logs: "Sequence[Log]") -> "list[Recording]":
    """Return the recordings of logs; their interpretation is reported."""
    for log in logs:
        for note in log.notes:
            complain(f"{log.recording.name}: {note}")
    return [log.recording for log in logs]


def add_options(parser: argparse.ArgumentParser, kind: "type[Options]") -> None:
    """Add an option `--some-name` for every field `some_name` of an options dataclass. Every field has a default."""
    group = parser.add_argument_group()
    for field in fields(kind):
        default, choices = field.default, field.metadata.get(NAMES)
        measured = MEASURED in field.metadata
        group.add_argument(
            f"--{field.name.replace('_', '-')}",
            type=arguments.number_or_auto if measured else str if isinstance(default, str) else arguments.not_negative,
            default=default,
            choices=choices,
            metavar="NAME" if choices else "X",
            help=f"{_field_help(kind, field)} (default %(default)s)",
        )


def _field_help(kind: "type[Options]", field: "Field[object]") -> str:
    """Return the description of a field, with its choices."""
    text = attribute_docs(kind).get(field.name, "").replace("%", "%%")
    if NAMES in field.metadata:
        return f"{text}: {', '.join(field.metadata[NAMES])}"
    if MEASURED in field.metadata:
        return f"{text}; {arguments.AUTO}: {field.metadata[MEASURED]} is estimated and compensated"
    return text


def add_delay_argument(parser: argparse.ArgumentParser) -> None:
    """Declare the delay of currents, in place of that of the gains file."""
    from ident.observation.observation import ObserveOptions

    (delay,) = (each for each in fields(ObserveOptions) if MEASURED in each.metadata)
    text = f"{_field_help(ObserveOptions, delay)} (default: as in the gains file)"
    parser.add_argument("--current-delay", type=arguments.number_or_auto, metavar="X", help=text)


def chosen(kind: "type[Options]", options: argparse.Namespace) -> "Options":
    """Return the options dataclass from the command line; a value to be estimated has its default."""
    given = {field.name: getattr(options, field.name) for field in fields(kind)}
    return kind(**{name: value for name, value in given.items() if value != arguments.AUTO})


def policy_of(options: argparse.Namespace) -> "Policy":
    """Return the policy for logs: whether a delay of the currents is to be estimated."""
    from ident.preparation import DOUBTED

    return replace(DOUBTED, undelay=options.current_delay == arguments.AUTO)


def add_gains_argument(parser: argparse.ArgumentParser, *, needed: bool, text: str | None = None) -> None:
    """Declare the file of gains."""
    text = text or "drive gains, as identify --gains-out writes them"
    parser.add_argument("--gains", type=arguments.gains_file, required=needed, metavar="G", help=text)


def known_gains(given: Path | tuple[float, ...], arm: "Arm") -> "KnownGains":
    """Return the gains of an arm, from a file or from numbers, which are taken as exact; an error if of another arm."""
    from ident.estimation.known_gains import stated_gains
    from ident.support.errors import GainsError
    from scenarios.results.gains_file import read_gains

    if isinstance(given, Path):
        return read_gains(given).of(arm)
    if len(given) != arm.n:
        raise GainsError(f"--compare-with: {len(given)} gains, but robot {arm.name} has {arm.n} joints")
    return stated_gains(arm, given)
