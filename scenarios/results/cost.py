"""Effect of assumed gains: results with these, with the identified gains, and true or weighed values."""

from collections.abc import Iterable, Sequence
from operator import itemgetter
from typing import TYPE_CHECKING

from pydantic import Field

from ident.diagnosis.diagnosis import two_digits
from ident.estimation.estimate import IdentifiedGain, JointResult
from ident.parameters.payload import UNITS
from ident.parameters.weighing import GainsOutcome
from scenarios.experiments.verdict import ArmError
from scenarios.rendering.content import ColumnOf, Paragraph, Part, column, table, verdict
from scenarios.rendering.plot import Plot, intervals_plot
from scenarios.rendering.result import ResultModel
from scenarios.rendering.wording import in_unit, number, percent, rounded, twice, two_sigma

if TYPE_CHECKING:  # not needed by a process that only identifies
    from scenarios.experiments.judge import CostVerdict

SHOWN = 7
"""Mass, centre and moments of inertia; the products of inertia are only in files."""
STATED = (
    "Intervals with assumed gains include the errors of these gains only if their standard deviations are specified."
)
JUDGED = (
    f"The payload was not used for identification. {STATED} Errors of the arm and of torques are norms, in % of "
    "the true ones; 2 sigma of the arm's error follows from the standard deviations of its parameters."
)


class CostQuantity(ResultModel):
    """Mass, a coordinate of the centre, or an inertia of the payload, in `unit`; null if not identifiable."""

    quantity: str  # name of the quantity: mass; x, y and z of the centre of mass; ixx to iyz
    unit: str  # unit of the values
    true: float | None  # true value of the mounted payload, null if unknown, in `unit`
    stated: float | None  # specified value, null if not specified, in `unit`
    assumed: float | None  # estimate with the assumed gains, in `unit`
    assumed_std: float | None  # standard deviation, in `unit`, without errors of the assumed gains
    found: float | None  # estimate with the identified gains, in `unit`; null where these come from the same recordings
    found_std: float | None  # standard deviation, in `unit`, including that of the gains


class CostJoint(ResultModel):
    """A single joint: its gains, the mass of the payload from it alone, its predicted torque."""

    joint: int = Field(ge=1)  # number of the joint, from 1
    assumed_gain: float | None  # assumed gain [N m / drive unit], null where none is specified
    gain: float | None  # identified gain [N m / drive unit], null if refused
    rel_change: float | None  # ratio of identified to assumed gain, minus one; null without
    assumed_mass: float | None  # mass with its assumed gain; null if not identifiable [kg]
    assumed_mass_std: float | None  # standard deviation of that mass [kg]
    found_mass: float | None  # mass with the identified gain [kg]
    found_mass_std: float | None  # standard deviation of that mass [kg]
    assumed_torque_error: float | None = Field(
        description="Relative error of the torque of arm and payload on another motion, predicted with the assumed "
        "gains; null if the torque is unknown"
    )
    found_torque_error: float | None  # relative error of that torque with the identified gains


