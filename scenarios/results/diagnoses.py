"""Diagnoses of logs and of an estimate, in results: their JSON, with joints from 1, and their texts and tables."""

from collections.abc import Sequence
from pathlib import PurePath
from typing import Any

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer

from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Exclusion, Severity
from scenarios.rendering.content import Cell, Heading, Mood, Paragraph, Part, Table, column, many, table
from scenarios.rendering.result import FromOne, ResultModel

MOODS = {Severity.GOOD: Mood.GOOD, Severity.WEAK: Mood.DOUBTFUL, Severity.WRONG: Mood.BAD}
LABELS = {Severity.GOOD: "Note", Severity.WEAK: "WARNING", Severity.WRONG: "WRONG"}
VERDICTS = LABELS | {Severity.GOOD: "good"}
"""Words of the severities in a table."""
TOGETHER = "All logs together"
"""Title of the checks of no single log."""


class DiagnosedResult(ResultModel):
    """Diagnoses of logs and of an estimate, the last part of a result."""

    diagnoses: list[FromOne[Diagnosis]] = Field(description="One entry per check, the worst first")
    excluded: list[FromOne[Exclusion]] = Field(description="Faults that the logs exclude")
    untold: list[str] = Field(description="Faults that the logs cannot reveal")

    @property
    def found(self) -> Diagnosed:
        """Return the diagnoses, with joints from 0."""
        return Diagnosed(
            diagnoses=tuple(self.diagnoses), excluded=tuple(self.excluded), indistinguishable=tuple(self.untold)
        )

    @model_serializer(mode="wrap")
    def _at_the_end(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        values: dict[str, Any] = handler(self)
        last = {key: values.pop(key) for key in DiagnosedResult.model_fields if key in values}
        return values | last


def diagnosed_values(found: Diagnosed) -> dict[str, Any]:
    """Return the values of a `DiagnosedResult`."""
    untold = [*found.indistinguishable, *found.indistinguishable_together]
    return {"diagnoses": list(found.diagnoses), "excluded": list(found.excluded), "untold": untold}


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
    said = f"{LABELS[diagnosis.severity]}{f' {named}' if named else ''}: {diagnosis.sentence}"
    if diagnosis.rivals:
        more = f" and {len(diagnosis.rivals) - 1} more" if diagnosis.rivals[1:] else ""
        return f"{said}. These logs do not distinguish it from: {diagnosis.rivals[0]}{more}."
    advice = "" if diagnosis.advice is None else f" {diagnosis.advice[0].upper()}{diagnosis.advice[1:]}."
    return f"{said}{'' if said.endswith('?') else '.'}{advice}"


def horizon_paragraphs(found: Diagnosed, *, every: bool = False, expected: bool = False) -> list[Paragraph]:
    """Return one line of excluded faults and one of faults that cannot be checked, if there are any.

    With `every`, include faults of which only some cases are excluded, and those of all joints; `expected` for logs
    that are not recorded yet.
    """
    exclude = "Logs of these motions will exclude" if expected else "Excluded"
    tell = "They will not determine" if expected else "Cannot be checked with these logs"
    excluded = [each.sentence for each in found.excluded if every or each.limit is not None]
    hidden = (*found.indistinguishable, *(found.indistinguishable_together if every else ()))
    return [Paragraph(f"{said}: {'; '.join(of)}.") for said, of in ((exclude, excluded), (tell, hidden)) if of]


def counted(found: Diagnosed) -> str:
    """Return the number of findings, as `1 fault and 2 warnings`."""
    numbers = {"fault": Severity.WRONG, "warning": Severity.WEAK}
    each = {what: sum(one.severity is severity for one in found.diagnoses) for what, severity in numbers.items()}
    return " and ".join(many(count, what) for what, count in each.items() if count)


def every_check(diagnoses: Sequence[Diagnosis]) -> list[Table]:
    """Return a table of checks for each log and one for all logs together, the worst first; not on a screen."""
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
            file_only=True,
        )
        for log, own in of_log.items()
    ]


def diagnosis_parts(found: Diagnosed) -> list[Part]:
    """Return the conclusions, and for files the tables of all checks."""
    tables = every_check(found.diagnoses)
    head: list[Part] = [Heading("Diagnoses", file_only=True)] if tables or found.excluded else []
    return [*head, *tables, *horizon_paragraphs(found)]
