"""The result of a check of logs."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Literal

from pydantic import Field

from ident.check import Checked
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Severity
from ident.diagnosis.samples.motion import JointMotion
from ident.model.arm import Arm
from scenarios.results.models.diagnoses import DiagnosedResult, diagnosed_values
from scenarios.support.result_model import ResultModel

LIMITS, FRICTION = "joint limits", "friction sign"
"""Names of the diagnoses of joints beyond their limits, and of friction with the sign of a driving torque."""


class CheckLine(ResultModel):
    """A line of a check; `log` and `joint` are null if it concerns all of them."""

    log: str | None = Field(description="Name of the log")
    what: str = Field(description="What was checked")
    joint: int | None = Field(ge=1, description="Number of the joint, from 1")
    verdict: Literal["good", "weak", "wrong"] = Field(description="Verdict of this line")
    seen: str = Field(description="The finding")
    advice: str | None = Field(description="Recommended action")

    @classmethod
    def of(cls, found: Diagnosis) -> "CheckLine":
        """Return a diagnosis as a line."""
        return cls(
            log=found.logs[0] if len(found.logs) == 1 else None,
            what=found.name,
            joint=found.joints[0] + 1 if len(found.joints) == 1 else None,
            verdict=found.severity.value,
            seen=found.sentence,
            advice=found.advice,
        )


class CheckJoint(ResultModel):
    """Motion of a joint in a log."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    low: float = Field(description="Smallest position [rad or m]")
    high: float = Field(description="Largest position [rad or m]")
    covered: float | None = Field(description="Share of the joint's range, null where the model has no limits")
    speed: float = Field(ge=0.0, description="Largest speed [rad/s or m/s]")
    speed_rms: float = Field(ge=0.0, description="Rms of the speed [rad/s or m/s]")
    acceleration_rms: float = Field(ge=0.0, description="Rms of the acceleration [rad/s^2 or m/s^2]")
    slow: float = Field(ge=0.0, le=1.0, description="Share of the time near reversals or at rest")
    current_rms: float = Field(ge=0.0, description="Rms of the current [drive units]")


class CheckLog(ResultModel):
    """A log; without joints if it cannot be filtered."""

    log: str = Field(description="Name of the log")
    joints: list[CheckJoint] = Field(description="One entry per joint")

    @classmethod
    def of(cls, log: str, motions: Sequence[JointMotion]) -> "CheckLog":
        """Return a log by name with the motion of each joint, none if it cannot be filtered."""
        joints = [CheckJoint(joint=number, **asdict(each)) for number, each in enumerate(motions, 1)]
        return cls(log=log, joints=joints)


class CheckReadings(ResultModel):
    """Faults of all logs together."""

    better: list[str] = Field(description="Faults whose correction improves the prediction of the currents")
    same: list[str] = Field(description="Faults that these logs can neither confirm nor exclude")
    out_of_reach: list[int] = Field(description="Joints beyond their limits")
    driven_by_friction: list[int] = Field(description="Joints whose positions or currents have the wrong sign")

    @classmethod
    def of(cls, found: Diagnosed) -> "CheckReadings":
        """Return the faults of all logs together."""
        wrong = [each for each in found.diagnoses if each.severity is Severity.WRONG]
        return cls(
            better=[each.sentence for each in wrong if each.z is not None],
            same=[*found.indistinguishable, *found.indistinguishable_together],
            out_of_reach=_joints(found, LIMITS),
            driven_by_friction=_joints(found, FRICTION),
        )


def _joints(found: Diagnosed, name: str) -> list[int]:
    return sorted({joint + 1 for each in found.findings if each.name == name for joint in each.joints})


class Check(DiagnosedResult):
    """What `rx90 check --json` prints."""

    robot: str = Field(description="Name of the robot")
    verdict: Literal["good", "weak", "wrong"] = Field(description="Worst verdict of all lines")
    lines: list[CheckLine] = Field(description="What was checked")
    logs: list[CheckLog] = Field(description="Motion of the joints")
    readings: CheckReadings = Field(description="Faults of all logs together")

    @classmethod
    def of(cls, checked: Checked, arm: Arm) -> "Check":
        """Return the result of a check."""
        found = checked.found
        return cls(
            robot=arm.name,
            verdict=found.severity.value,
            lines=[CheckLine.of(each) for each in found.diagnoses],
            logs=[CheckLog.of(each.recording.name, each.motions or ()) for each in checked.logs],
            readings=CheckReadings.of(found),
            **diagnosed_values(found),
        )
