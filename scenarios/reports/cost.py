"""Report of the effect of a-priori gains: results with these and with identified gains, and true values."""

from collections.abc import Sequence

from ident.diagnosis.alternative import two_digits
from ident.support.arrays import Array
from scenarios.reports.content import (
    NONE,
    Cell,
    Column,
    Mood,
    Paragraph,
    Part,
    Table,
    cells,
    in_unit,
    number,
    percent,
    rounded,
)
from scenarios.reports.gains import gain_unit
from scenarios.results.models.cost import CostJoint, CostQuantity, ResultCost

SHOWN = 7
"""Mass, centre and moments of inertia; the products of inertia are only in files."""
STATED = (
    "Intervals with a-priori gains include the errors of these gains only if their standard deviations are specified."
)
JUDGED = (
    f"The payload was not used for identification. {STATED} Errors of the arm and of torques are norms, in % of "
    "the true ones; 2 sigma of the arm's error follows from the standard deviations of its parameters."
)


def cost_parts(cost: ResultCost | None, revolute: Array) -> list[Part]:
    """Return results with a-priori and with identified gains; nothing if not requested.

    `revolute`, shape (n,), states which joints are revolute.
    """
    if cost is None:
        return []
    judged = cost.passed is not None
    tables = _weight_table(cost, judged=judged), _joint_table(cost.joints, revolute, judged=judged)
    return [_said(cost), *tables, Paragraph(JUDGED if judged else STATED)]


def _weight_table(cost: ResultCost, *, judged: bool) -> Table:
    found = (Column(title="Identified"), Column(title="2 sigma")) if judged else ()
    columns = (
        Column(title="With the gains", words=True),
        Column(title="A-priori"),
        Column(title="2 sigma"),
        *found,
        Column(title="True" if judged else "Specified"),
        Column(title="Unit", words=True),
    )
    rows = [_weight_row(each, judged=judged) for each in cost.payload]
    rows[SHOWN:SHOWN] = [
        cells(
            f"error of {each.quantity}",
            *(percent(share, ".1f") for share in (each.a_priori, _twice(each.a_priori_std))),
            *(percent(share, ".1f") for share in (each.found, _twice(each.found_std))),
            NONE,
            "%",
        )
        for each in cost.arm
    ]
    shown, rest = SHOWN + len(cost.arm), "products of inertia"
    title = "Results with a-priori gains" + (" and with identified gains" if judged else "")
    return Table(title=title, columns=columns, rows=tuple(rows), shown=shown, rest=rest)


def _weight_row(each: CostQuantity, *, judged: bool) -> tuple[Cell, ...]:
    numbers = [each.a_priori, _twice(each.a_priori_std)]
    numbers += [each.found, _twice(each.found_std)] if judged else []
    unit, shown = in_unit(each.unit, *numbers, each.true if judged else each.stated)
    spreads = [shown[1]] * 2 + [shown[3]] * 3 if judged else [shown[1]] * 3
    return cells(f"payload: {each.quantity}", *(rounded(*pair) for pair in zip(shown, spreads, strict=True)), unit)


def _joint_table(joints: Sequence[CostJoint], revolute: Array, *, judged: bool) -> Table:
    unit = gain_unit(revolute)
    columns = [
        Column(title="Joint"),
        Column(title="A-priori gain", unit=unit),
        Column(title="Identified gain", unit=unit, file_only=True),
        Column(title="Difference", unit="%"),
        Column(title="Mass,\na-priori", unit="kg"),
        Column(title="2 sigma", unit="kg"),
    ]
    if judged:
        columns += [Column(title="Mass,\nidentified", unit="kg"), Column(title="2 sigma", unit="kg")]
        columns += [
            Column(title="Torque\nerror,\na-priori", unit="%"),
            Column(title="Torque\nerror,\nidentified", unit="%"),
        ]
    rows = list[tuple[Cell, ...]]()
    for each in joints:
        row = [number(each.a_priori_gain, ".4f"), number(each.gain, ".4f"), percent(each.rel_difference, "+.1f")]
        row += [number(each.a_priori_mass, ".3f"), number(_twice(each.a_priori_mass_std), ".3f")]
        if judged:
            row += [number(each.found_mass, ".3f"), number(_twice(each.found_mass_std), ".3f")]
            row += [percent(each.a_priori_torque_error, ".1f"), percent(each.found_torque_error, ".1f")]
        rows.append(cells(str(each.joint), *row))
    said = ", and the torque predicted on the loaded motion" if judged else ""
    return Table(title=f"Each joint alone: the mass of the payload{said}", columns=tuple(columns), rows=tuple(rows))


def _twice(std: float | None) -> float | None:
    return None if std is None else 2.0 * std


def _said(cost: ResultCost) -> Paragraph:
    """Return a sentence on the mass with both sets of gains, and on the single joint with the largest error."""
    mass = cost.payload[0]
    weight = mass.stated if mass.true is None else mass.true
    assert weight is not None, "a weight has a mass"
    said = f"The payload of {weight:g} kg: with the a-priori gains {_off(mass.a_priori, weight)}"
    alone = [(each.joint, each.a_priori_mass, each.a_priori_mass_std or 0.0) for each in cost.joints]
    shown = [(joint, mass, abs(mass - weight) - 2.0 * std) for joint, mass, std in alone if mass is not None]
    if shown:
        joint, worst, _ = max(shown, key=lambda each: each[2])
        said += f" from all joints, {_off(worst, weight)} from joint {joint} alone"
    if cost.passed is None:
        return Paragraph(f"{said}. The identified gains reproduce this mass, as they were identified with it.")
    said += f"; with identified gains {_off(mass.found, weight)}, tolerance {100.0 * (cost.tolerance or 0.0):.3g} %."
    verdict, mood = ("PASSED", Mood.GOOD) if cost.passed else ("FAILED", Mood.BAD)
    return Paragraph(f"{verdict}: {said[0].lower()}{said[1:]}", mood, strong=True)


def _off(mass: float | None, weight: float) -> str:
    if mass is None:
        return "no mass"
    return f"{mass:.3f} kg ({two_digits(100.0 * (mass / weight - 1.0), sign='+')} %)"
