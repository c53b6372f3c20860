"""Problem folder: recordings, assumed payloads and the robot's kinematics, without true values.

Files:

problem.json       payloads of the recordings, couplings, options
robot.xml, .urdf   links and joints; every inertia is 1, whatever the robot has
*.parquet          recordings
payload*.toml      payloads
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ident.estimation.problem import GainOptions
from ident.model.arm import Arm, load_arm, minimal_model
from ident.observation.observation import ObserveOptions
from ident.payload.payload import Payload, read_payload, write_payload
from ident.recordings.files import read_recording, write_recording
from ident.recordings.recording import Motion, Recording
from ident.support.errors import IdentificationError
from ident.support.naming import one_line, shown
from ident.support.options import options_from_table
from scenarios.support.errors import ScenarioError
from scenarios.support.texts import schema_line

if TYPE_CHECKING:  # the simulator is not needed by a process that only identifies
    from sim.robot import Robot

Options = TypeVar("Options")

PROBLEM = "problem.json"
MODELS = ("robot.xml", "robot.urdf")
LARGEST = 1_000_000
"""Largest number of bytes of a problem file."""
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=200)]
"""A file in the folder of the problem file."""
Number = Annotated[int, Field(ge=1)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class RobotTable(_Table):
    """The arm."""

    model: Name = Field(description="File in the same folder")
    couplings: tuple[tuple[Number, Number], ...] = Field(
        (), description="Joints, from 1, whose second motor turns with both"
    )


class MotionTable(_Table):
    """One motion and its payload; motions with the same payload file are one mounting."""

    recording: Name = Field(description="File in the same folder")
    payload: Name | None = Field(None, description="Payload file in the same folder; omitted for a bare flange")


class ProblemFile(_Table):
    """A problem: motions of one arm for the identification of its drive gains, in order of time within a mounting.

    `observe` and `gains` are the options of `rx90 identify` of those names; other methods may ignore them.
    """

    format: Literal[1] = Field(description="Version of the file format")
    robot: RobotTable = Field(description="The arm")
    motions: tuple[MotionTable, ...] = Field(min_length=1, description="Recordings, in order of time within a mounting")
    observe: dict[str, float | str] = Field({}, description="Options of `rx90 identify`: filters and rows")
    gains: dict[str, float | str] = Field({}, description="Options of `rx90 identify`: limits for accepting a gain")


Stated = TypeVar("Stated", bound=ProblemFile)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GivenProblem:
    """Input of a method.

    Attributes:
        folder: Its folder; None if it was not read from one.
        arm: The arm.
        motions: Recordings and payloads, as for `identify`.
        observing: Filters and thresholds.
        gains: Limits for accepting a gain.
    """

    folder: Path | None
    arm: Arm
    motions: tuple[Motion, ...]
    observing: ObserveOptions
    gains: GainOptions


def write_problem(
    folder: Path,
    robot: "Robot",
    couplings: Sequence[tuple[int, int]],
    motions: Sequence[Motion],
    *,
    observing: ObserveOptions,
    gains: GainOptions,
) -> None:
    """Write a problem into a new folder; motions with the same payload object share a payload file.

    The robot's model file has the kinematics; `couplings` are pairs of joints, from 1.

    Raises:
        OSError: If the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    problem = ProblemFile(
        format=1,
        robot=RobotTable(model=write_model(robot.model, robot.flange, folder), couplings=tuple(couplings)),
        motions=write_motions(motions, folder),
        observe=asdict(observing),
        gains=asdict(gains),
    )
    text = json.dumps(problem.model_dump(mode="json"), indent=2, allow_nan=False)
    (folder / PROBLEM).write_text(text + "\n", encoding="utf-8")


def motion_files(motions: int) -> tuple[str, ...]:
    """Return the names of files that `write_motions` may write."""
    return tuple(name for k in range(1, motions + 1) for name in (f"motion-{k}.parquet", f"payload-{k}.toml"))


def write_motions(
    motions: Sequence[Motion], folder: Path, names: Sequence[MotionTable] | None = None
) -> tuple[MotionTable, ...]:
    """Write recordings and payloads, by their `names` if given; motions with the same payload object share a file.

    Raises:
        OSError: If they cannot be written.
    """
    payloads = list(dict.fromkeys(id(motion.payload) for motion in motions if motion.payload))
    names = names or [
        MotionTable(
            recording=f"motion-{k}.parquet",
            payload=motion.payload and f"payload-{payloads.index(id(motion.payload)) + 1}.toml",
        )
        for k, motion in enumerate(motions, 1)
    ]
    for motion, name in zip(motions, names, strict=True):
        write_recording(motion.recording, folder / name.recording)
        if motion.payload is not None and name.payload is not None:
            write_payload(motion.payload, folder / name.payload, comment=schema_line("payload"))
    return tuple(names)


def write_model(model: Path, flange: str | None, folder: Path) -> str:
    """Write the kinematics of a robot to a file with one of the names `MODELS`, and return the name.

    Raises:
        OSError: If it cannot be written.
    """
    minimal = minimal_model(model, flange)
    name = MODELS[minimal.kind == "urdf"]
    (folder / name).write_text(minimal.text + "\n", encoding="utf-8")
    return name


def read_problem(folder: Path) -> GivenProblem:
    """Read a problem.

    Raises:
        ScenarioError: If the folder has no problem, or an invalid one.
        IdentificationError: If robot, recording or payload cannot be read.
    """
    path = folder / PROBLEM
    return given_problem(path, read_stated(path, ProblemFile), read_recording)


def given_problem(path: Path, stated: ProblemFile, read: Callable[[Path], Recording]) -> GivenProblem:
    """Return the problem of a file and the files in its folder.

    Raises:
        ScenarioError: If it is not valid.
        IdentificationError: If robot, recording or payload cannot be read.
    """

    def options(kind: type[Options], table: Mapping[str, object], key: str) -> Options:
        try:
            return options_from_table(kind, table)
        except IdentificationError as error:
            raise ScenarioError(f"{one_line(path)}: {key}: {error}") from error

    folder, payloads = path.parent, dict[str | None, Payload | None]({None: None})
    motions: list[Motion] = []
    for motion in stated.motions:
        if motion.payload is not None and motion.payload not in payloads:
            payloads[motion.payload] = read_payload(folder / motion.payload)
        motions.append(Motion(read(folder / motion.recording), payloads[motion.payload]))
    couplings = tuple((first - 1, second - 1) for first, second in stated.robot.couplings)
    return GivenProblem(
        folder=folder,
        arm=load_arm(folder / stated.robot.model, couplings),
        motions=tuple(motions),
        observing=options(ObserveOptions, stated.observe, "observe"),
        gains=options(GainOptions, stated.gains, "gains"),
    )


def read_stated(path: Path, kind: type[Stated]) -> Stated:
    """Return the content of a file, validated.

    Raises:
        ScenarioError: If it cannot be read or is not valid; the message says where.
    """
    try:
        if path.stat().st_size > LARGEST:
            raise ScenarioError(f"{one_line(path)}: larger than {LARGEST} bytes; not a problem file")
        return kind.model_validate_json(path.read_text(encoding="utf-8"), strict=True)
    except OSError as error:
        raise ScenarioError(f"{one_line(path)}: {error.strerror}; expected the file of a problem folder") from error
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{one_line(path)}: not UTF-8 text") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        what = first["msg"][0].lower() + first["msg"][1:]
        got = "" if first["type"] in ("missing", "json_invalid") else f", got {shown(first['input'])}"
        raise ScenarioError(f"{one_line(path)}: {where + ': ' if where else ''}{one_line(what)}{got}") from error
