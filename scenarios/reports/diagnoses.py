"""What is said of logs and of an estimate, in words: what is not good, what is excluded, what cannot be told."""

from collections.abc import Sequence
from pathlib import PurePath

from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Severity
from scenarios.reports.content import NONE, Cell, Heading, Mood, Paragraph, Part, Table, column, table

MOODS = {Severity.GOOD: Mood.GOOD, Severity.WEAK: Mood.DOUBTFUL, Severity.WRONG: Mood.BAD}
LABELS = {Severity.GOOD: "Note", Severity.WEAK: "WARNING", Severity.WRONG: "WRONG"}
VERDICTS = LABELS | {Severity.GOOD: "good"}
"""In a table, where what is good is no note."""


def doubt_paragraphs(found: Diagnosed, *, strong: bool = True) -> list[Paragraph]:
    """A paragraph for each diagnosis that is not good or that was asked for, the worst first."""
    several = len({log for each in found.diagnoses for log in each.logs}) > 1
    return [
        Paragraph(
            words_of(each, several=several), MOODS[each.severity], strong=strong and each.severity is not Severity.GOOD
        )
        for each in found.reported
    ]


def words_of(diagnosis: Diagnosis, *, several: bool) -> str:
    """A diagnosis in words: severity, logs, what was found, what to do or what it may be instead."""
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
    """What the logs exclude and what they cannot tell, a line each if there is something.

    With `every`, also faults of which only some cases are excluded, and what is about no joint alone; `expected` of
    logs that are still to be recorded.
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
    """`1 fault and 2 warnings`, of what is not good."""
    numbers = {"fault": Severity.WRONG, "warning": Severity.WEAK}
    each = {what: sum(one.severity is severity for one in found.diagnoses) for what, severity in numbers.items()}
    return " and ".join(many(count, what) for what, count in each.items() if count)


def many(count: int, what: str) -> str:
    """`1 check`, `2 checks`."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def every_line(diagnoses: Sequence[Diagnosis]) -> Table:
    """Everything that was looked at, the worst first."""
    return table(
        diagnoses,
        column("Log", lambda each: ", ".join(PurePath(log).name for log in each.logs) or NONE, words=True),
        column("What", lambda each: each.name, words=True),
        column("Verdict", lambda each: Cell(VERDICTS[each.severity], MOODS[each.severity]), words=True),
        column("Found", lambda each: each.sentence, words=True),
    )


def diagnosis_parts(found: Diagnosed) -> list[Part]:
    """A table of all diagnoses and what follows from them, none where nothing was looked at."""
    parts: list[Part] = [every_line(found.diagnoses)] if found.diagnoses else []
    parts += horizon_paragraphs(found, every=True)
    return [Heading("Diagnoses"), *parts] if parts else []
