"""What `rx90 check` says: the verdict, what is not good, what the logs exclude and cannot tell."""

from collections.abc import Sequence
from pathlib import PurePath

from ident.arm import Arm
from ident.check import Checked
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Effect, Severity
from scenarios.reports.content import NONE, Cell, Column, Mood, Paragraph, Part, Report, Table, cells
from scenarios.reports.motion import motion_table
from scenarios.store.check_document import check_document

MOODS = {Severity.GOOD: Mood.GOOD, Severity.WEAK: Mood.DOUBTFUL, Severity.WRONG: Mood.BAD}
COLUMNS = (
    Column(title="Log", words=True),
    Column(title="What", words=True),
    Column(title="Verdict", words=True),
    Column(title="Found", words=True),
)


def check_report(checked: Checked, arm: Arm, *, every: bool = False) -> Report:
    """The verdict, what is not good and what to do about it; on request every line, and how each joint moved.

    Args:
        checked: What the check found.
        arm: That moved.
        every: Whether good lines and motions are listed too.
    """
    found = checked.found
    parts: list[Part] = list(findings(found, hint="" if every else "; --all lists them"))
    if every:
        parts.append(every_line(found))
        parts += [
            motion_table(f"Motion of {PurePath(log.recording.name).name}", log.motions, arm)
            for log in checked.logs
            if log.motions is not None
        ]
    return Report(verdict(found, arm), tuple(parts), check_document(checked, arm), MOODS[found.severity])


def verdict(found: Diagnosed, arm: Arm) -> str:
    """One line: how the logs are to be taken, with the number that matters most."""
    count = {severity: sum(each.severity is severity for each in found.diagnoses) for severity in Severity}
    checks, of = len(found.diagnoses), f"logs of {arm.name}"
    warnings = _many(count[Severity.WEAK], "warning")
    if found.severity is Severity.GOOD:
        return f"GOOD: {_many(checks, 'check')} of {of}, no fault"
    if found.severity is Severity.WEAK:
        return f"USABLE: {warnings} in {_many(checks, 'check')} of {of}{_most(found)}"
    more = f" and {warnings}" if count[Severity.WEAK] else ""
    return f"WRONG: {_many(count[Severity.WRONG], 'fault')}{more} in {_many(checks, 'check')} of {of}{_most(found)}"


def findings(found: Diagnosed, *, hint: str = "") -> list[Paragraph]:
    """A paragraph for each diagnosis that is not good, then what is good, excluded and cannot be told.

    Args:
        found: What is said of the logs.
        hint: How to see the good ones.
    """
    logs = {log for each in found.diagnoses for log in each.logs}
    parts = [Paragraph(words_of(each, several=len(logs) > 1), MOODS[each.severity]) for each in found.doubts]
    good = len(found.diagnoses) - len(found.doubts)
    parts.append(Paragraph(f"Good: {_many(good, 'check')}{hint}."))
    if found.excluded:
        parts.append(Paragraph(f"Excluded: {'; '.join(each.sentence for each in found.excluded)}."))
    if found.untold:
        parts.append(Paragraph(f"Cannot be told: {'; '.join(found.untold)}."))
    return parts


def words_of(diagnosis: Diagnosis, *, several: bool) -> str:
    """A diagnosis in words: severity, logs, what was found, what it does to the gains, what to do.

    Args:
        diagnosis: The diagnosis.
        several: Whether logs have to be named.
    """
    named = ", ".join(PurePath(log).name for log in diagnosis.logs) if several else ""
    place = f"{diagnosis.severity.value.upper()}{f' {named}' if named else ''}: "
    worst = diagnosis.worst
    effect = "" if worst is None else f"; {effect_words(worst, several=len(diagnosis.effects) > 1)}"
    advice = "" if diagnosis.advice is None else f" {diagnosis.advice[0].upper()}{diagnosis.advice[1:]}."
    rivals = f" It may as well be: {'; '.join(diagnosis.rivals)}." if diagnosis.rivals else ""
    return f"{place}{diagnosis.sentence}{effect}.{advice}{rivals}"


def effect_words(effect: Effect, *, several: bool) -> str:
    """What a fault does to a gain, or to a current where there is no gain.

    Args:
        effect: The largest of a fault.
        several: Whether there are more.
    """
    upto = "up to " if several else ""
    if effect.deviations is None:
        return f"{upto}{abs(effect.percent):.2g} % of the current of joint {effect.joint + 1}"
    return f"gain of joint {effect.joint + 1} off by {upto}{abs(effect.percent):.2g} %"


def every_line(found: Diagnosed) -> Table:
    """Everything that was looked at, the worst first."""
    return Table(columns=COLUMNS, rows=tuple(map(_row, found.diagnoses)))


def _row(diagnosis: Diagnosis) -> tuple[Cell, ...]:
    return cells(
        ", ".join(PurePath(log).name for log in diagnosis.logs) or NONE,
        diagnosis.name,
        Cell(diagnosis.severity.value, MOODS[diagnosis.severity]),
        diagnosis.sentence,
    )


def _most(found: Diagnosed) -> str:
    """The largest effect of all diagnoses that are not good."""
    effects: Sequence[Effect] = [
        worst for each in found.doubts if (worst := each.worst) is not None and worst.deviations is not None
    ]
    return f"; {effect_words(max(effects, key=lambda each: abs(each.percent)), several=False)}" if effects else ""


def _many(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"
