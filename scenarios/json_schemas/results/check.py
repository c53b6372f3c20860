"""JSON Schema of a check of logs."""

from typing import Literal

from pydantic import Field

from scenarios.json_schemas.results.diagnoses import Diagnosed
from scenarios.support.result_model import ResultModel


class CheckLine(ResultModel):
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


class CheckJoint(ResultModel):
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


class CheckLog(ResultModel):
    """A log; without joints if it cannot be filtered.

    Attributes:
        log: Its name.
        joints: One entry a joint.
    """

    log: str
    joints: list[CheckJoint]


class CheckReadings(ResultModel):
    """Other readings of all logs together."""

    better: list[str] = Field(description="that predict the currents better than the logs as they are")
    same: list[str] = Field(description="that these logs cannot tell from the logs as they are")
    out_of_reach: list[int] = Field(description="joints beyond their limits")
    driven_by_friction: list[int] = Field(description="joints whose positions or currents have the wrong sign")


class Check(Diagnosed):
    """What `rx90 check --json` prints.

    Attributes:
        robot: Its name.
        verdict: The worst of all lines.
        lines: What was looked at.
        logs: How joints moved.
        readings: Other readings of all logs together.
    """

    robot: str
    verdict: Literal["good", "weak", "wrong"]
    lines: list[CheckLine]
    logs: list[CheckLog]
    readings: CheckReadings
