"""Report of `rx90 check`: verdict, findings, faults that the logs exclude or cannot reveal."""

from collections.abc import Sequence
from pathlib import PurePath

from ident.check import Checked
from ident.diagnosis.alternative import two_digits
from ident.diagnosis.diagnosis import Diagnosed, Effect, Severity
from ident.model.arm import Arm
from scenarios.reports.content import Paragraph, Part, Report
from scenarios.reports.diagnoses import MOODS, counted, doubt_paragraphs, every_line, horizon_paragraphs, many
from scenarios.reports.motion import motion_table
from scenarios.results.models.check import Check


def check_report(checked: Checked, arm: Arm, *, every: bool = False) -> Report:
    """Return the report: verdict, findings and advice; on request every line, and the motion of each joint."""
    found, result = checked.found, Check.of(checked, arm)
    parts: list[Part] = list(findings(found, hint="" if every else "; --all lists them"))
    if every:
        parts += every_line(found.diagnoses)
        parts += [
            motion_table(f"Motion of {PurePath(log.log).name}", log.joints, arm) for log in result.logs if log.joints
        ]
    return Report(verdict(found, arm.name), tuple(parts), result.model_dump(mode="json"), MOODS[found.severity])


def verdict(found: Diagnosed, robot: str) -> str:
    """Return the verdict in one line, with its main number."""
    checks = f"({many(len(found.diagnoses), 'check')} of {robot} logs)"
    if found.severity is Severity.GOOD:
        return f"GOOD, no fault {checks}"
    label = "USABLE, " if found.severity is Severity.WEAK else "WRONG: "
    return f"{label}{counted(found)} {checks}{_most(found)}"


def findings(found: Diagnosed, *, hint: str = "") -> list[Paragraph]:
    """Return a paragraph for each finding, then the good checks, excluded faults, and faults that cannot be checked."""
    good = len(found.diagnoses) - len(found.findings)
    said = Paragraph(f"{many(good, 'check')} without a finding{hint}.")
    return [*doubt_paragraphs(found, strong=False), said, *horizon_paragraphs(found, every=True)]


def _effect_words(effect: Effect) -> str:
    """Return the effect of a fault on a gain, in words."""
    if abs(effect.percent) >= 100.0:
        return f"the gain of joint {effect.joint + 1} off by 100 % or more"
    return f"the gain of joint {effect.joint + 1} off by {two_digits(abs(effect.percent))} %"


def _most(found: Diagnosed) -> str:
    """Return the largest effect of all findings."""
    effects: Sequence[Effect] = [
        worst for each in found.findings if (worst := each.worst) is not None and worst.deviations is not None
    ]
    return f": {_effect_words(max(effects, key=lambda each: abs(each.percent)))}" if effects else ""
