"""The result of bare motions: ratios of gains, parameters and links of the arm, expected gains with a payload.

A link is in the frame of its joint: axes of the link in the model file, origin on the joint. Frames and bodies fixed to
the link are included, so that `rx90 patch`, which reads the links, detects a model with other frames.
"""

from collections.abc import Iterable, Sequence

import numpy as np
from pydantic import Field

from ident.diagnosis.diagnosis import two_digits
from ident.diagnosis.plausibility import prediction_warnings
from ident.model.arm import Arm
from ident.parameters.links import FoundLinks, ModelLinks
from ident.parameters.payload import body_values
from ident.payload.payload import INERTIA_KEYS
from ident.support.arrays import Array
from scenarios.rendering.content import Cell, ColumnOf, Mood, Paragraph, Part, column, table
from scenarios.rendering.result import NAME, VALUE, ResultModel
from scenarios.rendering.wording import joints_named, number, percent, rounded, sentence, two_sigma
from scenarios.results.diagnoses import REFUSED, DiagnosedResult, doubt_paragraphs, horizon_fold
from sim.tables import InertiaTable

Vector = tuple[float, float, float]
Ten = tuple[float, float, float, float, float, float, float, float, float, float]

BASE_PARAMETERS = (
    "XX to ZZ: inertia of a link about the origin of its frame; MX, MY, MZ: its first moments; Ia: motor "
    "inertia; the number is the joint's. Parameters of which only the sum is identifiable are regrouped "
    "into one of them."
)
TERMS = {
    "Fv": "viscous friction",
    "Fc": "Coulomb friction",
    "off": "offset",
    "cbrt": "friction with the cube root of the speed",
    "by-direction": "difference of viscous friction between the two directions",
    "load": "friction as a share of the torque of links and payload",
    "load-motor": "friction as a share of the motor torque",
    "offset-share": "share of the offset that is no torque",
    "rotor-share": "share of the inertia that is the rotor's",
    "load-through": "friction as a share of the torque of links, payload and other friction",
}
"""Meaning of the names of a joint's own columns."""
ESSENTIAL = 0.1
"""Relative standard deviation below which a parameter is essential, as usual with IDIM-LS."""
FAR = 4.0
"""Largest difference of a base parameter of the consistent links from its estimate, in standard deviations."""


class BareParameter(ResultModel):
    """A parameter identified from bare motions."""

    parameter: str = Field(validation_alias=NAME)  # name, numbered by joint; several if only their sum is identifiable
    unit: str  # unit of the values
    estimate: float = Field(validation_alias=VALUE)  # estimate, in `unit`
    std: float  # standard deviation, in `unit`, including that of the gains if these are given


class BareJoint(ResultModel):
    """A joint's gain over that of the reference joint, and its friction in drive units."""

    joint: int = Field(ge=1)  # number of the joint, from 1
    name: str  # name of the joint in the robot's model
    ratio: float | None  # ratio of its gain to that of the reference joint; null if not identifiable
    rel_std: float | None  # relative standard deviation of the ratio, 0 for the reference joint
    predicted_rel_std: float  # predicted relative standard deviation, also for a refused ratio
    reason: str | None  # why there is no ratio, null if there is one
    gain: float | None = None  # given gain of base parameters in SI and of links [N m / drive unit]; null if not given
    off: float | None  # relative difference between this ratio and that of the given gains
    off_std: float | None  # standard deviation of `off`, with that of the given gains; relative
    predicted_rel_error: float | None = Field(
        None,
        description="Norm of the prediction error of its currents, each part of the motions predicted from the others, "
        "relative to that of the currents; null without rows",
    )
    fitted_rel_error: float | None = None  # norm of the residual of a fit of all parts, relative to the currents'
    friction: list[BareParameter]  # friction and offset of the joint


class Link(ResultModel, allow_inf_nan=False):
    """A physically consistent link, without bodies fixed to it."""

    joint: int = Field(ge=1)  # number of the joint, from 1
    name: str  # name of the joint that moves the link
    mass: float = Field(gt=0.0)  # mass [kg]
    com: Vector  # centre of mass in the frame of the joint [m]
    inertia: InertiaTable  # inertia about the centre of mass [kg m^2]
    motor_inertia: float = Field(ge=0.0)  # rotor inertia, joint side [kg m^2 or kg]
    motor_unit: str = "kg m^2"  # unit of the rotor inertia
    motor_found: bool  # whether the data determine the rotor inertia; false: taken from the model
    carried: Ten  # parameters of bodies fixed to the link, from the model [kg m^2, kg m, kg]
    place: Vector  # position of the joint in the frame of the preceding one [m]
    orientation: tuple[Vector, Vector, Vector]  # rotation in the preceding frame, row by row
    axis: Vector  # axis of the joint, a unit vector

    def has_frame_of(self, arm: Arm, carried: Array, *, tolerance: float) -> bool:
        """Return whether it has the frame of an arm's link, with the same bodies fixed to it, shape (n, 10)."""
        j = self.joint - 1
        own = (self.place, self.orientation, self.axis, self.carried)
        others = (arm.translation[j], arm.rotation[j], arm.axis[j], carried[j])
        return all(np.allclose(*pair, rtol=tolerance, atol=tolerance) for pair in zip(own, others, strict=True))


