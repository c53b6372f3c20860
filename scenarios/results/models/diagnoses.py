"""What is said of logs and of an estimate, as results have it: joints from 1."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any, Literal

from pydantic import Field, SerializerFunctionWrapHandler, TypeAdapter, model_serializer

import ident.diagnosis.diagnosis as diagnosis
from scenarios.support.result_model import ResultModel


class DiagnosisEffect(ResultModel):
    """What a fault does to a gain; to the joint's current where `deviations` is null.

    Attributes:
        joint: Its number, from 1.
        percent: Error of the gain, or share of the joint's rms current.
        deviations: The same in standard deviations that are claimed of the gain.
    """

    joint: int = Field(ge=1)
    percent: float
    deviations: float | None


class ResultDiagnosis(ResultModel):
    """One thing that was looked at, and what was found.

    Attributes:
        name: What was looked at.
        severity: How it is to be taken.
        sentence: What was found, in words and numbers.
        cause: The same without what it does to the gains, null where that is nothing.
        advice: What to do.
        value: Size of what was found, in `unit`.
        std: Standard deviation of the size, in `unit`.
        unit: Of both.
        effects: What it does to each gain.
        rivals: What these logs cannot tell it from.
        asked: Whether it answers what an option asked, and is told though it is good.
    """

    name: str
    severity: Literal["good", "weak", "wrong"]
    sentence: str
    cause: str | None = None
    advice: str | None
    joints: list[int] = Field(description="that it is about, from 1; empty for all of them")
    logs: list[str] = Field(description="names of those that it is about; empty for all of them")
    value: float | None
    std: float | None
    unit: str | None
    z: float | None = Field(
        description="ratio of the gain in predictions to its standard error, null where samples show it"
    )
    effects: list[DiagnosisEffect]
    rivals: list[str]
    asked: bool


class ResultExclusion(ResultModel):
    """A family of faults that the logs exclude.

    Attributes:
        family: As `name` of a diagnosis.
        sentence: What is excluded, in words.
        unit: Of the limit.
    """

    family: str
    sentence: str
    joints: list[int] = Field(description="that it is about, from 1; empty for all of them")
    limit: float | None = Field(description="size beyond which it is excluded, in `unit`; null: of any size")
    unit: str | None


class DiagnosedResult(ResultModel):
    """What is said of logs and of an estimate; it stands behind all else that a result has.

    Attributes:
        diagnoses: What was looked at, the worst first.
        excluded: Faults that the logs exclude.
        untold: What the logs cannot tell.
    """

    diagnoses: list[ResultDiagnosis]
    excluded: list[ResultExclusion]
    untold: list[str]

    @property
    def found(self) -> diagnosis.Diagnosed:
        """As it was said: joints from 0."""
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


def _from_0(stored: diagnosis.Diagnosis) -> diagnosis.Diagnosis:
    effects = tuple(replace(each, joint=each.joint - 1) for each in stored.effects)
    return replace(stored, joints=_all_from_0(stored.joints), effects=effects)


def _all_from_0(joints: Sequence[int]) -> tuple[int, ...]:
    return tuple(joint - 1 for joint in joints)
