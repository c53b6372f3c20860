"""The result of `rx90 check`: verdict, findings, excluded faults, faults that cannot be checked, motion of joints."""

from collections.abc import Iterable
from typing import Literal

from pydantic import Field

from ident.diagnosis.alternative import two_digits
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Severity
from ident.identification import Checked
from ident.model.arm import Arm
from scenarios.rendering.content import Heading, Mood, Paragraph, Part, many
from scenarios.rendering.result import ResultModel
from scenarios.results.diagnoses import (
    MOODS,
    DiagnosedResult,
    counted,
    diagnosed_values,
    doubt_paragraphs,
    every_check,
    horizon_paragraphs,
)
from scenarios.results.motion import CheckLog, motion_table, range_plot, short_names

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


class CheckReadings(ResultModel):
    """Faults of all logs together."""

    better: list[str] = Field(description="Faults that significantly improve the prediction of the currents")
    same: list[str] = Field(description="Faults that these logs can neither confirm nor exclude")
    out_of_reach: list[int] = Field(description="Joints beyond their limits")
    driven_by_friction: list[int] = Field(description="Joints whose positions or currents have the wrong sign")

    @classmethod
    def of(cls, found: Diagnosed) -> "CheckReadings":
        """Return the faults of all logs together."""

        def joints(name: str) -> list[int]:
            return sorted({joint + 1 for each in found.findings if each.name == name for joint in each.joints})

        wrong = [each for each in found.diagnoses if each.severity is Severity.WRONG]
        return cls(
            better=[each.sentence for each in wrong if each.z is not None],
            same=[*found.indistinguishable, *found.indistinguishable_together],
            out_of_reach=joints(LIMITS),
            driven_by_friction=joints(FRICTION),
        )


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
            logs=[CheckLog.of(each.recording.name, each.motions or (), arm) for each in checked.logs],
            readings=CheckReadings.of(found),
            **diagnosed_values(found),
        )

    @property
    def headline(self) -> str:
        """The verdict in one line, with the largest effect on a gain."""
        found = self.found
        checks = f"({many(len(found.diagnoses), 'check')} of {self.robot} logs)"
        if found.severity is Severity.GOOD:
            return f"GOOD, no fault {checks}"
        label = "USABLE, " if found.severity is Severity.WEAK else "WRONG: "
        worst = [each.worst for each in found.findings]
        effects = [each for each in worst if each is not None and each.deviations is not None]
        if not effects:
            return f"{label}{counted(found)} {checks}"
        most = max(effects, key=lambda each: abs(each.percent))
        size = "100 % or more" if abs(most.percent) >= 100.0 else f"{two_digits(abs(most.percent))} %"
        return f"{label}{counted(found)} {checks}: the gain of joint {most.joint + 1} off by {size}"

    @property
    def mood(self) -> Mood:
        """Assessment of the verdict."""
        return MOODS[self.found.severity]

    def parts(self) -> Iterable[Part]:
        """Findings and advice, conclusions, and for files every check and the motion of each joint."""
        found = self.found
        yield from doubt_paragraphs(found, strong=False)
        good = len(found.diagnoses) - len(found.findings)
        yield Paragraph(f"{many(good, 'check')} without a finding.")
        yield from horizon_paragraphs(found, every=True)
        yield Heading("All checks", file_only=True)
        yield from every_check(found.diagnoses)
        names = short_names([log.log for log in self.logs])
        moved = {name: log.joints for name, log in zip(names, self.logs, strict=True) if log.joints}
        if moved:
            yield Heading("Motion and joint ranges", file_only=True)
            yield range_plot(moved)
            yield from (motion_table(f"Motion of {name}", joints) for name, joints in moved.items())
