"""Files of identified gains: the gains file with its origin, ROS 2 parameters, and torques by these gains."""

import hashlib
import json
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from pydantic import JsonValue

from ident.estimation.estimate import GainEstimate, IdentifiedGain
from ident.estimation.joint_torque import JointTorque
from ident.estimation.known_gains import estimated_gains
from ident.payload.payload import payload_to_table
from ident.recordings.recording import Recording
from ident.support.options import option_types
from scenarios.experiments.gains_file import SLIDING, TURNING, GainsFile
from scenarios.rendering.result import to_json
from scenarios.results.record import Origin
from scenarios.support.texts import schema_line, toml_value
from scenarios.support.versions import versions

NUMBERS = ("std", "residual_std", "payload_std", "model_std")
DEVIATIONS = 2.0
"""Half-width of the interval of a torque, in standard deviations."""


def gains_file(estimate: GainEstimate, origin: Origin) -> GainsFile:
    """Return the gains file of an estimate."""
    payloads = {id(each.payload): each.payload for each in origin.motions if each.payload is not None}
    number = {key: k for k, key in enumerate(payloads, 1)}
    gains: list[dict[str, object]] = []
    for j, joint in enumerate(estimate.joints):
        entry = {"joint": j + 1, "name": joint.joint, "unit": TURNING if origin.arm.revolute[j] else SLIDING}
        if isinstance(joint, IdentifiedGain):
            gains.append({**entry, "estimate": joint.value, **{name: getattr(joint, name) for name in NUMBERS}})
        else:
            gains.append({**entry, "identifiable": False, "reason": joint.reason})

    def stated(options: object) -> dict[str, JsonValue]:
        values = {name: getattr(options, name) for name in option_types(type(options))}
        return {name: value for name, value in values.items() if value is not None}

    return GainsFile.model_validate(
        {
            "created": datetime.now(UTC).isoformat(timespec="seconds"),
            "robot": origin.arm.name,
            "method": estimate.method,
            "gains": tuple(gains),
            "covariance": estimated_gains(estimate).covariance.tolist(),
            "options": {
                "method": stated(origin.options),
                "observe": stated(origin.observing),
                "gains": stated(estimate.options),
            },
            "model": {"name": origin.model.name, "sha256": hashlib.sha256(origin.model.read_bytes()).hexdigest()},
            "recordings": tuple(
                {
                    "name": Path(each.recording.name).name,
                    "sha256": recording_digest(each.recording),
                    "payload": number.get(id(each.payload)),
                    "largest": tuple(np.abs(each.recording.v).max(axis=0).tolist()),
                }
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
    plain, tables = list[str](), list[str]()
    for key, value in table.items():
        several = isinstance(value, list) and bool(value) and isinstance(value[0], Mapping)
        if not several and not isinstance(value, Mapping):
            plain.append(f"{key} = {toml_value(value)}")
        for each in value if several else [value] if isinstance(value, Mapping) else ():
            tables += ["", f"[[{key}]]" if several else f"[{key}]"]
            tables += [f"{name} = {toml_value(inner)}" for name, inner in each.items()]
    return "\n".join([schema_line("gains"), *plain, *tables]) + "\n"


def ros_parameters(file: GainsFile, names: tuple[str, ...]) -> str:
    """Return a ROS 2 parameter file (YAML) of torque constants; refused joints are named in a comment only."""
    named = [(json.dumps(name), entry) for name, entry in zip(names, file.gains, strict=True)]
    others = [f"; {name}: {entry.unit}" for name, entry in named if entry.unit != TURNING]
    lines = [
        "# Joint torque (force) per drive unit, joint side: effort = torque_constant * current reference.",
        f"# {TURNING}{''.join(others)}",
        "/**:",
        "  ros__parameters:",
    ]
    for key, field in (("torque_constants", "estimate"), ("torque_constant_deviations", "std")):
        numbers = {name: getattr(entry, field) for name, entry in named}
        entries = [f"      {name}: {float(value)!r}" for name, value in numbers.items() if value is not None]
        lines += [f"    {key}:" if entries else f"    {key}: {{}}", *entries]
    refused = {name: entry.reason or "refused" for name, entry in named if entry.estimate is None}
    lines += [f"    # {name}: {' '.join(reason.split())}" for name, reason in refused.items()]
    return "\n".join(lines) + "\n"


def write_torque(found: JointTorque, file: GainsFile, path: Path) -> None:
    """Write torques as Parquet: `t`, and for each joint with a gain `tau1`, `tau1_low`, `tau1_high`.

    The schema's metadata names unit and interval.

    Raises:
        OSError: If it cannot be written.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns, units = {"t": found.t}, {"t": "s"}
    for k, joint in enumerate(found.joints.tolist()):
        tau, reach = found.tau[:, k], DEVIATIONS * found.std[:, k]
        name, unit = f"tau{joint + 1}", "N m" if file.gains[joint].unit == TURNING else "N"
        for column, values in ((name, tau), (f"{name}_low", tau - reach), (f"{name}_high", tau + reach)):
            columns[column], units[column] = values, unit
    fields = [pa.field(name, pa.float64(), metadata={"unit": units[name]}) for name in columns]
    schema = pa.schema(fields, metadata={"interval": f"{DEVIATIONS:g} standard deviations of the drive gain"})
    pq.write_table(pa.table(list(columns.values()), schema=schema), path)
