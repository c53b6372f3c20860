"""Effect of a-priori gains: results with these, with the identified gains, and true or weighed values."""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from pydantic import Field

from ident.diagnosis.alternative import two_digits
from ident.estimation.estimate import IdentifiedGain, JointResult
from ident.parameters.payload import UNITS
from ident.parameters.weighing import GainsOutcome
from ident.payload.payload import Payload
from scenarios.rendering.content import (
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
from scenarios.rendering.result import ResultModel

if TYPE_CHECKING:  # not needed by a process that only identifies
    from scenarios.experiments.judge import CostVerdict


SHOWN = 7
"""Mass, centre and moments of inertia; the products of inertia are only in files."""
STATED = (
    "Intervals with a-priori gains include the errors of these gains only if their standard deviations are specified."
)
JUDGED = (
    f"The payload was not used for identification. {STATED} Errors of the arm and of torques are norms, in % of "
    "the true ones; 2 sigma of the arm's error follows from the standard deviations of its parameters."
)


class CostQuantity(ResultModel):
    """Mass, a coordinate of the centre, or an inertia of the payload; null if not identifiable."""

    quantity: str = Field(description="Name of the quantity: mass; x, y and z of the centre of mass; ixx to iyz")
    unit: str = Field(description="Unit of the values")
    true: float | None = Field(description="True value of the mounted payload, null if unknown, in `unit`")
    stated: float | None = Field(description="Specified value, null if not specified, in `unit`")
    a_priori: float | None = Field(description="Estimate with the a-priori gains, in `unit`")
    a_priori_std: float | None = Field(
        description="Standard deviation of that estimate, in `unit`, without errors of the a-priori gains"
    )
    found: float | None = Field(
        description="Estimate with the identified gains, in `unit`; null where these come from the same recordings"
    )
    found_std: float | None = Field(
        description="Standard deviation of that estimate, in `unit`, including that of the gains"
    )


class CostJoint(ResultModel):
    """A single joint: its gains, its estimate of the mass, its predicted torque."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    a_priori_gain: float | None = Field(description="A-priori gain [N m / drive unit], null where none is specified")
    gain: float | None = Field(description="Identified gain [N m / drive unit], null if refused")
    rel_difference: float | None = Field(
        description="Relative difference: ratio of a-priori to identified gain, minus one; null unless both exist"
    )
    a_priori_mass: float | None = Field(
        description="Mass of the payload from this joint alone, with its a-priori gain; null if not identifiable [kg]"
    )
    a_priori_mass_std: float | None = Field(description="Standard deviation of that mass [kg]")
    found_mass: float | None = Field(
        description="Mass of the payload from this joint alone, with the identified gain [kg]"
    )
    found_mass_std: float | None = Field(description="Standard deviation of that mass [kg]")
    a_priori_torque_error: float | None = Field(
        description=(
            "Relative error of the torque of arm and payload on another motion, predicted with the a-priori gains; "
            "null if the torque is unknown"
        )
    )
    found_torque_error: float | None = Field(
        description="Relative error of that torque, predicted with the identified gains"
    )


class CostArm(ResultModel):
    """Identifiable parameters of the arm, all of one kind."""

    quantity: str = Field(description="Kind of the parameters: first moments, including the masses, or inertias")
    a_priori: float = Field(
        description="Relative error with the a-priori gains: norm of the error over norm of the true parameters"
    )
    a_priori_std: float = Field(
        description="Expected root mean square of this error, from the standard deviations of the parameters"
    )
    found: float | None = Field(description="Relative error with the identified gains")
    found_std: float | None = Field(
        description="Expected root mean square of this error, from the standard deviations of the parameters"
    )


class ResultCost(ResultModel):
    """Results with a-priori and with identified gains."""

    payload: list[CostQuantity] = Field(description="The payload, from all joints together")
    joints: list[CostJoint] = Field(description="One entry per joint, in order")
    arm: list[CostArm] = Field(description="Errors of the arm's parameters; empty if the true values are unknown")
    tolerance: float | None = Field(
        description="Largest relative error of the mass that passes with the identified gains, null if not specified"
    )
    passed: bool | None = Field(description="Whether the mass passes")

    @classmethod
    def of_verdict(cls, verdict: "CostVerdict", joints: Sequence[JointResult]) -> "ResultCost":
        """Return the results of a run with true values; `joints` are its gains."""
        one, two = verdict.torque_a_priori, verdict.torque_found
        rows = _joints(verdict.a_priori, verdict.found, joints)
        return cls(
            payload=[
                each.model_copy(update={"true": verdict.true[each.quantity]})
                for each in _payload(verdict.a_priori, verdict.found)
            ],
            joints=[
                each.model_copy(update={"a_priori_torque_error": one.get(j), "found_torque_error": two.get(j)})
                for j, each in enumerate(rows)
            ],
            arm=[CostArm.model_validate(each, from_attributes=True) for each in verdict.arm],
            tolerance=verdict.tolerance,
            passed=verdict.passed,
        )

    @classmethod
    def of_outcome(cls, a_priori: GainsOutcome, joints: Sequence[JointResult]) -> "ResultCost":
        """Return estimates with a-priori gains of the payload that was used to identify the gains of `joints`."""
        rows = _joints(a_priori, None, joints)
        return cls(payload=_payload(a_priori, None), joints=rows, arm=[], tolerance=None, passed=None)

    def parts(self, unit: str = "N m/unit") -> Iterable[Part]:
        """Results with a-priori and with identified gains; `unit` is that of the gains."""
        judged = self.passed is not None
        yield _verdict(self)
        yield _weight_table(self, judged=judged)
        yield _joint_table(self.joints, unit, judged=judged)
        yield Paragraph(JUDGED if judged else STATED)


def _payload(a_priori: GainsOutcome, found: GainsOutcome | None) -> list[CostQuantity]:
    stated = _stated(a_priori.weighed.payload)
    rows = list[CostQuantity]()
    for name, unit in UNITS.items():
        one, two = (None if each is None else each.weighed.body.of(name) for each in (a_priori, found))
        rows.append(
            CostQuantity(
                quantity=name,
                unit=unit,
                true=None,
                stated=stated.get(name),
                a_priori=one and one.value,
                a_priori_std=one and one.std,
                found=two and two.value,
                found_std=two and two.std,
            )
        )
    return rows


def _stated(payload: Payload) -> dict[str, float]:
    """Return the known values of a payload, by name."""
    shape = {"all": (payload.com or ()) + (payload.inertia or ()), "com": payload.com or ()}.get(payload.known, ())
    return dict(zip(UNITS, (payload.mass, *shape), strict=False))


def _joints(a_priori: GainsOutcome, found: GainsOutcome | None, joints: Sequence[JointResult]) -> list[CostJoint]:
    believed = dict(zip(a_priori.gains.joints.tolist(), a_priori.gains.value.tolist(), strict=True))
    rows = list[CostJoint]()
    for j, each in enumerate(joints):
        one, two = (None if outcome is None else outcome.weighed.joints[j].mass for outcome in (a_priori, found))
        own, gain = believed.get(j), each.value if isinstance(each, IdentifiedGain) else None
        rows.append(
            CostJoint(
                joint=j + 1,
                a_priori_gain=own,
                gain=gain,
                rel_difference=None if own is None or gain is None else own / gain - 1.0,
                a_priori_mass=one and one.value,
                a_priori_mass_std=one and one.std,
                found_mass=two and two.value,
                found_mass_std=two and two.std,
                a_priori_torque_error=None,
                found_torque_error=None,
            )
        )
    return rows


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


def _joint_table(joints: Sequence[CostJoint], unit: str, *, judged: bool) -> Table:
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


def _verdict(cost: ResultCost) -> Paragraph:
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
