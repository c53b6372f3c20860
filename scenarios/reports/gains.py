"""Common parts of reports of gains: interval and contributions, their meaning, notes and reasons."""

from collections.abc import Sequence

import numpy as np

from ident.diagnosis.alternative import two_digits
from ident.diagnosis.diagnosis import Diagnosed
from ident.model.parameters import UNITS
from ident.support.arrays import Array
from ident.support.naming import enumerated, joint_list
from scenarios.reports.content import (
    Cell,
    Column,
    ColumnOf,
    Mood,
    Paragraph,
    Table,
    cells,
    column,
    in_unit,
    rounded,
    two_sigma,
)
from scenarios.reports.diagnoses import doubt_paragraphs
from scenarios.results.models.gains import ResultGain, ResultParameter


def interval_columns() -> tuple[ColumnOf[ResultGain], ...]:
    """Return the columns of a gain's interval and of its contributions (only in files), in percent of the gain."""

    def share(gain: ResultGain, std: float | None) -> str:
        return two_sigma(None if std is None or gain.estimate is None else std / abs(gain.estimate))

    return (
        column("2 sigma [%]", lambda gain: share(gain, gain.std)),
        column("From residual [%]", lambda gain: share(gain, gain.residual_std), file_only=True),
        column("From payload [%]", lambda gain: share(gain, gain.payload_std), file_only=True),
        column("From model [%]", lambda gain: share(gain, gain.model_std), file_only=True),
    )


MEANING = (
    "2 sigma: two standard deviations of the gain, from the residual, the payload's specified uncertainty and the "
    "model together. If the model's contribution is zero, errors of geometry, friction law and elasticity are not "
    "included."
)


def gain_unit(revolute: Array) -> str:
    """Return the unit of a column of gains."""
    return "N m/unit" if revolute.all() else "N/unit" if not revolute.any() else "N (m)/unit"


def meaning(revolute: Array) -> Paragraph:
    """Return the meaning of a table of gains: units and interval; `revolute`, (n,), is the mask of revolute joints."""
    sliding = np.flatnonzero(revolute == 0).tolist()
    if len(sliding) == len(revolute):
        return Paragraph(f"Gains in N per drive unit. {MEANING}")
    apart = f", of prismatic {joint_list(sliding)} in N per drive unit" if sliding else ""
    return Paragraph(f"Gains in N m per drive unit{apart}. {MEANING}")


def joints_named(joints: Sequence[int]) -> str:
    """`joint 2`, `joints 1 and 4` or `joints 1 to 5`, of joints from 1."""
    return f"{'joints' if joints[1:] else 'joint'} {joint_numbers(joints)}"


def joint_numbers(joints: Sequence[int]) -> str:
    """`2`, `1 and 4` or `1 to 5`, of joints from 1."""
    if len(joints) > 2 and list(joints) == list(range(joints[0], joints[-1] + 1)):
        return f"{joints[0]} to {joints[-1]}"
    return enumerated([str(joint) for joint in joints])


def budget_verdict(joints: Sequence[tuple[int, float | None, float, str | None]]) -> Paragraph:
    """Return a sentence on the size of errors, the joints within tolerance, and the dominant sources.

    The arguments have for each joint: number, relative rms error, tolerance, largest source or None.
    """
    errors = [100.0 * error for _, error, _, _ in joints if error is not None]
    by_source = dict[str, list[int]]()
    for joint, _, _, source in joints:
        if source is not None:
            by_source.setdefault(source, []).append(joint)
    if not errors:
        return Paragraph("No joint has a gain with all sources on.", Mood.BAD, strong=True)
    size = " to ".join(dict.fromkeys(two_digits(each) for each in (min(errors), max(errors))))
    tolerances = {100.0 * tolerance for _, _, tolerance, _ in joints}
    missed = [joint for joint, error, tolerance, _ in joints if error is None or error > tolerance]
    met = [joint for joint, *_ in joints if joint not in missed]
    mood = Mood.DOUBTFUL if met and missed else Mood.BAD if missed else Mood.GOOD
    few = len(met) < len(missed)
    who = "every joint" if met else "no joint"
    if met and missed:
        who = f"only {joints_named(met)}" if few else f"all but {joints_named(missed)}"
    several = met and missed and not (few and len(met) == 1)
    meets, own = ("meet", "their tolerance") if several else ("meets", "its tolerance")
    aim = f"{tolerances.pop():.3g} %" if len(tolerances) == 1 else own
    words = [f"Expected error {size} % rms: {who} {meets} {aim}"]
    if by_source:
        (first, its), *others = by_source.items()
        dominates = [f"{source} {joints_named(which)}" for source, which in others]
        words.append(", ".join([f"{first} dominates {joints_named(its)}", *dominates]))
    return Paragraph(f"{'; '.join(words)}.", mood, strong=True)


def sentence(text: str) -> str:
    """Return a text with a full stop, unless it is a question."""
    return text if text.endswith("?") else f"{text}."


def note_paragraphs(notes: Sequence[str], found: Diagnosed, revolute: Array) -> list[Paragraph]:
    """Return the meaning of units and interval, diagnoses, and a line for each note."""
    return [meaning(revolute), *doubt_paragraphs(found), *(Paragraph(sentence(f"Note: {note}")) for note in notes)]


def reason_paragraph(joint: int, reason: str) -> Paragraph:
    """Return the reason of a joint's refusal or failure."""
    return Paragraph(sentence(f"Joint {joint}: {reason}"))


def quantity_row(
    name: str, unit: str, value: float | None, spread: float | None, *shares: float | None
) -> tuple[Cell, ...]:
    """Return the cells of a number, of its uncertainty, of the unit, and of shares, all rounded by the uncertainty."""
    shown, numbers = in_unit(unit, value, spread, *shares)
    estimate, own, *others = (rounded(each, numbers[1]) for each in numbers)
    return cells(name, estimate, own, shown, *others)


def payload_tables(found: Sequence[ResultParameter]) -> list[Table]:
    """Return a table of the payload parameters that a method also estimated, if any."""
    rows = tuple(quantity_row(p.parameter, UNITS[p.parameter], p.estimate, 2.0 * p.std) for p in found)
    columns = (
        Column(title="Payload", words=True),
        Column(title="Estimate"),
        Column(title="2 sigma"),
        Column(title="Unit", words=True),
    )
    return [Table(columns=columns, rows=rows)] if rows else []
