"""Texts of diagnoses: findings, excluded faults, and faults that cannot be checked."""

from collections.abc import Sequence
from pathlib import PurePath

from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Severity
from scenarios.reports.content import Cell, Heading, Mood, Paragraph, Part, Table, column, table

MOODS = {Severity.GOOD: Mood.GOOD, Severity.WEAK: Mood.DOUBTFUL, Severity.WRONG: Mood.BAD}
LABELS = {Severity.GOOD: "Note", Severity.WEAK: "WARNING", Severity.WRONG: "WRONG"}
VERDICTS = LABELS | {Severity.GOOD: "good"}
"""Words of the severities in a table."""
TOGETHER = "All logs together"
"""Title of the checks of no single log."""


def doubt_paragraphs(found: Diagnosed, *, strong: bool = True) -> list[Paragraph]:
    """Return a paragraph for each diagnosis that is not good or was requested, the worst first."""
    several = len({log for each in found.diagnoses for log in each.logs}) > 1
    return [
        Paragraph(
            words_of(each, several=several), MOODS[each.severity], strong=strong and each.severity is not Severity.GOOD
        )
        for each in found.reported
    ]


def words_of(diagnosis: Diagnosis, *, several: bool) -> str:
    """Return a diagnosis in words: severity, logs, finding, advice or indistinguishable faults."""
    logs = [PurePath(log).name for log in diagnosis.logs] if several else []
    named = ", ".join(log for log in logs if log not in diagnosis.sentence)
    place = f"{LABELS[diagnosis.severity]}{f' {named}' if named else ''}: "
    if diagnosis.rivals:
        more = f" and {len(diagnosis.rivals) - 1} more" if diagnosis.rivals[1:] else ""
        return f"{place}{diagnosis.sentence}. These logs do not distinguish it from: {diagnosis.rivals[0]}{more}."
    advice = "" if diagnosis.advice is None else f" {diagnosis.advice[0].upper()}{diagnosis.advice[1:]}."
    stop = "" if diagnosis.sentence.endswith("?") else "."
    return f"{place}{diagnosis.sentence}{stop}{advice}"


def horizon_paragraphs(found: Diagnosed, *, every: bool = False, expected: bool = False) -> list[Paragraph]:
    """Return one line of excluded faults and one of faults that cannot be checked, if there are any.

    With `every`, include faults of which only some cases are excluded, and those of all joints; `expected` for logs
    that are not recorded yet.
    """
    exclude, tell = (
        ("Logs of these motions will exclude", "They will not determine")
        if expected
        else ("Excluded", "Cannot be checked with these logs")
    )
    excluded = [each.sentence for each in found.excluded if every or each.limit is not None]
    together = found.indistinguishable_together if every else ()
    indistinguishable = (*found.indistinguishable, *together)
    parts = [Paragraph(f"{exclude}: {'; '.join(excluded)}.")] if excluded else []
    return [*parts, *([Paragraph(f"{tell}: {'; '.join(indistinguishable)}.")] if indistinguishable else [])]


def counted(found: Diagnosed) -> str:
    """Return the number of findings, as `1 fault and 2 warnings`."""
    numbers = {"fault": Severity.WRONG, "warning": Severity.WEAK}
    each = {what: sum(one.severity is severity for one in found.diagnoses) for what, severity in numbers.items()}
    return " and ".join(many(count, what) for what, count in each.items() if count)


def many(count: int, what: str) -> str:
    """`1 check`, `2 checks`."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def every_line(diagnoses: Sequence[Diagnosis]) -> list[Table]:
    """Return a table of checks for each log and one for all logs together, the worst first."""
    of_log = dict[str, list[Diagnosis]]()
    for each in diagnoses:
        of_log.setdefault(", ".join(PurePath(log).name for log in each.logs) or TOGETHER, []).append(each)
    return [
        table(
            own,
            column("What", lambda each: each.name, words=True),
            column("Verdict", lambda each: Cell(VERDICTS[each.severity], MOODS[each.severity]), words=True),
            column("Found", lambda each: each.sentence, words=True),
            title=log,
        )
        for log, own in of_log.items()
    ]


def diagnosis_parts(found: Diagnosed) -> list[Part]:
    """Return a table of all diagnoses and conclusions, none without checks."""
    parts: list[Part] = [*every_line(found.diagnoses)]
    parts += horizon_paragraphs(found, every=True)
    return [Heading("Diagnoses"), *parts] if parts else []
