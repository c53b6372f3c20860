"""What is said of logs and of an estimate, as results have it: joints from 1."""

from collections.abc import Sequence
from dataclasses import asdict, fields
from typing import Any, Literal

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer

import ident.diagnosis.diagnosis as diagnosis
from scenarios.support.result_model import ResultModel


class DiagnosisEffect(ResultModel):
    """What a fault does to a gain; to the joint's current where `deviations` is null."""

    joint: int = Field(ge=1, description="Its number, from 1")
    percent: float = Field(description="Error of the gain, or share of the joint's rms current")
    deviations: float | None = Field(description="The same in stated standard deviations of the gain")


class ResultDiagnosis(ResultModel):
    """One thing that was looked at, and what was found."""

    name: str = Field(description="What was checked")
    severity: Literal["good", "weak", "wrong"] = Field(description="Good, weak (a warning) or wrong")
    sentence: str = Field(description="What was found, in words and numbers")
    cause: str | None = Field(None, description="The same without the effect on the gains, null where there is none")
    advice: str | None = Field(description="What to do")
    joints: list[int] = Field(description="that it is about, from 1; empty for all of them")
    logs: list[str] = Field(description="names of those that it is about; empty for all of them")
    value: float | None = Field(description="Size of what was found, in `unit`")
    std: float | None = Field(description="Standard deviation of the size, in `unit`")
    unit: str | None = Field(description="Of both")
    z: float | None = Field(
        description="ratio of the improvement of predictions to its standard error, null if samples alone show it"
    )
    effects: list[DiagnosisEffect] = Field(description="What it does to each gain")
    rivals: list[str] = Field(description="Faults that these logs cannot distinguish from it")
    asked: bool = Field(description="Whether an option asked for it, so that it is reported even if it is good")


class ResultExclusion(ResultModel):
    """A family of faults that the logs exclude."""

    family: str = Field(description="As `name` of a diagnosis")
    sentence: str = Field(description="What is excluded, in words")
    joints: list[int] = Field(description="that it is about, from 1; empty for all of them")
    limit: float | None = Field(description="size beyond which it is excluded, in `unit`; null: of any size")
    unit: str | None = Field(description="Of the limit")


class DiagnosedResult(ResultModel):
    """What is said of logs and of an estimate; it stands behind all else that a result has."""

    diagnoses: list[ResultDiagnosis] = Field(description="What was checked, the worst first")
    excluded: list[ResultExclusion] = Field(description="Faults that the logs exclude")
    untold: list[str] = Field(description="Faults that the logs cannot reveal")

    @property
    def found(self) -> diagnosis.Diagnosed:
        """As it was said: joints from 0."""
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
    """The values of a `DiagnosedResult`."""
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
