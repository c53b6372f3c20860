"""The result of `rx90 check`: verdict, findings, faults that the logs exclude or cannot reveal, motion of joints."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from ident.diagnosis.diagnosis import Severity, two_digits
from ident.diagnosis.motion_quality import JointMotion
from ident.identification import Checked
from ident.model.arm import Arm
from scenarios.rendering.content import Heading, Mood, Part, column, table
from scenarios.rendering.result import ResultModel
from scenarios.rendering.wording import many, number, percent
from scenarios.results.diagnoses import MOODS, DiagnosedResult, doubt_paragraphs, horizon_fold


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckJoint(JointMotion):
    """Motion of a joint in a log."""

    joint: int  # number of the joint, from 1
    name: str = ""  # name of the joint in the robot's model
    unit: Literal["rad", "m"] = "rad"  # unit of its positions


class CheckLog(ResultModel):
    """A log; without joints if it cannot be filtered."""

    log: str = Field(description="Name of the log")
    joints: list[CheckJoint] = Field(description="One entry per joint, in order; empty if it cannot be filtered")

    @classmethod
    def of(cls, log: str, motions: Sequence[JointMotion], arm: Arm) -> "CheckLog":
        """Return the motion of an arm's joints."""
        joints = [
            CheckJoint(joint=j + 1, name=arm.joint_names[j], unit="rad" if arm.revolute[j] else "m", **asdict(each))
            for j, each in enumerate(motions)
        ]
        return cls(log=log, joints=joints)


class Check(DiagnosedResult):
    """What `rx90 check --json` prints."""

    robot: str = Field(description="Name of the robot")
    verdict: Literal["good", "weak", "wrong"] = Field(description="Worst severity of all checks")
    logs: list[CheckLog] = Field(description="Motion of the joints")

    @classmethod
    def of(cls, checked: Checked, arm: Arm) -> "Check":
        """Return the result of a check."""
        return cls(
            robot=arm.name,
            verdict=checked.found.severity.value,
            logs=[CheckLog.of(name, motions, arm) for name, motions in checked.logs],
            **cls.values_of(checked.found),
        )

    @property
    def headline(self) -> str:
        """The verdict in one line, with the largest effect on a gain."""
        found = self.found
        checks = f"({many(len(found.diagnoses), 'check')} of {self.robot} logs)"
        if found.severity is Severity.GOOD:
            return f"GOOD, no fault {checks}"
        label = "USABLE, " if found.severity is Severity.WEAK else "WRONG: "
        effects = [worst for each in found.findings if (worst := each.worst) and worst.deviations is not None]
        if not effects:
            return f"{label}{self.counted} {checks}"
        most = max(effects, key=lambda each: abs(each.percent))
        size = "100 % or more" if abs(most.percent) >= 100.0 else f"{two_digits(abs(most.percent))} %"
        return f"{label}{self.counted} {checks}: the gain of joint {most.joint + 1} off by {size}"

    @property
    def mood(self) -> Mood:
        """Assessment of the verdict."""
        return MOODS[self.found.severity]

    def parts(self) -> Iterable[Part]:
        """Findings and advice, conclusions, and for files every check and the motion of each joint."""
        yield from doubt_paragraphs(self.found, strong=False)
        yield from self.undetected_note()
        yield from self.every_check("All checks")
        yield from horizon_fold(self.excluded, self.untold, file_only=True)
        yield from motion_parts(self.logs)


def short_names(paths: Sequence[str]) -> tuple[str, ...]:
    """Return names of files without folders and endings, or unchanged if these are ambiguous."""
    stems = tuple(Path(path).stem for path in paths)
    return stems if len(set(stems)) == len(stems) else tuple(paths)


def motion_parts(logs: Sequence[CheckLog]) -> list[Part]:
    """Return a table of the motion of the joints for each log; not on a screen."""
    names = short_names([log.log for log in logs])
    moved = {name: log.joints for name, log in zip(names, logs, strict=True) if log.joints}
    if not moved:
        return []
    parts: list[Part] = [Heading("Motion and joint ranges", file_only=True)]
    for name, joints in moved.items():
        units = dict.fromkeys(each.unit for each in joints)
        place, speed, rate = (", ".join(f"{each}{per}" for each in units) for per in ("", "/s", "/s^2"))
        parts.append(
            table(
                joints,
                column("Joint", lambda each: each.joint),
                column("Name", lambda each: each.name, words=True),
                column(f"From [{place}]", lambda each: f"{np.round(each.low, 3):.3f}"),
                column(f"To [{place}]", lambda each: f"{np.round(each.high, 3):.3f}"),
                column("Of its range [%]", lambda each: percent(each.covered, ".0f")),
                column(f"Fastest [{speed}]", lambda each: number(each.speed, "#.3g")),
                column(f"Rms acceleration [{rate}]", lambda each: number(each.acceleration_rms, "#.3g")),
                column("Slow [% of time]", lambda each: percent(each.slow, ".0f")),
                column("Rms current [units]", lambda each: number(each.current_rms, "#.3g")),
                title=f"Motion of {name}",
                file_only=True,
            )
        )
    return parts
