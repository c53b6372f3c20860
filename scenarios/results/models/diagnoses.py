"""Diagnoses of logs and of an estimate, with joints from 1."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any, Literal

from pydantic import Field, SerializerFunctionWrapHandler, TypeAdapter, model_serializer

import ident.diagnosis.diagnosis as diagnosis
from scenarios.support.result_model import ResultModel


class DiagnosisEffect(ResultModel):
    """Effect of a fault on a gain; on the joint's current if `deviations` is null."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    percent: float = Field(description="Error of the gain, or share of the joint's rms current")
    deviations: float | None = Field(description="Ratio of this error to the stated standard deviation of the gain")


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
        values = self.model_dump(include=set(DiagnosedResult.model_fields))
        said = _DIAGNOSED.validate_python(values | {"indistinguishable": values.pop("untold")})
        return diagnosis.Diagnosed(
            diagnoses=tuple(map(_from_0, said.diagnoses)),
            excluded=tuple(replace(each, joints=_all_from_0(each.joints)) for each in said.excluded),
            indistinguishable=said.indistinguishable,
        )

    @model_serializer(mode="wrap")
    def _at_the_end(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        values: dict[str, Any] = handler(self)
        last = {key: values.pop(key) for key in DiagnosedResult.model_fields if key in values}
        return values | last


_DIAGNOSED = TypeAdapter(diagnosis.Diagnosed)


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


def _from_0(stored: diagnosis.Diagnosis) -> diagnosis.Diagnosis:
    effects = tuple(replace(each, joint=each.joint - 1) for each in stored.effects)
    return replace(stored, joints=_all_from_0(stored.joints), effects=effects)


def _all_from_0(joints: Sequence[int]) -> tuple[int, ...]:
    return tuple(joint - 1 for joint in joints)
