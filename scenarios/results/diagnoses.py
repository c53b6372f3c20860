"""Diagnoses of logs and of an estimate, and the prediction of an unseen motion, in results: their texts and tables."""

from collections.abc import Sequence
from operator import itemgetter
from pathlib import PurePath
from typing import Any

import numpy as np
from pydantic import Field, SerializerFunctionWrapHandler, model_serializer

from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Exclusion, Severity, two_digits
from ident.unseen import Unseen, UnseenJoint
from scenarios.rendering.content import Cell, ColumnOf, Heading, Mood, Paragraph, Part, column, table, verdict
from scenarios.rendering.result import FromOne, ResultModel
from scenarios.rendering.wording import many, number, percent

MOODS = {Severity.GOOD: Mood.GOOD, Severity.WEAK: Mood.DOUBTFUL, Severity.WRONG: Mood.BAD}
REFUSED = Cell("refused", Mood.DOUBTFUL)
"""Verdict on a joint without a gain."""
LABELS = {Severity.GOOD: "Note", Severity.WEAK: "WARNING", Severity.WRONG: "WRONG"}
PLANNED_LOGS = "logs of these motions"
"""Logs that are not recorded yet."""
TOGETHER = "All logs together"
"""Title of the checks of no single log."""
BARE = (
    "The motion is assumed to be bare. A factor common to all gains cancels, because the arm is identified with the "
    "same gains; a motion with a weighed payload (--unseen-payload) reveals it."
)
IDENTIFIED = (
    "The arm, with viscous and Coulomb friction, is identified from the bare motions, each time with the gains in "
    "question."
)
TOLD = (
    "Errors are norms, in % of the rms current of the joint. At most expected: three times the cross-validation error "
    "of the fit, combined with the standard deviations of arm, gain and payload; 15 % at most. Gain error by payload: "
    "error of the gain, with 2 sigma, if the payload is as specified, from this motion and the bare ones; positive if "
    "the gain is too large. The test fails beyond 3 sigma."
)


