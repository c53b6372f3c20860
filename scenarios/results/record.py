"""Folder of a saved result: recordings, payloads, arm, result, rows of the fit, and a record of how to repeat it.

`record.json` is a problem file (`scenarios.results.problem_folder`) with further keys, among them the digests of all
other files. It is written last: a folder without it is incomplete.
"""

import hashlib
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from datetime import UTC, datetime
from itertools import groupby
from pathlib import Path
from typing import Literal, TypeVar

from pydantic import Field, JsonValue, ValidationError

from ident.estimation.gain_options import GainOptions
from ident.model.arm import Arm
from ident.observation.observation import ObserveOptions
from ident.payload.payload import Payload, write_payload
from ident.recordings.description import LogDescription
from ident.recordings.files import read_unchecked
from ident.recordings.recording import Motion, Recording
from ident.support.errors import IdentificationError
from ident.support.naming import one_line
from scenarios.rendering.result import ResultModel, to_json
from scenarios.results.fit_rows import ROWS, Fit, write_fit
from scenarios.results.problem_folder import (
    MODELS,
    GivenProblem,
    MotionTable,
    Name,
    ProblemFile,
    RobotTable,
    given_problem,
    motion_files,
    read_stated,
    write_model,
    write_motions,
)
from scenarios.support.errors import ScenarioError
from scenarios.support.versions import versions

RECORD, RESULT = "record.json", "result.json"
Kind = Literal["run", "identification", "check", "bare"]
Kept = TypeVar("Kept", bound=ResultModel)
PLANNED = "payload.toml"
"""Name of the file of a planned payload."""
GIVEN_GAINS = {".toml": "gains.toml", ".json": "gains.json"}
"""Name of the file of given gains, by its ending."""


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


def saved_files(motions: int) -> tuple[str, ...]:
    """Return the names of files that `save_result` may write for a number of recordings."""
    return (*motion_files(motions), PLANNED, *GIVEN_GAINS.values(), *MODELS, RESULT, ROWS, RECORD)


def save_result(
    folder: Path,
    result: ResultModel,
    *,
    kind: Kind,
    title: str,
    command: str,
    model: Path,
    flange: str | None,
    arm: Arm,
    motions: Sequence[Motion],
    names: Sequence[MotionTable] | None = None,
    observing: ObserveOptions,
    gains: GainOptions,
    method: str | None = None,
    options: object | None = None,
    payload: Payload | None = None,
    about: tuple[float, ...] | None = None,
    believed: Path | None = None,
    fit: Fit | None = None,
    more: Sequence[str] = (),
    scenario: str | None = None,
    scene: str | None = None,
) -> None:
    """Write recordings, payloads, the arm, the result and its rows, and the record.

    Args:
        folder: The folder.
        result: The result.
        kind: Kind of the result.
        title: Title of its page.
        command: The command.
        model: Model file.
        flange: Last body of the arm, None if all joints of the model belong to it.
        arm: The arm.
        motions: Recordings and payloads, in order.
        names: Their files; numbered ones if None.
        observing: Filters and thresholds.
        gains: Limits for accepting a gain.
        method: Method of an identification.
        options: Options of the method, a dataclass.
        payload: The planned payload of a check or of bare motions.
        about: Nominal gains of a check [N m / drive unit].
        believed: File of gains given with bare motions.
        fit: Rows of the fit.
        more: Further files of the folder.
        scenario: Name of the scenario of a run.
        scene: Digest of its picture.

    Raises:
        OSError: If the folder cannot be written.
    """
    tables, minimal = write_motions(motions, folder, names), write_model(model, flange, folder)
    (folder / RESULT).write_text(to_json(result.model_dump(mode="json")) + "\n", encoding="utf-8")
    files = [name for each in tables for name in (each.recording, each.payload) if name is not None]
    files += [minimal, RESULT, *more]
    if payload is not None:
        write_payload(payload, folder / PLANNED)
        files.append(PLANNED)
    if fit is not None:
        write_fit(fit, folder)
        files.append(ROWS)
    given = None if believed is None else GIVEN_GAINS[believed.suffix.lower()]
    if believed is not None and given is not None:
        (folder / given).write_bytes(believed.read_bytes())
        files.append(given)
    record = RecordFile(
        format=1,
        kind=kind,
        title=title,
        command=command,
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        sources=tuple(each.recording.name for each in motions) if names is None else tuple(n.recording for n in names),
        robot=RobotTable(model=minimal, couplings=tuple((i + 1, j + 1) for i, j in arm.couplings)),
        motions=tables,
        observe=asdict(observing),
        gains=asdict(gains),
        method=method,
        options=_changed(options),
        payload=None if payload is None else PLANNED,
        about=about,
        believed=given,
        scenario=scenario,
        scene=scene,
        versions=versions(),
        files=digests_of(folder, list(dict.fromkeys(files))),
    )
    (folder / RECORD).write_text(to_json(record.model_dump(mode="json")) + "\n", encoding="utf-8")


def _changed(options: object | None) -> dict[str, JsonValue]:
    """Return the fields of an options dataclass that differ from their defaults."""
    if options is None:
        return {}
    defaults = type(options)()
    names = [field.name for field in fields(options)]  # pyright: ignore[reportArgumentType]
    return {name: getattr(options, name) for name in names if getattr(options, name) != getattr(defaults, name)}


def read_record(folder: Path) -> RecordFile:
    """Read the record of a folder, and check its files.

    Raises:
        ScenarioError: If there is no valid record; if a file is missing or changed.
    """
    try:
        record = read_stated(folder / RECORD, RecordFile)
    except ScenarioError as error:
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
