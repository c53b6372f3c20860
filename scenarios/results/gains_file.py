"""The gains file: drive gains with covariance and origin, TOML or JSON by the file's ending, read strictly.

Only `gains` is required, one entry per joint in order, so that a file can be written by hand from data sheets. The
other keys state the origin of the gains. Without `covariance` the errors of the gains are independent.
"""

import hashlib
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, JsonValue

from ident.diagnosis.gain_checks import negative
from ident.estimation.estimate import GainCurve, GainEstimate, IdentifiedGain
from ident.estimation.known_gains import JointTorque, KnownGains, estimated_gains
from ident.model.arm import Arm
from ident.payload.payload import payload_to_table
from ident.recordings.recording import Recording, row_marks
from ident.support.arrays import Array
from ident.support.errors import GainsError
from ident.support.files import read_toml
from ident.support.naming import one_line, shown
from ident.support.options import keys_of
from scenarios.rendering.result import to_json
from scenarios.results.problem_folder import GivenProblem, read_json
from scenarios.support.digests import with_digest, without_digest
from scenarios.support.errors import ScenarioError
from scenarios.support.texts import toml_value
from scenarios.support.versions import versions
from sim.tables import Table, validated_table

TURNING, SLIDING = "N m / drive unit", "N / drive unit"
Digest = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
Deviation = Annotated[float, Field(ge=0.0)]
SAME = 1e-6
"""Largest relative difference between a standard deviation and its variance, as due to rounding in the file."""
NUMBERS = ("std", "residual_std", "payload_std", "model_std")
DEVIATIONS = 2.0
"""Half-width of the interval of a torque, in standard deviations."""


class GainEntry(Table):
    """One joint: `estimate` and `std`, or `identifiable = false` and the reason."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    name: str | None = Field(None, description="Name of the joint in the robot's model")
    unit: Literal["N m / drive unit", "N / drive unit"] = Field(
        TURNING, description="Unit of the gain; the second one for a prismatic joint"
    )
    identifiable: bool = Field(True, description="Whether there is a gain")
    estimate: float | None = Field(
        None, description="Joint torque or force per drive unit, in `unit`; omitted if refused"
    )
    std: Deviation | None = Field(None, description="Total standard deviation, in `unit`; 0 for a gain taken as exact")
    residual_std: Deviation | None = Field(None, description="Contribution of the residuals to `std`, in `unit`")
    payload_std: Deviation | None = Field(
        None, description="Contribution of the payloads' specified uncertainty, in `unit`"
    )
    model_std: Deviation | None = Field(None, description="Contribution of the model's assumptions, in `unit`")
    reason: str | None = Field(None, description="Why the joint is refused")
    curve: GainCurve | None = Field(
        None, description="Gain over current, `estimate` is that at `current`; a constant gain if omitted"
    )
    largest_current: float | None = Field(
        None, gt=0.0, description="Largest current at which the gain is known [drive units], if `recordings` do not say"
    )

    @property
    def torque_unit(self) -> str:
        """Unit of the torque, N of a prismatic joint."""
        return "N m" if self.unit == TURNING else "N"

    @property
    def words(self) -> tuple[str, ...]:
        """The curve in words, if there is one."""
        told = self.curve and self.curve.words(self.joint - 1, self.estimate or 0.0, self.torque_unit)
        return () if told is None else (told,)


class ModelEntry(Table):
    """The robot's model file."""

    name: str = Field(description="Name of the file")
    sha256: Digest = Field(description="SHA-256 of the file")


class RecordingEntry(Table):
    """A recording from which the gains were identified."""

    name: str = Field(description="Name of the file")
    sha256: Digest = Field(
        description="SHA-256 of the samples t, q, v as little-endian doubles, whatever the file format"
    )
    marks: tuple[Annotated[str, Field(pattern="^[0-9a-f]{16}$")], ...] = Field(
        (), description="Hashes of some rows q, v, by which a copy of a part of the recording is recognised"
    )
    payload: int | None = Field(
        None, ge=1, description="Number of the mounted payload in `payloads`, from 1; omitted for a bare flange"
    )
    largest: tuple[float, ...] = Field(
        (), description="Largest magnitude of each joint's current [drive units], by which another unit is recognised"
    )


class OptionsEntry(Table):
    """Options of the identification."""

    method: dict[str, JsonValue] = Field(default={}, description="Options of the method")
    observe: dict[str, JsonValue] = Field(default={}, description="Filters and rows of the linear system")
    gains: dict[str, JsonValue] = Field(default={}, description="Limits for accepting a gain")


