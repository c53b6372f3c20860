"""JSON Schema of what is said of logs and of an estimate."""

from typing import Literal

from pydantic import Field

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


class Diagnosed(ResultModel):
    """What is said of logs and of an estimate.

    Attributes:
        diagnoses: What was looked at, the worst first.
        excluded: Faults that the logs exclude.
        untold: What the logs cannot tell.
    """

    diagnoses: list[ResultDiagnosis]
    excluded: list[ResultExclusion]
    untold: list[str]