class DiagnosedResult(ResultModel):
    """Diagnoses of logs and of an estimate, the last part of a result."""

    diagnoses: list[FromOne[Diagnosis]] = Field(description="One entry per check, the worst first")
    excluded: list[FromOne[Exclusion]] = Field(description="Faults that the logs exclude")
    untold: list[str] = Field(description="Faults that the logs cannot reveal")
    largest_undetected: str | None = Field(
        None, description="The fault that the logs do not exclude with the largest effect on a gain"
    )

    @property
    def found(self) -> Diagnosed:
        """Return the diagnoses, with joints from 0."""
        return Diagnosed(
            diagnoses=tuple(self.diagnoses),
            excluded=tuple(self.excluded),
            undetectable=tuple(self.untold),
            largest_undetected=self.largest_undetected,
        )

    @staticmethod
    def values_of(found: Diagnosed) -> dict[str, Any]:
        """Return the values of these fields."""
        return {
            "diagnoses": list(found.diagnoses),
            "excluded": list(found.excluded),
            "untold": list(found.undetectable),
            "largest_undetected": found.largest_undetected,
        }

    @property
    def counted(self) -> str:
        """Return the number of findings, as `1 fault and 2 warnings`."""
        numbers = {"fault": Severity.WRONG, "warning": Severity.WEAK}
        each = {what: sum(one.severity is severity for one in self.diagnoses) for what, severity in numbers.items()}
        return " and ".join(many(count, what) for what, count in each.items() if count)

    def undetected_note(self, more: str = "") -> list[Paragraph]:
        """Return a sentence on the largest fault that the logs do not exclude, with `more`; nothing without one."""
        said = f"Note: the largest fault that these logs do not exclude: {self.largest_undetected}{more}."
        return [] if self.largest_undetected is None else [Paragraph(said)]

    def every_check(self, title: str) -> list[Part]:
        """Return a table of checks for each log and one for all together, the worst first, below a title; for files."""
        of_log = dict[str, list[Diagnosis]]()
        for each in self.diagnoses:
            of_log.setdefault(", ".join(PurePath(log).name for log in each.logs) or TOGETHER, []).append(each)
        words = LABELS | {Severity.GOOD: "good"}
        tables = [
            table(
                own,
                column("What", lambda each: each.name, words=True),
                column("Verdict", lambda each: Cell(words[each.severity], MOODS[each.severity]), words=True),
                column("Found", lambda each: each.sentence, words=True),
                title=log,
                file_only=True,
            )
            for log, own in of_log.items()
        ]
        return [Heading(title, file_only=True), *tables] if tables or self.excluded else []

    @model_serializer(mode="wrap")
    def _at_the_end(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        values: dict[str, Any] = handler(self)
        last = {key: values.pop(key, None) for key in DiagnosedResult.model_fields}
        return values | {key: value for key, value in last.items() if value is not None}


def doubt_paragraphs(found: Diagnosed, *, strong: bool = True) -> list[Paragraph]:
    """Return a paragraph for each diagnosis that is not good or was requested, the worst first."""
    several, parts = len({log for each in found.diagnoses for log in each.logs}) > 1, list[Paragraph]()
    for each in found.reported:
        logs = [PurePath(log).name for log in each.logs] if several else []
        named = ", ".join(log for log in logs if log not in each.sentence)
        said = f"{LABELS[each.severity]}{f' {named}' if named else ''}: {each.sentence}"
        said += "" if said.endswith("?") and not each.rivals else "."
        if each.rivals:
            more = f" and {len(each.rivals) - 1} more" if each.rivals[1:] else ""
            said += f" These logs do not distinguish it from: {each.rivals[0]}{more}."
        if each.advice is not None:
            said += f" {each.advice[0].upper()}{each.advice[1:]}."
        parts.append(Paragraph(said, MOODS[each.severity], strong=strong and each.severity is not Severity.GOOD))
    return parts


def horizon_fold(
    excluded: Sequence[Exclusion], untold: Sequence[str], logs: str = "these logs", *, file_only: bool = False
) -> list[Part]:
    """Return a folded table of faults that `logs` exclude or cannot reveal; nothing without any."""
    rows = [*((each.sentence, "excluded") for each in excluded), *((each, "not revealed") for each in untold)]
    fault, said = (column(title, itemgetter(k), words=True) for k, title in enumerate(("Fault", f"With {logs}")))
    rest = f"{many(len(rows), 'kind')} of faults that {logs} exclude or cannot reveal"
    return [table(rows, fault, said, shown=0, rest=rest, file_only=file_only)] if rows else []


def unseen_verdict(
    found: Unseen | None, *, this: str = "the identified gains", other: str = "the others", passed: bool | None = None
) -> list[Part]:
    """Return a sentence on the prediction error of an unseen motion by `this` and `other`; nothing without one.

    `passed` says whether the prediction is good enough; None for better than the other.
    """
    if found is None:
        return []
    passed, log = found.passed if passed is None else passed, PurePath(found.log).name
    text = f"rediction error {_digits(found.rel_error)} %"
    if found.verdict is not None:
        text += f" with {this}, {_digits(found.other_rel_error)} % with {other},"
    text += f" of the currents of {log}, not used in any fit"
    if fitted := [each.fitted_rel_error for each in found.joints if each.fitted_rel_error is not None]:
        text += f" (residual of the fit {_digits(float(np.sqrt(np.mean(np.square(fitted)))))} %)"
    if passed and found.verdict is None:
        return [Paragraph(f"P{text}.", strong=True)]
    why = ": the difference is not significant" if found.verdict == "no different" else ""
    if why and not found.loaded and found.fitted:
        why += "; a motion with a weighed payload distinguishes gains better than a bare one"
    if beyond := [each for each in found.joints if each.exceeds]:
        listed = ", ".join(f"joint {each.joint + 1} ({_digits(each.rel_error)} %)" for each in beyond)
        most = [each.largest_rel_error or 0.0 for each in beyond]
        less = " to ".join(dict.fromkeys(map(_digits, (min(most), max(most)))))
        why += f". The prediction of {log} fails on {listed}; at most {less} % is expected. Its payload, unit or sign "
        why += "is not as specified, or gains, arm model or friction are wrong"
    if wrong := [each for each in found.joints if each.doubted]:
        off = ", ".join(f"{_digits(each.gain_rel_error, sign='+')} % (joint {each.joint + 1})" for each in wrong)
        why += f". By its payload the gains are off by {off}, or the payload is not as specified"
    return [verdict(f"p{text}{why}", passed)]


def _digits(share: float | None, *, sign: str = "") -> str:
    return two_digits(100.0 * (share or 0.0), sign=sign)


def unseen_parts(
    found: Unseen | None, *, other: str = "others", told: Sequence[str] = (IDENTIFIED, TOLD)
) -> list[Part]:
    """Return the table of prediction errors by joint; nothing without an unseen motion."""
    if found is None:
        return []

    def share(title: str, name: str, form: str = ".1f") -> ColumnOf[UnseenJoint]:
        return column(f"{title} [%]", lambda joint: percent(getattr(joint, name), form))

    def gain_error(joint: UnseenJoint) -> str | None:
        if joint.gain_rel_error is None or joint.gain_rel_std is None:
            return None
        return f"{number(100.0 * joint.gain_rel_error, '+.1f')} ± {200.0 * joint.gain_rel_std:.1f}"

    number_of: ColumnOf[UnseenJoint] = column("Joint", lambda joint: joint.joint + 1)
    columns = [number_of, share("Prediction\nerror", "rel_error")]
    columns += [share(f"Error,\n{other}", "other_rel_error")] if found.verdict is not None else []
    columns += [share("Residual\nof the fit", "fitted_rel_error")] if found.fitted else []
    columns += [share("At most\nexpected", "largest_rel_error")]
    if any(each.unstated_rel is not None for each in found.joints):
        columns += [share("Not in\nthe copy", "unstated_rel")]
    if any(each.gain_rel_error is not None for each in found.joints):
        columns += [column("Gain error\nby payload [%]", gain_error)]
    notes = [*told, *([BARE] if found.fitted and not found.loaded else [])]
    title = f"Currents of {PurePath(found.log).name}, not used in any fit"
    doubts = doubt_paragraphs(Diagnosed(diagnoses=found.diagnoses))
    return [table(found.joints, *columns, title=title), *map(Paragraph, notes), *doubts]