class GainsFile(Table):
    """Drive gains of one robot."""

    format: Literal[1] = Field(1, description="Version of the file format")
    created: str | None = Field(None, description="Time of the identification, ISO 8601")
    robot: str | None = Field(None, description="Name of the robot")
    method: str | None = Field(None, description="Estimator, or the source of the gains")
    gains: tuple[GainEntry, ...] = Field(min_length=1, description="One entry per joint, in order")
    covariance: tuple[tuple[float, ...], ...] | None = Field(
        None, description="Total covariance of the identifiable joints' gains, in order; in products of `unit`"
    )
    transmission: tuple[tuple[float, ...], ...] | None = Field(
        None,
        description="Ratios of positions, rows of A, q_motor = A q, if gains are of motors that several joints turn",
    )
    options: OptionsEntry = Field(OptionsEntry(), description="Options of the identification")
    model: ModelEntry | None = Field(None, description="Model of the robot")
    recordings: tuple[RecordingEntry, ...] = Field((), description="Recordings from which the gains were identified")
    payloads: tuple[dict[str, JsonValue], ...] = Field((), description="Payloads, with the keys of payload files")
    versions: dict[str, str] = Field({}, description="Versions of packages")
    digest: Digest | None = Field(
        None, description="SHA-256 of all else, if a command wrote the file; remove it to change the file by hand"
    )

    @property
    def table(self) -> dict[str, object]:
        """All known values, with the digest of the others."""
        return with_digest(self.model_dump(mode="json", exclude_none=True))

    @property
    def known(self) -> KnownGains:
        """The gains as `KnownGains`; raises `GainsError` if they are not usable."""
        given = [entry for entry in self.gains if entry.identifiable]
        std = np.array([entry.std or 0.0 for entry in given])
        return KnownGains(
            names=tuple(entry.name or str(entry.joint) for entry in self.gains),
            joints=np.array([entry.joint - 1 for entry in given], dtype=np.intp),
            value=np.array([entry.estimate or 0.0 for entry in given]),
            covariance=np.diag(std**2) if self.covariance is None else np.array(self.covariance),
            curves={entry.joint - 1: entry.curve for entry in given if entry.curve is not None},
        )

    @property
    def largest_currents(self) -> Array:
        """Largest current of each joint at which its gain is known [drive units], infinite if unknown, shape (n,)."""
        n = len(self.gains)
        logs = [each.largest for each in self.recordings if len(each.largest) == n]
        of_logs = np.max(logs, axis=0) if logs else np.full(n, np.inf)
        return np.array([entry.largest_current or x for entry, x in zip(self.gains, of_logs.tolist(), strict=True)])

    def of(self, arm: Arm) -> KnownGains:
        """Return the gains for an arm."""
        if self.robot not in (None, arm.name):
            raise GainsError(
                f"gains: of robot {one_line(self.robot)}, but the model is of {arm.name}; if both are one arm, write "
                f"robot = {arm.name!r} into the gains file and remove its digest"
            )
        known = self.known
        known.check_arm(arm)
        if self.transmission != (None if arm.transmission is None else tuple(map(tuple, arm.transmission.tolist()))):
            raise GainsError(
                f"gains: of motors with a transmission that {arm.name} does not have; give the robot.toml that they "
                "were identified with"
                if self.transmission
                else f"gains: of motors that turn one joint each, but those of {arm.name} turn several; if the gains "
                "are of these, copy transmission from its robot.toml into the gains file and remove its digest"
            )
        return known

    @property
    def notes(self) -> tuple[str, ...]:
        """Return remarks on unusual but valid gains: negative ones, and those that depend on the current."""
        gains = {entry.joint - 1: entry.estimate for entry in self.gains if entry.estimate is not None}
        found = (f"{each.sentence}; {each.advice}" for each in negative(gains))
        return (*found, *(words for entry in self.gains for words in entry.words))


def read_gains(path: Path) -> GainsFile:
    """Read a gains file.

    Raises `ScenarioError` if it is missing, not TOML or JSON, or has an unknown key or impossible gains; one line.
    """
    where = one_line(path)
    table = read_json(path) if path.suffix.lower() == ".json" else read_toml(path, error=ScenarioError)
    if not isinstance(table, Mapping) or "gains" not in table:
        raise ScenarioError(f"{where}: no gains; expected a gains file, as `rx90 identify --gains-out` writes it")
    file = validated_table(GainsFile, without_digest(table, path), where, ScenarioError)
    for fault in _faults(file):
        raise ScenarioError(f"{where}: {fault}")
    return file


def check_units(A: GainsFile, B: GainsFile) -> None:
    """Check that each joint's gains have the same unit in both files, and motors the same transmission."""
    if A.transmission != B.transmission:
        raise ScenarioError("gains files: their motors have different transmissions; expected two files of one arm")
    for one, other in zip(A.gains, B.gains, strict=False):
        if one.unit != other.unit:
            raise ScenarioError(
                f"gains files: joint {one.joint}: its gain is in {one.unit} in A and in {other.unit} in B; "
                "expected two files of one arm"
            )


