"""Arguments that describe a foreign log: a file, or options."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments
from ident.recordings.formats.description import LogDescription
from ident.recordings.formats.description_files import UNKNOWN, described, read_description
from ident.recordings.formats.layouts import LAYOUTS
from ident.recordings.formats.lerobot import EPISODE
from ident.recordings.formats.meaning import MEANINGS
from scenarios.command_line.parser import complain
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from ident.recordings.files import Log
    from ident.recordings.recording import Recording


def add_log_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    group = parser.add_argument_group(
        "foreign logs",
        (
            "For logs whose columns are not t, q1.., v1.. in seconds, radians and drive units. The quantity "
            "of v cannot be inferred from its values; declare it: "
        )
        + "; ".join(f"{name}: {kind.words}" for name, kind in MEANINGS.items())
        + ".",
    )
    add = group.add_argument
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
    _check_names(said.joints, joint_names)
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


def _check_names(said: Sequence[str] | None, joint_names: Sequence[str]) -> None:
    if said is None or tuple(said) == tuple(joint_names):
        return
    if sorted(said) == sorted(joint_names):
        raise ScenarioError(
            f"joints are given as {', '.join(said)}; expected the model's order {', '.join(joint_names)}"
        )
    if len(said) != len(joint_names):
        raise ScenarioError(f"{len(said)} joints are given, the model has {len(joint_names)}: {', '.join(joint_names)}")


def _names(text: str) -> tuple[str, ...]:
    names = tuple(name.strip() for name in text.split(","))
    if not all(names) or len(set(names)) < len(names):
        raise argparse.ArgumentTypeError("expected names, each once, separated by commas")
    return names


def _constants(text: str) -> tuple[float, ...]:
    if text == UNKNOWN:
        return ()
    constants = tuple(arguments.number(word) for word in text.split(","))
    if not all(constants):
        raise argparse.ArgumentTypeError("expected numbers that are not 0")
    return constants