class ResultCost(ResultModel):
    """Results with assumed and with identified gains."""

    payload: list[CostQuantity]  # the payload, from all joints together
    joints: list[CostJoint]  # one entry per joint, in order
    arm: list[ArmError]  # errors of the arm's parameters; empty if the true values are unknown
    tolerance: float | None  # largest relative error of the mass that passes, null if not specified
    passed: bool | None  # whether the mass passes

    @classmethod
    def of(
        cls, assumed: GainsOutcome, joints: Sequence[JointResult], judged: "CostVerdict | None" = None
    ) -> "ResultCost":
        """Return the results with assumed gains beside those with the identified gains of `joints`.

        Without a verdict, the payload is the one that the gains were identified with.
        """
        payload, outcomes = assumed.weighed.payload, {"assumed": assumed, "found": judged and judged.found}
        shape = {"all": (payload.com or ()) + (payload.inertia or ()), "com": payload.com or ()}.get(payload.known, ())
        stated = dict(zip(UNITS, (payload.mass, *shape), strict=False))
        curves = {j: each.curve for j, each in enumerate(joints) if isinstance(each, IdentifiedGain) and each.curve}
        believed = assumed.gains.at_currents_of(curves).by_joint

        def alone(j: int, joint: JointResult) -> CostJoint:
            own, gain = believed.get(j), joint.value if isinstance(joint, IdentifiedGain) else None
            masses = {f"{gains}_mass": each and each.weighed.joints[j].mass for gains, each in outcomes.items()}
            masses |= {f"{gains}_mass_std": each and each.weighed.joints[j].std for gains, each in outcomes.items()}
            return CostJoint(
                joint=j + 1,
                assumed_gain=own,
                gain=gain,
                rel_change=None if own is None or gain is None else gain / own - 1.0,
                assumed_torque_error=judged and judged.torque_assumed.get(j),
                found_torque_error=judged and judged.torque_found.get(j),
                **masses,
            )

        def together(name: str, unit: str) -> CostQuantity:
            found = {gains: each and each.weighed.body.of(name) for gains, each in outcomes.items()}
            numbers = {gains: each and each.value for gains, each in found.items()}
            numbers |= {f"{gains}_std": each and each.std for gains, each in found.items()}
            true = judged and judged.true[name]
            return CostQuantity(quantity=name, unit=unit, true=true, stated=stated.get(name), **numbers)

        return cls.model_validate(
            {
                "payload": [together(*each) for each in UNITS.items()],
                "joints": [alone(*each) for each in enumerate(joints)],
                "arm": [] if judged is None else list(judged.arm),
                "tolerance": judged and judged.tolerance,
                "passed": judged and judged.passed,
            }
        )

    def parts(self, unit: str = "N m/unit") -> Iterable[Part]:
        """Results with assumed and with identified gains; `unit` is that of the gains."""
        judged = self.passed is not None
        if not judged:
            yield self.verdict()

        def row(each: CostQuantity) -> tuple[str, ...]:
            numbers = each.assumed, twice(each.assumed_std), each.found, twice(each.found_std)
            true = each.true if judged else each.stated
            unit, (before, wide, after, narrow, true) = in_unit(each.unit, *numbers, true)
            pairs = (before, wide), (wide, wide), (after, narrow), (narrow, narrow), (true, narrow if judged else wide)
            return each.quantity, *(rounded(*pair) for pair in pairs), unit

        last = "True" if judged else "Specified"
        titles = ("Payload", "Assumed", "2 sigma", "Identified", "2 sigma", last, "Unit")
        columns: list[ColumnOf[tuple[str, ...]]] = [
            column(titles[k], itemgetter(k), words=k in (0, 6)) for k in range(7) if judged or k not in (3, 4)
        ]
        title = "The payload with assumed gains" + (" and with identified gains" if judged else "")
        yield table(map(row, self.payload), *columns, title=title, shown=SHOWN, rest="products of inertia")
        if self.arm:
            yield table(
                self.arm,
                column("Error of", lambda each: each.quantity, words=True),
                column("Assumed [%]", lambda each: percent(each.assumed, ".1f")),
                column("2 sigma [%]", lambda each: two_sigma(each.assumed_std, ".1f")),
                column("Identified [%]", lambda each: percent(each.found, ".1f")),
                column("2 sigma [%]", lambda each: two_sigma(each.found_std, ".1f")),
            )
        alone: list[ColumnOf[CostJoint]] = [
            column("Joint", lambda each: each.joint),
            column(f"Assumed gain [{unit}]", lambda each: number(each.assumed_gain, ".4f")),
            column(f"Identified gain [{unit}]", lambda each: number(each.gain, ".4f"), file_only=True),
            column("Identified\nminus assumed [%]", lambda each: percent(each.rel_change, "+.1f")),
            column("Mass by\nassumed gain [kg]", lambda each: number(each.assumed_mass, ".3f")),
            column("2 sigma [kg]", lambda each: number(twice(each.assumed_mass_std), ".3f")),
            column("Mass by\nidentified gain [kg]", lambda each: number(each.found_mass, ".3f")),
            column("2 sigma [kg]", lambda each: number(twice(each.found_mass_std), ".3f")),
            column("Torque\nerror,\nassumed [%]", lambda each: percent(each.assumed_torque_error, ".1f")),
            column("Torque\nerror,\nidentified [%]", lambda each: percent(each.found_torque_error, ".1f")),
        ]
        said = ", and the torque predicted on the loaded motion" if judged else ""
        title = f"Each joint alone: the mass of the payload{said}"
        yield table(self.joints, *(alone if judged else alone[:6]), title=title)
        yield Paragraph(JUDGED if judged else STATED)

    def plot_of_masses(self) -> Plot:
        """Return the plot of the error of the payload's mass from each joint alone, with either gains."""
        weight, series = self.payload[0].true or 1.0, dict[str, dict[int, tuple[float, float, float]]]()
        for label, name in (("Assumed gains", "assumed_mass"), ("Identified gains", "found_mass")):
            numbers = {each.joint: (getattr(each, name), getattr(each, f"{name}_std")) for each in self.joints}
            found = {j: (100.0 * (m / weight - 1.0), 200.0 * std / weight) for j, (m, std) in numbers.items() if m}
            series[label] = {j: (off, off - reach, off + reach) for j, (off, reach) in found.items()}
        title, said = "Mass of the payload from each joint alone", "Error of the mass, two standard deviations."
        joints = [each.joint for each in self.joints]
        return intervals_plot(title, said, "Error of the mass [%]", joints, series, limit=0.0)

    def verdict(self) -> Paragraph:
        """Return a sentence on the mass with both sets of gains, and on the single joint with the largest error."""
        mass = self.payload[0]
        weight = mass.stated if mass.true is None else mass.true
        assert weight is not None, "a weight has a mass"

        def off(mass: float | None) -> str:
            change = two_digits(100.0 * ((mass or 0.0) / weight - 1.0), sign="+")
            return "no mass" if mass is None else f"{mass:.3f} kg ({change} %)"

        said = f"he payload of {weight:g} kg: with the assumed gains {off(mass.assumed)}"
        alone = {each.joint: (each.assumed_mass, each.assumed_mass_std or 0.0) for each in self.joints}
        beyond = {j: abs(found - weight) - 2.0 * std for j, (found, std) in alone.items() if found is not None}
        if beyond:
            worst = max(beyond, key=beyond.__getitem__)
            said += f" from all joints, {off(alone[worst][0])} from joint {worst} alone"
        if self.passed is None:
            return Paragraph(f"T{said}. The identified gains reproduce this mass, as they were identified with it.")
        said += f"; with identified gains {off(mass.found)}, tolerance {100.0 * (self.tolerance or 0.0):.3g} %"
        return verdict(f"t{said}", self.passed)
