"""Record of a result folder: all data to repeat the result, and digests.

`record.json` is a problem file (`scenarios.results.problem_folder`) with further keys. It is written last: a folder
without it is incomplete.
"""

import hashlib
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from itertools import groupby
from pathlib import Path
from typing import Literal, TypeVar

from pydantic import Field, JsonValue, ValidationError

from ident.estimation.gain_options import GainOptions
from ident.observation.observation import ObserveOptions
from ident.recordings.description import LogDescription
from ident.recordings.files import read_unchecked
from ident.recordings.recording import Recording
from ident.support.errors import IdentificationError
from ident.support.naming import one_line
from scenarios.rendering.result import ResultModel, to_json
from scenarios.results.problem_folder import GivenProblem, MotionTable, Name, ProblemFile, given_problem, read_stated
from scenarios.support.errors import ForeignProblem, ScenarioError

RECORD, RESULT = "record.json", "result.json"
Kind = Literal["run", "identification", "check", "bare"]
Kept = TypeVar("Kept", bound=ResultModel)


class RecordFile(ProblemFile):
    """A problem, its result, and the digests of the folder's files.

    `sources` are the original names of the recordings, `scenario` the name of the scenario of a run, and `scene` the
    digest of its picture (`scene_digest`). For a check, `payload` is the planned payload and `about` has the nominal
    gains [N m / drive unit]. For bare motions, `payload` is the planned payload and `believed` the file of given gains.
    """

    kind: Kind
    title: str
    command: str
    created: str
    sources: tuple[str, ...]
    scenario: str | None = None
    scene: str | None = None
    method: str | None = None
    options: dict[str, JsonValue] = Field(default_factory=dict)
    payload: Name | None = None
    about: tuple[float, ...] | None = None
    believed: Name | None = None
    versions: dict[str, str] = Field(default_factory=dict)
    files: dict[str, str] = Field(min_length=1)


def digests_of(folder: Path, names: Sequence[str]) -> dict[str, str]:
    """Return the SHA-256 of files of a folder.

    Raises:
        OSError: If one cannot be read.
    """
    return {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in names}


def now() -> str:
    """Return the current time for a record."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def write_record(record: RecordFile, folder: Path) -> None:
    """Write the record of a folder after its other files.

    Raises:
        OSError: If it cannot be written.
    """
    (folder / RECORD).write_text(to_json(record.model_dump(mode="json")) + "\n", encoding="utf-8")


def read_record(folder: Path) -> RecordFile:
    """Read the record of a folder, and check its files.

    Raises:
        ScenarioError: If there is no valid record; if a file is missing or changed.
    """
    try:
        record = read_stated(folder / RECORD, RecordFile)
    except ForeignProblem as error:
        raise ScenarioError(f"{error}; save it again with this version of rx90") from error
    for name, digest in record.files.items():
        path = folder / name
        try:
            (there,) = digests_of(folder, [name]).values()
        except OSError as error:
            raise ScenarioError(f"{one_line(path)}: {error.strerror}; {RECORD} names it: save it again") from error
        if there != digest:
            raise ScenarioError(f"{one_line(path)}: is not the file that {RECORD} names; save it again")
    if len(record.sources) != len(record.motions):
        raise ScenarioError(
            f"{one_line(folder / RECORD)}: {len(record.sources)} sources of {len(record.motions)} motions"
        )
    return record


def read_result(folder: Path, kind: type[Kept]) -> Kept:
    """Read the result of a folder.

    Raises:
        ScenarioError: If it is of another kind or version.
    """
    path = folder / RESULT
    try:
        return kind.model_validate_json(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, ValidationError) as error:
        first = one_line(" ".join(str(error).splitlines()[:3]))
        raise ScenarioError(
            f"{one_line(path)}: not a result of this version of rx90: {first}; save it again"
        ) from error


def recorded_problem(folder: Path, record: RecordFile) -> GivenProblem:
    """Return recordings, payloads and arm of a folder; recordings may have jumps and spikes.

    Raises:
        ScenarioError: If the record is not valid; if robot, recording or payload cannot be read.
    """

    def unchecked(path: Path) -> Recording:
        return read_unchecked(path, LogDescription()).recording

    try:
        return given_problem(folder / RECORD, record, unchecked)
    except IdentificationError as error:
        raise ScenarioError(f"{folder / RECORD}: the files of this folder cannot be read: {error}") from error


def read_saved(folder: Path, kind: type[Kept]) -> tuple[RecordFile, Kept, GivenProblem]:
    """Return record, result and problem of a folder; raises as `read_record` and those two."""
    record = read_record(folder)
    return record, read_result(folder, kind), recorded_problem(folder, record)


def motion_words(folder: Path, motions: Sequence[MotionTable]) -> list[str]:
    """Return arguments: recordings in order, those with a payload followed by its file."""
    words: list[str] = []
    for payload, carrying in groupby(motions, key=lambda motion: motion.payload):
        words += ["--unloaded" if payload is None else "--loaded", *(str(folder / each.recording) for each in carrying)]
        words += [] if payload is None else ["--payload", str(folder / payload)]
    return words


def coupling_words(couplings: Sequence[tuple[int, int]]) -> list[str]:
    """Return options for motors that turn with two joints, from 1."""
    return [word for first, second in couplings for word in ("--coupling", str(first), str(second))]


def option_words(observe: Mapping[str, object], gains: Mapping[str, object], own: Mapping[str, object]) -> list[str]:
    """Return options that differ from their defaults.

    `observe` and `gains` are by name, omitted ones have defaults; values None of the method's `own` have defaults.
    """
    words: list[str] = []
    for stated, defaults in ((observe, asdict(ObserveOptions())), (gains, asdict(GainOptions()))):
        for name, usual in defaults.items():
            value = stated.get(name, usual)
            flag, text = f"--{name.replace('_', '-')}", str(value)
            words += [] if value == usual else [f"{flag}={text}"] if text.startswith("-") else [flag, text]
    for name, value in own.items():
        words += [] if value is None else ["--option", f"{name}={value}"]
    return words


def identify_words(folder: Path, record: RecordFile) -> str:
    """Return the command that repeats the identification from a folder."""
    words = ["rx90", "identify", "--model", str(folder / record.robot.model), *motion_words(folder, record.motions)]
    words += [] if record.method is None else ["--method", record.method]
    words += [] if record.believed is None else ["--gains", str(folder / record.believed)]
    words += [] if record.kind != "bare" or record.payload is None else ["--if-loaded", str(folder / record.payload)]
    return shlex.join([*words, *_stated(record)])


def check_words(folder: Path, record: RecordFile) -> str:
    """Return the command that repeats the check; nominal gains are those of the robot, not in a file."""
    bare, loaded = (
        [str(folder / m.recording) for m in record.motions if (m.payload is None) == b] for b in (True, False)
    )
    words = ["rx90", "check", str(folder / record.robot.model), *bare]
    if loaded:
        words += ["--loaded", *loaded]
    words += [] if record.payload is None else ["--payload", str(folder / record.payload)]
    return shlex.join([*words, *_stated(record)])


def _stated(record: RecordFile) -> list[str]:
    options = option_words(record.observe, record.gains, record.options)
    return [*coupling_words(record.robot.couplings), *options]
