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
from typing import Annotated, Literal, TypeVar

import numpy as np
from pydantic import BaseModel, Field

from ident.estimation.problem import GainOptions
from ident.model.arm import Arm, load_arm, minimal_model
from ident.observation.observation import ObserveOptions
from ident.payload.payload import Payload, read_payload, write_payload
from ident.recordings.files import read_recording, write_recording
from ident.recordings.recording import Motion, Recording
from ident.support.errors import IdentificationError
from ident.support.files import LARGEST, read_bytes
from ident.support.naming import one_line
from ident.support.options import options_from_table
from scenarios.rendering.result import to_json
from scenarios.support.errors import ScenarioError
from sim.tables import Table, validated_table

Options = TypeVar("Options")

PROBLEM = "problem.json"
MODELS = ("robot.xml", "robot.urdf")
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=200)]
"""A file in the folder of the problem file."""
Number = Annotated[int, Field(ge=1)]


class RobotTable(Table):
    """The arm."""

    model: Name  # file in the same folder
    couplings: tuple[tuple[Number, Number], ...] = ()  # joints, from 1, whose second motor turns with both
    transmission: tuple[tuple[float, ...], ...] | None = Field(
        None,
        description="Ratios of positions, rows of A, q_motor = A q, if motors turn with several joints; null if not",
    )


class MotionTable(Table):
    """One motion and its payload; motions with the same payload file are one mounting."""

    recording: Name  # file in the same folder
    payload: Name | None = None  # payload file in the same folder; omitted for a bare flange


class ProblemFile(Table):
    """A problem: motions of one arm for the identification of its drive gains, in order of time within a mounting.

    `observe` and `gains` are the options of `rx90 identify` of those names; other methods may ignore them.
    """

    format: Literal[1]  # version of the file format
    robot: RobotTable  # the arm
    motions: tuple[MotionTable, ...] = Field(min_length=1)  # recordings, in order of time within a mounting
    observe: dict[str, float | str] = Field({})  # options of `rx90 identify`: filters and rows
    gains: dict[str, float | str] = Field({})  # options of `rx90 identify`: limits for accepting a gain

    @property
    def written(self) -> list[str]:
        """Names of the other files of the problem."""
        motions = (name for each in self.motions for name in (each.recording, each.payload) if name is not None)
        return [*dict.fromkeys(motions), self.robot.model]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GivenProblem:
    """Motions of an arm, and how its gains are identified: the input of a method, and the origin of a result."""

    model: Path
    flange: str | None = None  # last body of the arm, None if all joints belong to it
    arm: Arm
    motions: Sequence[Motion]
    observing: ObserveOptions
    gains: GainOptions
    method: str | None = None
    options: object | None = None  # of the method, a dataclass

    @property
    def folder(self) -> Path:
        """Folder of the model file, which is that of a problem that was read."""
        return self.model.parent

    @property
    def payloads(self) -> list[Payload]:
        """Payload of each mounting, whose motions have the same object."""
        return list({id(each.payload): each.payload for each in self.motions if each.payload is not None}.values())

    def mounting(self, motion: Motion) -> int | None:
        """Return the number of a motion's payload, from 1; None for a bare flange."""
        return next((k for k, each in enumerate(self.payloads, 1) if each is motion.payload), None)


def motion_files(motions: int) -> tuple[str, ...]:
    """Return the names that `problem_file` gives to the files of a number of motions."""
    return tuple(name for k in range(1, motions + 1) for name in (f"motion-{k}.parquet", f"payload-{k}.toml"))


def problem_file(folder: Path, problem: GivenProblem, names: Sequence[MotionTable] | None = None) -> ProblemFile:
    """Write recordings, payloads and the arm's kinematics, and return the content of the problem file.

    Motions have the files of `names`, numbered ones if None; those with the same payload object share its file.
    """
    numbers = [(motion.payload, problem.mounting(motion)) for motion in problem.motions]
    names = names or [
        MotionTable(recording=f"motion-{k}.parquet", payload=payload and f"payload-{number}.toml")
        for k, (payload, number) in enumerate(numbers, 1)
    ]
    for motion, name in zip(problem.motions, names, strict=True):
        write_recording(motion.recording, folder / name.recording)
        if motion.payload is not None and name.payload is not None:
            write_payload(motion.payload, folder / name.payload)
    minimal, A = minimal_model(problem.model, problem.flange), problem.arm.transmission
    model = MODELS[minimal.kind == "urdf"]
    (folder / model).write_text(minimal.text + "\n", encoding="utf-8")
    robot = RobotTable(
        model=model,
        couplings=tuple((i + 1, j + 1) for i, j in problem.arm.couplings),
        transmission=None if A is None else tuple(map(tuple, A.tolist())),
    )
    observe, gains = asdict(problem.observing), asdict(problem.gains)
    return ProblemFile(format=1, robot=robot, motions=tuple(names), observe=observe, gains=gains)


def write_problem(folder: Path, problem: GivenProblem) -> None:
    """Write a problem into a new folder."""
    folder.mkdir(parents=True, exist_ok=True)
    write_json(folder / PROBLEM, problem_file(folder, problem))


def write_json(path: Path, content: BaseModel) -> None:
    """Write a model as JSON."""
    path.write_text(to_json(content.model_dump(mode="json")) + "\n", encoding="utf-8")


def read_problem(folder: Path) -> GivenProblem:
    """Read a problem."""
    path = folder / PROBLEM
    stated = validated_table(ProblemFile, read_json(path), one_line(path), ScenarioError)
    return given_problem(path, stated, read_recording)


def given_problem(path: Path, stated: ProblemFile, read: Callable[[Path], Recording]) -> GivenProblem:
    """Return the problem of a file and the files in its folder."""

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
    model, A = folder / stated.robot.model, stated.robot.transmission
    couplings = tuple((first - 1, second - 1) for first, second in stated.robot.couplings)
    return GivenProblem(
        model=model,
        arm=load_arm(model, couplings, transmission=None if A is None else np.array(A)),
        motions=tuple(motions),
        observing=options(ObserveOptions, stated.observe, "observe"),
        gains=options(GainOptions, stated.gains, "gains"),
    )


def read_json(path: Path) -> object:
    """Parse a JSON file."""
    content, place = read_bytes(path, most_bytes=LARGEST, error=ScenarioError), one_line(path)
    try:
        return json.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError as fault:
        raise ScenarioError(f"{place}: not JSON: byte {fault.start} is not UTF-8") from fault
    except json.JSONDecodeError as fault:
        at = f"line {fault.lineno}, column {fault.colno}"
        raise ScenarioError(f"{place}: not JSON: {one_line(fault.msg)} at {at}") from fault
    except (RecursionError, ValueError) as fault:
        raise ScenarioError(f"{place}: JSON that cannot be read: {one_line(fault)}") from fault
