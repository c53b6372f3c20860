"""Folder of `--save` of an identification or check: logs, result and record."""

from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path

from pydantic import JsonValue

from ident.estimation.gain_options import GainOptions
from ident.observation.observation import ObserveOptions
from ident.payload.payload import Payload, write_payload
from ident.recordings.motion import Motion
from scenarios.experiments.robots import NamedRobot
from scenarios.rendering.result import ResultModel, to_json
from scenarios.results.fit_rows import ROWS, Fit, write_fit
from scenarios.results.problem_folder import MODELS, RobotTable, motion_files, write_model, write_motions
from scenarios.results.record import RECORD, RESULT, Kind, RecordFile, digests_of, now, write_record
from scenarios.support.versions import versions

ASKED = "payload.toml"
"""Name of the file of a planned payload."""
BELIEVED = {".toml": "gains.toml", ".json": "gains.json"}
"""Name of the file of given gains, by its ending."""


def log_files(motions: int) -> tuple[str, ...]:
    """Return the names of files that may be written for a number of recordings."""
    return (*motion_files(motions), ASKED, *BELIEVED.values(), *MODELS, RESULT, ROWS, RECORD)


def save_logs(
    folder: Path,
    *,
    kind: Kind,
    title: str,
    command: str,
    robot: NamedRobot,
    motions: Sequence[Motion],
    observing: ObserveOptions,
    gains: GainOptions,
    result: ResultModel,
    method: str | None = None,
    options: object | None = None,
    payload: Payload | None = None,
    about: tuple[float, ...] | None = None,
    believed: Path | None = None,
    fit: Fit | None = None,
) -> None:
    """Write recordings, payloads, the arm, the result and its rows, and the record.

    Args:
        folder: The folder.
        kind: Kind of the result.
        title: Title of its report.
        command: The command.
        robot: The robot.
        motions: Recordings and payloads, in order.
        observing: Filters and thresholds.
        gains: Limits for accepting a gain.
        result: The result.
        method: Method of an identification.
        options: Options of the method, a dataclass.
        payload: The planned payload of a check or of bare motions.
        about: Nominal gains of a check [N m / drive unit].
        believed: File of gains given with bare motions.
        fit: Rows of the fit.

    Raises:
        OSError: If the folder cannot be written.
    """
    tables, arm = write_motions(motions, folder), write_model(robot.model, robot.flange, folder)
    (folder / RESULT).write_text(to_json(result.model_dump(mode="json")) + "\n", encoding="utf-8")
    named = [name for each in tables for name in (each.recording, each.payload) if name is not None]
    named += [arm, RESULT]
    if payload is not None:
        write_payload(payload, folder / ASKED)
        named.append(ASKED)
    if fit is not None:
        write_fit(fit, folder)
        named.append(ROWS)
    given = None if believed is None else BELIEVED[believed.suffix.lower()]
    if believed is not None and given is not None:
        (folder / given).write_bytes(believed.read_bytes())
        named.append(given)
    record = RecordFile(
        format=1,
        kind=kind,
        title=title,
        command=command,
        created=now(),
        sources=tuple(each.recording.name for each in motions),
        robot=RobotTable(model=arm, couplings=tuple((i + 1, j + 1) for i, j in robot.structure.arm.couplings)),
        motions=tables,
        observe=asdict(observing),
        gains=asdict(gains),
        method=method,
        options=_changed(options),
        payload=None if payload is None else ASKED,
        about=about,
        believed=given,
        versions=versions(),
        files=digests_of(folder, list(dict.fromkeys(named))),
    )
    write_record(record, folder)


def _changed(options: object | None) -> dict[str, JsonValue]:
    """Return the fields of an options dataclass that differ from their defaults."""
    if options is None:
        return {}
    defaults = type(options)()
    names = [field.name for field in fields(options)]  # pyright: ignore[reportArgumentType]
    return {name: getattr(options, name) for name in names if getattr(options, name) != getattr(defaults, name)}