class Links(ResultModel, allow_inf_nan=False):
    """Physically consistent links nearest to the model's."""

    links: tuple[Link, ...] = Field(min_length=1)  # one entry per joint, in order
    farthest_parameter: str  # base parameter that differs most from its unconstrained estimate
    farthest_deviations: float = Field(ge=0.0)  # difference of that parameter, in standard deviations

    @classmethod
    def of(cls, found: FoundLinks, nominal: ModelLinks, arm: Arm) -> "Links":
        """Return the result of consistent links."""
        far = int(np.argmax(np.abs(found.moved)))
        bodies = np.array([body_values(own) for own in found.own])  # (n, 10)
        links = [
            {
                "joint": j + 1,
                "name": arm.joint_names[j],
                "mass": bodies[j, 0],
                "com": bodies[j, 1:4].tolist(),
                "inertia": dict(zip(INERTIA_KEYS, bodies[j, 4:].tolist(), strict=True)),
                "motor_inertia": found.motor[j],
                "motor_unit": "kg m^2" if arm.revolute[j] else "kg",
                "motor_found": bool(found.motor_found[j]),
                "carried": nominal.carried[j].tolist(),
                "place": arm.translation[j].tolist(),
                "orientation": arm.rotation[j].tolist(),
                "axis": arm.axis[j].tolist(),
            }
            for j in range(arm.n)
        ]
        moved = {"farthest_parameter": found.names[far], "farthest_deviations": float(abs(found.moved[far]))}
        return cls.model_validate({"links": links, **moved})

    def parts(self) -> list[Part]:
        """Return the links as a table, with the largest deviation from the estimates."""

        def alike(numbers: Sequence[float]) -> str:  # four digits of the largest
            places = max(3 - int(np.floor(np.log10(max(map(abs, numbers)) or 1e3))), 0)
            return " ".join(f"{x:z.{places}f}" for x in numbers)

        units = {each.motor_unit for each in self.links}
        motor = f"Motor [{units.pop() if len(units) == 1 else 'kg (m^2)'}]"
        doubt, inertia = self.farthest_deviations > FAR, "ixx iyy izz ixy ixz iyz [kg m^2]"
        words = (
            "Data determine only base parameters. Shown are the physically consistent links nearest to the model that "
            f"have these base parameters. {self.farthest_parameter} differs most from its estimate, by "
            f"{self.farthest_deviations:.2g} standard deviations."
        )
        words += " This is too large; check the model, the gains and the data." if doubt else ""
        listed = table(
            self.links,
            column("Joint", lambda each: each.joint),
            column("Mass [kg]", lambda each: number(each.mass, "#.4g")),
            column("Centre [m]", lambda each: " ".join(f"{x:z.4f}" for x in each.com), words=True),
            column(inertia, lambda each: alike([value for _, value in each.inertia]), words=True),
            column(motor, lambda each: number(each.motor_inertia, "#.4g")),
            title="Physically consistent links, in SI, each in the frame of its joint",
        )
        return [listed, Paragraph(words, Mood.DOUBTFUL if doubt else Mood.PLAIN)]


