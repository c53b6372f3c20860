"""Writing of gains files: identified gains with their provenance."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from pydantic import JsonValue

from ident.estimation.estimate import GainEstimate, IdentifiedGain, JointResult, RefusedGain
from ident.estimation.known_gains import estimated_gains
from ident.model.arm import Arm
from ident.observation.observation import ObserveOptions
from ident.payload.payload import payload_to_table
from ident.recordings.recording import Motion, Recording
from ident.support.options import option_types
from scenarios.experiments.gains_file import (
    SLIDING,
    TURNING,
    GainEntry,
    GainsFile,
    ModelEntry,
    OptionsEntry,
    RecordingEntry,
)
from scenarios.rendering.result import to_json
from scenarios.support.texts import schema_line, toml_value
from scenarios.support.versions import versions


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Origin:
    """Provenance of gains; `options` are those of the method, a dataclass."""

    model: Path
    arm: Arm
    motions: Sequence[Motion]
    options: object
    observing: ObserveOptions


def gains_file(estimate: GainEstimate, origin: Origin) -> GainsFile:
    """Return the gains file of an estimate."""
    known = estimated_gains(estimate)
    payloads = {id(each.payload): each.payload for each in origin.motions if each.payload is not None}
    number = {key: k for k, key in enumerate(payloads, 1)}
    return GainsFile.model_validate(
        {
            "created": datetime.now(UTC).isoformat(timespec="seconds"),
            "robot": origin.arm.name,
            "method": estimate.method,
            "gains": tuple(
                _entry(j, joint, turning=bool(origin.arm.revolute[j])) for j, joint in enumerate(estimate.joints)
            ),
            "covariance": known.covariance.tolist(),
            "options": OptionsEntry(
                method=_options(origin.options), observe=_options(origin.observing), gains=_options(estimate.options)
            ),
            "model": ModelEntry(name=origin.model.name, sha256=hashlib.sha256(origin.model.read_bytes()).hexdigest()),
            "recordings": tuple(
                RecordingEntry(
                    name=Path(each.recording.name).name,
                    sha256=recording_digest(each.recording),
                    payload=number.get(id(each.payload)),
                    largest=tuple(np.abs(each.recording.v).max(axis=0).tolist()),
                )
                for each in origin.motions
            ),
            "payloads": tuple(payload_to_table(each) for each in payloads.values()),
            "versions": versions(),
        }
    )


def recording_digest(recording: Recording) -> str:
    """Return the SHA-256 of the samples, independent of the file format."""
    whole = hashlib.sha256()
    for part in (recording.t, recording.q, recording.v):
        whole.update(np.ascontiguousarray(part, dtype="<f8").tobytes())
    return whole.hexdigest()


def gains_text(file: GainsFile, ending: str) -> str:
    """Return the content of a gains file, JSON for `.json`, otherwise TOML; unknown values are omitted."""
    table = file.model_dump(mode="json", exclude_none=True)
    if ending.lower() == ".json":
        return to_json(table) + "\n"
    plain = [f"{key} = {toml_value(value)}" for key, value in table.items() if not _is_table(value)]
    lines = [schema_line("gains"), *plain]
    for key, value in table.items():
        if not _is_table(value):
            continue
        for each in value if isinstance(value, list) else [value]:
            lines += ["", f"[[{key}]]" if isinstance(value, list) else f"[{key}]"]
            lines += [f"{name} = {toml_value(inner)}" for name, inner in each.items()]
    return "\n".join(lines) + "\n"


def _entry(j: int, joint: JointResult, *, turning: bool) -> GainEntry:
    common = {"joint": j + 1, "name": joint.joint, "unit": TURNING if turning else SLIDING}
    if isinstance(joint, RefusedGain):
        return GainEntry.model_validate({**common, "identifiable": False, "reason": joint.reason})
    return GainEntry.model_validate({**common, **_numbers(joint)})


def _numbers(gain: IdentifiedGain) -> dict[str, float]:
    return {
        "estimate": gain.value,
        "std": gain.std,
        "residual_std": gain.residual_std,
        "payload_std": gain.payload_std,
        "model_std": gain.model_std,
    }


def _options(options: object) -> dict[str, JsonValue]:
    """Return the fields of an options dataclass that have a value."""
    values = {name: getattr(options, name) for name in option_types(type(options))}
    return {name: value for name, value in values.items() if value is not None}


def _is_table(value: object) -> bool:
    return isinstance(value, Mapping) or (isinstance(value, list) and bool(value) and isinstance(value[0], Mapping))
