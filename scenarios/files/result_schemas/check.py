"""JSON Schema of a check of logs."""

from typing import Literal

from pydantic import Field

from scenarios.files.result_schemas.open_object import OpenObject


class CheckLine(OpenObject):
    """A line of a check; `log` and `joint` are null where it is about all of them.

    Attributes:
        log: Name of the log.
        what: What was looked at.
        joint: Its number, from 1.
        verdict: On this line.
        seen: What was found, in words.
        advice: What to do.
    """

    log: str | None
    what: str
    joint: int | None = Field(ge=1)
    verdict: Literal["good", "weak", "wrong"]
    seen: str
    advice: str | None


class CheckJoint(OpenObject):
    """How a joint moved in a log.

    Attributes:
        joint: Its number, from 1.
        high: Largest position [rad or m].
        speed_rms: Rms of the speed [rad/s or m/s].
        acceleration_rms: Rms of the acceleration [rad/s^2 or m/s^2].
    """

    joint: int = Field(ge=1)
    low: float = Field(description="[rad or m]")
    high: float
    covered: float | None = Field(description="share of the joint's range, null where no limits are stated")
    speed: float = Field(ge=0.0, description="largest [rad/s or m/s]")
    speed_rms: float = Field(ge=0.0)
    acceleration_rms: float = Field(ge=0.0)
    slow: float = Field(ge=0.0, le=1.0, description="share of the time beside reversals")
    current_rms: float = Field(ge=0.0, description="[drive units]")


class CheckLog(OpenObject):
    """A log; without joints if it cannot be filtered.

    Attributes:
        log: Its name.
        joints: One entry a joint.
    """

    log: str
    joints: list[CheckJoint]


class CheckReadings(OpenObject):
    """Other readings of all logs together."""

    better: list[str] = Field(description="that predict the currents better than the logs as they are")
    same: list[str] = Field(description="that these logs cannot tell from the logs as they are")
    out_of_reach: list[int] = Field(description="joints beyond their limits")
    driven_by_friction: list[int] = Field(description="joints whose positions or currents have the wrong sign")


class CheckEffect(OpenObject):
    """What a fault does to a gain; to the joint's current where `deviations` is null.

    Attributes:
        joint: Its number, from 1.
        percent: Error of the gain, or share of the joint's rms current.
        deviations: The same in standard deviations that are claimed of the gain.
    """

    joint: int = Field(ge=1)
    percent: float
    deviations: float | None


class CheckDiagnosis(OpenObject):
    """One thing that was looked at, and what was found.

    Attributes:
        name: What was looked at.
        severity: How it is to be taken.
        sentence: What was found, in words and numbers.
        advice: What to do.
        joints: That it is about, from 1.
        logs: Names of those that it is about.
        value: Size of what was found.
        std: Standard deviation of the size.
        unit: Of both.
        z: Standard errors by which it predicts the currents better than the logs as they are.
        effects: What it does to each gain.
        rivals: What these logs cannot tell it from.
    """

    name: str
    severity: Literal["good", "weak", "wrong"]
    sentence: str
    advice: str | None
    joints: list[int] = Field(description="none: all of them")
    logs: list[str] = Field(description="none: all of them")
    value: float | None
    std: float | None
    unit: str | None
    z: float | None = Field(description="null where the samples themselves show it")
    effects: list[CheckEffect]
    rivals: list[str]


class CheckExclusion(OpenObject):
    """A family of faults that the logs exclude.

    Attributes:
        family: As `name` of a diagnosis.
        sentence: What is excluded, in words.
        joints: That it is about, from 1.
        limit: Size beyond which it is excluded.
        unit: Of the limit.
    """

    family: str
    sentence: str
    joints: list[int] = Field(description="none: all of them")
    limit: float | None = Field(description="null: of any size")
    unit: str | None


class Check(OpenObject):
    """What `rx90 check --json` prints.

    Attributes:
        robot: Its name.
        verdict: The worst of all lines.
        lines: What was looked at.
        logs: How joints moved.
        readings: Other readings of all logs together.
        diagnoses: What was looked at, in full.
        excluded: Faults that the logs exclude.
        untold: What the logs cannot tell, a sentence each.
    """

    robot: str
    verdict: Literal["good", "weak", "wrong"]
    lines: list[CheckLine]
    logs: list[CheckLog]
    readings: CheckReadings
    diagnoses: list[CheckDiagnosis]
    excluded: list[CheckExclusion]
    untold: list[str]