class BareResult(DiagnosedResult):
    """What `rx90 identify --json` prints for bare recordings alone."""

    reference: int = Field(ge=1)  # reference joint, from 1, with the most accurate ratios
    joints: list[BareJoint]  # one entry per joint, in order
    base_parameters: list[BareParameter]  # base parameters over the gain of the reference joint
    base_parameters_si: list[BareParameter] | None  # base parameters in SI units; null without gains
    consistent: Links | None  # physically consistent links nearest to the model's, null without any
    consistent_reason: str | None  # why there are no such links, null if there are
    notes: list[str]  # what the method selected, and remarks

    def parts(self) -> Iterable[Part]:
        """Verdict, ratios, comparison with given gains, findings, parameters, friction, links."""
        body = [*self._ratios(), *self._parameters()]
        doubtful = any(isinstance(part, Paragraph) and part.mood is Mood.DOUBTFUL for part in body)
        others = [each for each in self.joints if each.joint != self.reference]
        refused = [each.joint for each in others if each.ratio is None]
        found = {each.joint: 200.0 * (each.rel_std or 0.0) for each in others if each.ratio is not None}
        gains = f"the gains of {joints_named(list(found))}" if found else "no gain"
        text = f"Bare motions give {gains} as a ratio to that of joint {self.reference}"
        text += f" (2 sigma {two_digits(min(found.values()))} to {two_digits(max(found.values()))} %)" if found else ""
        text += f"; they do not determine {joints_named(refused)}" if refused else ""
        text += ". See the warnings below." if doubtful else "."
        return [Paragraph(text, Mood.DOUBTFUL if doubtful else Mood.PLAIN, strong=True), *body]

    def _ratios(self) -> Iterable[Part]:
        def verdict(each: BareJoint) -> str | Cell:
            if each.joint == self.reference:
                return "reference"
            return REFUSED if each.ratio is None else Cell("identified", Mood.GOOD)

        yield table(
            self.joints,
            column("Joint", lambda each: each.joint),
            column("Name", lambda each: each.name, words=True),
            column("Gain ratio", lambda each: number(each.ratio, ".4f")),
            column("2 sigma [%]", lambda each: two_sigma(each.rel_std)),
            column("Prediction error [% of rms]", lambda each: percent(each.predicted_rel_error, ".2f")),
            column("Verdict", verdict, words=True),
        )
        yield Paragraph(
            f"Ratio of each gain to that of joint {self.reference}, from link parameters that joints share. Without "
            "a payload the gains are known up to a common factor, which one known gain or a motion with a weighed "
            "payload determines. Prediction error: of the currents of each fifth of the motions, by a fit to the rest."
        )
        errors = {each.joint - 1: each.predicted_rel_error for each in self.joints}
        warnings = prediction_warnings({j: error for j, error in errors.items() if error is not None})
        yield from (Paragraph(sentence(f"WARNING: {each}"), Mood.DOUBTFUL, strong=True) for each in warnings)
        refused = [each for each in self.joints if each.reason is not None]
        yield from (Paragraph(sentence(f"Joint {each.joint}: {each.reason}")) for each in refused)
        for each in self.joints:
            if each.off is not None:
                size = f"{two_digits(100.0 * abs(each.off))} % {'below' if each.off < 0.0 else 'above'}"
                said = f"The ratio of joint {each.joint} to joint {self.reference} is {size} that of the given gains"
                yield Paragraph(f"{said} (2 sigma {two_digits(200.0 * (each.off_std or 0.0))} %).")
        yield from doubt_paragraphs(self.found)
        yield from (Paragraph(sentence(f"Note: {note}")) for note in self.notes if note not in warnings)
        yield from horizon_fold(self.excluded, self.untold)

    def _parameters(self) -> Iterable[Part]:
        numbers: tuple[ColumnOf[tuple[int, BareParameter]], ...] = (
            column("Parameter", lambda row: row[1].parameter, words=True),
            column("Estimate", lambda row: rounded(row[1].estimate, 2.0 * row[1].std)),
            column("2 sigma", lambda row: rounded(2.0 * row[1].std, 2.0 * row[1].std)),
            column("Unit", lambda row: row[1].unit, words=True),
        )
        known = self.base_parameters_si
        every = self.base_parameters if known is None else known
        shown = [(0, each) for each in every if each.std < ESSENTIAL * abs(each.estimate)]  # of no single joint
        unit = f"over the gain of joint {self.reference}" if known is None else "in SI"
        yield table(shown, *numbers, title=f"Essential base parameters, {unit}")
        yield Paragraph(
            f"{len(every) - len(shown)} more have relative standard deviations above {100.0 * ESSENTIAL:g} %. "
            f"{BASE_PARAMETERS}"
        )
        own = [(each.joint, term) for each in self.joints for term in each.friction]
        yield table(own, column("Joint", lambda row: row[0]), *numbers, title="Friction and offset, in drive units")
        there = {term.parameter.partition(" ")[0] for _, term in own}
        yield Paragraph("; ".join(f"{name}: {words}" for name, words in TERMS.items() if name in there) + ".")
        if self.consistent is None:
            yield Paragraph(f"No parameters of single links: {self.consistent_reason}.")
        else:
            yield from self.consistent.parts()
