"""Folder of a saved result: recordings, payloads, arm, result, rows of the fit, and a record of how to repeat it.

`record.json` is a problem file (`scenarios.results.problem_folder`) with further keys, among them the digests of all
other files. It is written last: a folder without it is incomplete.
"""

import hashlib
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeVar, cast

from pydantic import BaseModel, Field, JsonValue, ValidationError

from ident.estimation.problem import GainOptions
from ident.observation.observation import ObserveOptions
from ident.payload.payload import Payload, payload_to_table, read_payload, write_payload
from ident.recordings.files import read_log
from ident.support.errors import IdentificationError
from ident.support.naming import one_line
from scenarios.rendering.content import Heading, Line, Paragraph, Part, pairs_table
from scenarios.rendering.result import ResultModel, to_json
from scenarios.rendering.wording import many
from scenarios.results.fit import ROWS, Fit, write_fit
from scenarios.results.problem_folder import (
    MODELS,
    GivenProblem,
    MotionTable,
    Name,
    ProblemFile,
    given_problem,
    motion_files,
    problem_file,
    read_json,
    write_json,
)
from scenarios.support.digests import with_digest, without_digest
from scenarios.support.errors import ScenarioError
from scenarios.support.versions import versions
from sim.tables import fault_of, validated_table

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

RECORD, RESULT = "record.json", "result.json"
DAMAGED = "damaged, or written by another version of rx90"
Kind = Literal["run", "identification", "check", "bare"]
Kept = TypeVar("Kept", bound=BaseModel)
PLANNED = "payload.toml"
"""Name of the file of a planned payload."""
GIVEN_GAINS = ("gains.toml", "gains.json")
"""Names of the file of given gains."""


