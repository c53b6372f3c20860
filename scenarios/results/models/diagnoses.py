"""Diagnoses of logs and of an estimate, with joints from 1."""

from collections.abc import Sequence
from dataclasses import asdict, fields
from typing import Any, Literal

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer

import ident.diagnosis.diagnosis as diagnosis
from scenarios.support.result_model import ResultModel


class DiagnosisEffect(ResultModel):
    """Effect of a fault on a gain; on the joint's current if `deviations` is null."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    percent: float = Field(description="Error of the gain, or share of the joint's rms current")
    deviations: float | None = Field(description="Ratio of this error to the estimated standard deviation of the gain")


class ResultDiagnosis(ResultModel):
    """One check and its finding."""

    name: str = Field(description="What was checked")
    severity: Literal["good", "weak", "wrong"] = Field(description="`good`, `weak` (a warning) or `wrong`")
    sentence: str = Field(description="The finding, with its numbers")
    cause: str | None = Field(None, description="The finding without its effect on the gains, null where there is none")
    advice: str | None = Field(description="Recommended action")
    joints: list[int] = Field(description="Joints concerned, from 1; empty: all")
    logs: list[str] = Field(description="Names of the logs concerned; empty: all")
    value: float | None = Field(description="Size of the fault, in `unit`")
    std: float | None = Field(description="Standard deviation of the size, in `unit`")
    unit: str | None = Field(description="Unit of `value` and `std`")
    z: float | None = Field(
        description="Ratio of the improvement of the predictions to its standard error, null for a check of samples"
    )
    effects: list[DiagnosisEffect] = Field(description="Effect on each gain")
    rivals: list[str] = Field(description="Faults that these logs cannot distinguish from it")
    asked: bool = Field(description="Whether an option requests it, so that it is reported even if it is good")


class ResultExclusion(ResultModel):
    """A family of faults that the logs exclude."""

    family: str = Field(description="As `name` of a diagnosis")
    sentence: str = Field(description="The excluded fault")
    joints: list[int] = Field(description="Joints concerned, from 1; empty: all")
    limit: float | None = Field(
        description="Size beyond which the fault is excluded, in `unit`; null: excluded at any size"
    )
    unit: str | None = Field(description="Unit of `limit`")


class DiagnosedResult(ResultModel):
    """Diagnoses of logs and of an estimate, the last part of a result."""

    diagnoses: list[ResultDiagnosis] = Field(description="One entry per check, the worst first")
    excluded: list[ResultExclusion] = Field(description="Faults that the logs exclude")
    untold: list[str] = Field(description="Faults that the logs cannot reveal")

    @property
    def found(self) -> diagnosis.Diagnosed:
        """Return the original diagnoses, with joints from 0."""
        return diagnosis.Diagnosed(
            diagnoses=tuple(map(_diagnosis, self.diagnoses)),
            excluded=tuple(map(_exclusion, self.excluded)),
            indistinguishable=tuple(self.untold),
        )

    @model_serializer(mode="wrap")
    def _at_the_end(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        values: dict[str, Any] = handler(self)
        last = {key: values.pop(key) for key in DiagnosedResult.model_fields if key in values}
        return values | last


def diagnosed_values(found: diagnosis.Diagnosed) -> dict[str, Any]:
    """Return the values of a `DiagnosedResult`."""
    return {
        "diagnoses": [_diagnosis_values(each) for each in found.diagnoses],
        "excluded": [asdict(each) | {"joints": [joint + 1 for joint in each.joints]} for each in found.excluded],
        "untold": [*found.indistinguishable, *found.indistinguishable_together],
    }


def _diagnosis_values(each: diagnosis.Diagnosis) -> dict[str, Any]:
    own: dict[str, object] = {
        "severity": each.severity.value,
        "joints": [joint + 1 for joint in each.joints],
        "logs": list(each.logs),
        "effects": [asdict(effect) | {"joint": effect.joint + 1} for effect in each.effects],
        "rivals": list(each.rivals),
    }
    return asdict(each) | own


def _diagnosis(stored: ResultDiagnosis) -> diagnosis.Diagnosis:
    values = _values(stored, diagnosis.Diagnosis)
    values["severity"] = diagnosis.Severity(stored.severity)
    values["joints"] = _from_0(stored.joints)
    values["logs"], values["rivals"] = tuple(stored.logs), tuple(stored.rivals)
    values["effects"] = tuple(
        diagnosis.Effect(joint=each.joint - 1, percent=each.percent, deviations=each.deviations)
        for each in stored.effects
    )
    return diagnosis.Diagnosis(**values)


def _exclusion(stored: ResultExclusion) -> diagnosis.Exclusion:
    values = _values(stored, diagnosis.Exclusion)
    values["joints"] = _from_0(stored.joints)
    return diagnosis.Exclusion(**values)


def _values(stored: ResultModel, kind: type[diagnosis.Diagnosis | diagnosis.Exclusion]) -> dict[str, Any]:
    """What is stored of a dataclass, by the names of its fields."""
    return {field.name: getattr(stored, field.name) for field in fields(kind)}


def _from_0(joints: Sequence[int]) -> tuple[int, ...]:
    return tuple(joint - 1 for joint in joints)