def _faults(file: GainsFile) -> Iterator[str]:
    """Yield what is wrong: joints that are not 1 to n, one without gain or reason, deviations unlike the covariance."""
    numbers, given = [entry.joint for entry in file.gains], [entry for entry in file.gains if entry.identifiable]
    if numbers != list(range(1, len(numbers) + 1)):
        yield f"gains of joints {shown(numbers)}; expected 1 to n, in this order"
    for entry in file.gains:
        missing = [name for name in ("estimate", "std") if getattr(entry, name) is None]
        if entry.identifiable and missing:
            yield f"gains.{entry.joint}: {missing[0]} is missing; give it, or identifiable = false and a reason"
        if not entry.identifiable and (len(missing) < 2 or entry.curve is not None):
            fault = f"gains.{entry.joint}: refused but has a number"
            yield f"{fault}; leave out estimate and std, or identifiable = false"
    sizes, k = [len(row) for row in file.covariance or ()], len(given)
    if file.covariance is not None and sizes != [k] * k:
        yield f"covariance: rows of {shown(sizes)} numbers; expected {k} of {k}, one per identifiable joint"
    try:
        found = file.known.std.tolist()
    except GainsError as error:
        yield str(error)
        return
    for entry, std in zip(given, found, strict=True):
        stated = entry.std or 0.0
        if abs(std - stated) > SAME * stated:
            yield f"gains.{entry.joint}.std = {stated:g}, but the covariance has {std:g} squared"


def gains_file(estimate: GainEstimate, origin: GivenProblem) -> GainsFile:
    """Return the gains file of an estimate."""
    gains = [
        {
            "joint": j,
            "name": joint.joint,
            "unit": TURNING if revolute else SLIDING,
            "identifiable": isinstance(joint, IdentifiedGain),
            "estimate": getattr(joint, "value", None),
            **{name: getattr(joint, name, None) for name in (*NUMBERS, "reason", "curve")},
        }
        for j, (joint, revolute) in enumerate(zip(estimate.joints, origin.arm.revolute, strict=True), 1)
    ]
    recordings = [
        {
            "name": Path(each.recording.name).name,
            "sha256": recording_digest(each.recording),
            "marks": row_marks(each.recording),
            "payload": origin.mounting(each),
            "largest": tuple(np.abs(each.recording.v).max(axis=0).tolist()),
        }
        for each in origin.motions
    ]
    options = {"method": origin.options, "observe": origin.observing, "gains": estimate.options}
    stated = {kind: {name: getattr(x, name) for name in keys_of(type(x))} for kind, x in options.items()}
    return GainsFile.model_validate(
        {
            "created": datetime.now(UTC).isoformat(timespec="seconds"),
            "robot": origin.arm.name,
            "method": estimate.method,
            "gains": tuple(gains),
            "covariance": estimated_gains(estimate).covariance.tolist(),
            "transmission": None if (A := origin.arm.transmission) is None else A.tolist(),
            "options": {kind: {k: v for k, v in own.items() if v is not None} for kind, own in stated.items()},
            "model": {"name": origin.model.name, "sha256": hashlib.sha256(origin.model.read_bytes()).hexdigest()},
            "recordings": tuple(recordings),
            "payloads": tuple(map(payload_to_table, origin.payloads)),
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
    table = file.table
    if ending.lower() == ".json":
        return to_json(table) + "\n"
    plain, tables = list[str](), list[str]()
    for key, value in table.items():
        head, own = (f"[{key}]", [value]) if isinstance(value, Mapping) else (f"[[{key}]]", value)
        if not (own and isinstance(own, list) and isinstance(own[0], Mapping)):
            plain.append(f"{key} = {toml_value(value)}")
            continue
        for each in own:
            tables += ["", head, *(f"{name} = {toml_value(inner)}" for name, inner in each.items())]
    return "\n".join([*plain, *tables]) + "\n"


def write_torque(found: JointTorque, file: GainsFile, path: Path) -> None:
    """Write torques as Parquet: `t`, and for each joint with a gain `tau1`, `tau1_low`, `tau1_high`, with units."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = [("t", "s", found.t)]
    for k, joint in enumerate(found.joints.tolist()):
        tau, reach = found.tau[:, k], DEVIATIONS * found.std[:, k]
        for ending, values in (("", tau), ("_low", tau - reach), ("_high", tau + reach)):
            columns.append((f"tau{joint + 1}{ending}", file.gains[joint].torque_unit, values))
    fields = [pa.field(name, pa.float64(), metadata={"unit": unit}) for name, unit, _ in columns]
    schema = pa.schema(fields, metadata={"interval": f"{DEVIATIONS:g} standard deviations of the drive gain"})
    pq.write_table(pa.table([values for _, _, values in columns], schema=schema), path)
