"""The gains file: drive gains with covariance and origin, TOML or JSON by the file's ending, read strictly.

Only `gains` is required, one entry per joint in order, so that a file can be written by hand from data sheets. The
other keys state the origin of the gains. Without `covariance` the errors of the gains are independent.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, JsonValue

from ident.diagnosis.gain_symptoms import negative
from ident.estimation.known_gains import KnownGains
from ident.model.arm import Arm
from ident.support.errors import GainsError
from ident.support.files import LARGEST, read_bytes, read_toml
from ident.support.naming import one_line, shown
from scenarios.support.errors import ScenarioError
from sim.tables import Table, validated_table

TURNING, SLIDING = "N m / drive unit", "N / drive unit"
Digest = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
Deviation = Annotated[float, Field(ge=0.0)]
SAME = 1e-6
"""Largest relative difference between a standard deviation and its variance, as due to rounding in the file."""


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
        None,
        description="Total covariance of the identifiable joints' gains, in order; in products of `unit`",
    )
    options: OptionsEntry = Field(OptionsEntry(), description="Options of the identification")
    model: ModelEntry | None = Field(None, description="Model of the robot")
    recordings: tuple[RecordingEntry, ...] = Field((), description="Recordings from which the gains were identified")
    payloads: tuple[dict[str, JsonValue], ...] = Field((), description="Payloads, with the keys of payload files")
    versions: dict[str, str] = Field({}, description="Versions of packages")

    @property
    def known(self) -> KnownGains:
        """The gains as `KnownGains`.

        Raises:
            GainsError: If they are not usable.
        """
        given = [entry for entry in self.gains if entry.identifiable]
        std = np.array([entry.std or 0.0 for entry in given])
        return KnownGains(
            names=tuple(entry.name or str(entry.joint) for entry in self.gains),
            joints=np.array([entry.joint - 1 for entry in given], dtype=np.intp),
            value=np.array([entry.estimate or 0.0 for entry in given]),
            covariance=np.diag(std**2) if self.covariance is None else np.array(self.covariance),
        )

    def of(self, arm: Arm) -> KnownGains:
        """Return the gains for an arm.

        Raises:
            GainsError: If they belong to another robot or to other joints, or are not usable.
        """
        if self.robot not in (None, arm.name):
            raise GainsError(
                f"gains: of robot {one_line(self.robot)}, but the model is of {arm.name}; if both are one arm, write "
                f"robot = {arm.name!r} into the gains file"
            )
        known = self.known
        known.check_arm(arm)
        return known

    @property
    def notes(self) -> tuple[str, ...]:
        """Return remarks on unusual but valid gains: negative ones."""
        gains = {entry.joint - 1: entry.estimate for entry in self.gains if entry.estimate is not None}
        return tuple(f"{each.sentence}; {each.advice}" for each in negative(gains))


def read_gains(path: Path) -> GainsFile:
    """Read a gains file.

    Raises:
        ScenarioError: If it is missing, not TOML or JSON, or has an unknown key or impossible gains; one line.
    """
    where = one_line(path)
    table = _read_json(path) if path.suffix.lower() == ".json" else read_toml(path, error=ScenarioError)
    if not isinstance(table, Mapping) or "gains" not in table:
        raise ScenarioError(f"{where}: no gains; expected a gains file, as `rx90 identify --gains-out` writes it")
    file = validated_table(GainsFile, table, where, ScenarioError)
    _check(file, where)
    return file


def check_units(A: GainsFile, B: GainsFile) -> None:
    """Check that each joint's gains have the same unit in both files.

    Raises:
        ScenarioError: If a joint is revolute in one and prismatic in the other.
    """
    for one, other in zip(A.gains, B.gains, strict=False):
        if one.unit != other.unit:
            raise ScenarioError(
                f"gains files: joint {one.joint}: its gain is in {one.unit} in A and in {other.unit} in B; "
                "expected two files of one arm"
            )


def _read_json(path: Path) -> object:
    content = read_bytes(path, most_bytes=LARGEST, error=ScenarioError)
    try:
        return json.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError as fault:
        raise ScenarioError(f"{one_line(path)}: not JSON: byte {fault.start} is not UTF-8") from fault
    except json.JSONDecodeError as fault:
        place = f"line {fault.lineno}, column {fault.colno}"
        raise ScenarioError(f"{one_line(path)}: not JSON: {one_line(fault.msg)} at {place}") from fault
    except (RecursionError, ValueError) as fault:
        raise ScenarioError(f"{one_line(path)}: JSON that cannot be read: {one_line(fault)}") from fault


def _check(file: GainsFile, where: str) -> None:
    """Check that joints are numbered 1 to n with gain or reason, and that covariance and standard deviations agree."""
    numbers = [entry.joint for entry in file.gains]
    if numbers != list(range(1, len(numbers) + 1)):
        raise ScenarioError(f"{where}: gains of joints {shown(numbers)}; expected 1 to n, in this order")
    for entry in file.gains:
        place = f"{where}: gains.{entry.joint}"
        if entry.identifiable and (entry.estimate is None or entry.std is None):
            missing = "estimate" if entry.estimate is None else "std"
            raise ScenarioError(f"{place}: {missing} is missing; give it, or identifiable = false and a reason")
        if not entry.identifiable and (entry.estimate is not None or entry.std is not None):
            raise ScenarioError(
                f"{place}: refused but has a number; leave out estimate and std, or identifiable = false"
            )
    k = sum(entry.identifiable for entry in file.gains)
    if file.covariance is not None and [len(row) for row in file.covariance] != [k] * k:
        sizes = shown([len(row) for row in file.covariance])
        raise ScenarioError(
            f"{where}: covariance: rows of {sizes} numbers; expected {k} of {k}, one per identifiable joint"
        )
    try:
        known = file.known
    except GainsError as error:
        raise ScenarioError(f"{where}: {error}") from error
    stated = np.array([entry.std or 0.0 for entry in file.gains if entry.identifiable])
    off = np.flatnonzero(np.abs(known.std - stated) > SAME * stated)
    if len(off):
        at = off[0]
        raise ScenarioError(
            f"{where}: gains.{int(known.joints[at]) + 1}.std = {stated[at]:g}, but the covariance has "
            f"{known.std[at]:g} squared"
        )