class RecordFile(ProblemFile):
    """A problem, its result, and the digests of the folder's files.

    `sources` are the original names of the recordings, `scenario` the name of the scenario of a run, and `scene` the
    digest of its picture (`scene_digest`). For a check, `payload` is the planned payload; for bare motions, `believed`
    is the file of given gains.
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
    believed: Name | None = None
    versions: dict[str, str] = Field(default_factory=dict)
    files: dict[str, str] = Field(min_length=1)


def digests_of(folder: Path, names: Sequence[str]) -> dict[str, str]:
    """Return the SHA-256 of files of a folder."""
    return {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in names}


def saved_files(motions: int) -> tuple[str, ...]:
    """Return the names of files that `save_result` may write for a number of recordings."""
    return (*motion_files(motions), PLANNED, *GIVEN_GAINS, *MODELS, RESULT, ROWS, RECORD)


def save_result(
    folder: Path,
    result: ResultModel,
    origin: GivenProblem,
    *,
    kind: Kind,
    title: str,
    command: str,
    names: Sequence[MotionTable] | None = None,
    payload: Payload | None = None,
    believed: Path | None = None,
    fit: Fit | None = None,
    more: Sequence[str] = (),
    scenario: str | None = None,
    scene: str | None = None,
) -> None:
    """Write recordings, payloads, the arm, the result and its rows, and the record.

    `names` are the files of the recordings, numbered ones if None; `more` are further files of the folder; `title` to
    `scene` are as in `RecordFile`.
    """
    stated, written = problem_file(folder, origin, names), [RESULT, *more]
    write_json(folder / RESULT, result)
    if fit is not None:
        write_fit(fit, folder)
        written.append(ROWS)
    given, planned = None, None if payload is None else PLANNED
    if payload is not None:
        write_payload(payload, folder / PLANNED)
    if believed is not None:
        given = GIVEN_GAINS[believed.suffix.lower() == ".json"]
        (folder / given).write_bytes(believed.read_bytes())
    written += [name for name in (planned, given) if name is not None]
    options = cast("DataclassInstance | None", origin.options)
    own, usual = ({}, {}) if options is None else (asdict(options), asdict(type(options)()))
    record = RecordFile(
        **dict(stated),
        kind=kind,
        title=title,
        command=command,
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        sources=tuple(each.recording for each in names or ()) or tuple(each.recording.name for each in origin.motions),
        method=origin.method,
        options={name: value for name, value in own.items() if value != usual[name]},
        payload=planned,
        believed=given,
        scenario=scenario,
        scene=scene,
        versions=versions(),
        files=digests_of(folder, [*stated.written, *written]),
    )
    values = with_digest(record.model_dump(mode="json"))
    (folder / RECORD).write_text(to_json(values) + "\n", encoding="utf-8")


def read_record(folder: Path) -> RecordFile:
    """Read the record of a folder; raises `ScenarioError` if there is no valid one, or a file is missing or changed."""
    again, place = "save it again with this version of rx90", one_line(folder / RECORD)
    try:
        record = validated_table(RecordFile, without_digest(read_json(folder / RECORD), place), place, ScenarioError)
    except ScenarioError as error:
        raise ScenarioError(f"{error}; {again}") from error
    check_files(folder, record.files, RECORD)
    if len(record.sources) != len(record.motions):
        raise ScenarioError(f"{place}: {len(record.sources)} sources of {len(record.motions)} motions")
    return record


def read_result(folder: Path, kind: type[Kept], name: str = RESULT, otherwise: str = DAMAGED) -> Kept:
    """Read the result in a file of a folder; raises `ScenarioError` if it is not of this kind but is `otherwise`."""
    path = folder / name
    try:
        return kind.model_validate(without_digest(read_json(path), path))
    except ValidationError as error:
        raise ScenarioError(f"{one_line(path)}: {otherwise}: {fault_of(error)}") from error


def check_files(folder: Path, files: Mapping[str, str], document: str) -> None:
    """Check the SHA-256 of files of a folder, by name, as a document states them."""
    for name, digest in files.items():
        path = folder / name
        try:
            same = digests_of(folder, [name])[name] == digest
        except OSError as error:
            raise ScenarioError(f"{one_line(path)}: {error.strerror}; {document} names it: save it again") from error
        if not same:
            raise ScenarioError(f"{one_line(path)}: is not the file that {document} names; save it again")


def recorded_problem(folder: Path, record: RecordFile) -> GivenProblem:
    """Return recordings, payloads and arm of a folder; recordings may have jumps and spikes."""
    try:
        return given_problem(folder / RECORD, record, lambda path: read_log(path, check=None).recording)
    except IdentificationError as error:
        raise ScenarioError(f"{folder / RECORD}: the files of this folder cannot be read: {error}") from error


def identify_words(folder: Path, motions: Sequence[MotionTable]) -> list[str]:
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
    usual, words = asdict(ObserveOptions()) | asdict(GainOptions()), list[str]()
    for name, value in {**observe, **gains}.items():
        if value != usual.get(name, value):
            flag, text = f"--{name.replace('_', '-')}", str(value)
            words += [f"{flag}={text}"] if text.startswith("-") else [flag, text]
    for name, value in own.items():
        words += [] if value is None else ["--option", f"{name}={value}"]
    return words


def again(folder: Path, record: RecordFile) -> str:
    """Return the command that repeats an identification or check from a folder; a check has no file of its gains."""
    model = str(folder / record.robot.model)
    if record.kind == "check":
        bare = [str(folder / each.recording) for each in record.motions if each.payload is None]
        loaded = [str(folder / each.recording) for each in record.motions if each.payload is not None]
        words = ["rx90", "check", model, *bare, *(["--loaded", *loaded] if loaded else [])]
        words += [] if record.payload is None else ["--payload", str(folder / record.payload)]
    else:
        words = ["rx90", "identify", "--model", model, *identify_words(folder, record.motions)]
        words += [] if record.method is None else ["--method", record.method]
        words += [] if record.believed is None else ["--gains", str(folder / record.believed)]
    words += coupling_words(record.robot.couplings)
    return shlex.join([*words, *option_words(record.observe, record.gains, record.options)])


def origin_parts(folder: Path, record: RecordFile, given: GivenProblem, seed: int | None = None) -> list[Part]:
    """Return the assumptions of a saved result, and how to repeat it."""

    def listed(options: Mapping[str, object]) -> str:
        values = {name: f"({listed(each)})" if isinstance(each, Mapping) else each for name, each in options.items()}
        return ", ".join(f"{name} {each}" for name, each in values.items())

    robot, pairs = record.robot, zip(record.motions, given.motions, strict=True)
    payloads = {stated.payload: each.payload for stated, each in pairs if stated.payload}
    if record.payload is not None and not payloads:  # of a loaded log it is the same
        payloads[record.payload] = read_payload(folder / record.payload)
    coupled = [f"motor {second} turns by the sum of joints {first} and {second}" for first, second in robot.couplings]
    if robot.transmission is not None:
        coupled = [f"transmission = {list(map(list, robot.transmission))}"]
    mounted = {f"payload {name} [SI units]": listed(payload_to_table(x)) for name, x in payloads.items() if x}
    method = {} if record.method is None else {"method": f"{record.method} {listed(record.options)}".strip()}
    assumed = method | {
        "arm": f"{given.arm.name}: {given.arm.n} joints, kinematics from the model file; its inertias are not used",
        "coupled motors": "; ".join(coupled) or "none",
        **mounted,
        "filters and rows": listed(record.observe),
        "limits for accepting a gain": listed(record.gains),
    }
    about = {} if seed is None else {"Seed": str(seed)}
    commands = {"Original command": record.command} if record.command else {}
    if robot.transmission is None:  # which only a robot file states
        commands["The same from these files"] = again(folder, record)
    parts: list[Part] = [Heading("What was assumed"), pairs_table("What", "Value", assumed)]
    return parts + repeated(commands, about, record.versions, record.files)


def repeated(
    commands: Mapping[str, str], about: Mapping[str, str], versions: Mapping[str, object], files: Mapping[str, str] = {}
) -> list[Part]:
    """Return the commands, versions and digests of files that are needed to reproduce the numbers."""
    parts: list[Part] = [Heading("How to repeat it")]
    for what, command in commands.items():
        parts += [Paragraph(f"{what}:"), Line(command)]
    named = {"Versions": ", ".join(f"{name} {version}" for name, version in versions.items())} if versions else {}
    parts.append(pairs_table("What", "Value", {**about, **named}))
    if files:
        parts.append(pairs_table("File", "SHA-256", files, shown=0, rest=f"SHA-256 of {many(len(files), 'file')}"))
    return parts
