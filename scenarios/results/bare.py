"""The result of bare motions: ratios of gains, parameters and links of the arm, expected gains with a payload."""

from collections.abc import Iterable, Sequence

from pydantic import Field

from ident.diagnosis.alternative import two_digits
from ident.diagnosis.plausibility import prediction_warnings
from ident.parameters.arm import Quantity
from scenarios.rendering.content import (
    Column,
    Mood,
    Paragraph,
    Part,
    Table,
    cells,
    column,
    joints_named,
    number,
    percent,
    rounded,
    sentence,
    table,
    two_sigma,
)
from scenarios.rendering.result import ResultModel
from scenarios.results.diagnoses import DiagnosedResult, doubt_paragraphs, horizon_paragraphs
from scenarios.results.links import Links

PARAMETERS = (
    Column(title="Parameter", words=True),
    Column(title="Estimate"),
    Column(title="2 sigma"),
    Column(title="Unit", words=True),
)
FRICTION = (Column(title="Joint"), *PARAMETERS)
BASE_PARAMETERS = (
    "XX to ZZ: inertia of a link about the origin of its frame; MX, MY, MZ: its first moments; Ia: motor "
    "inertia; the number is the joint's. Parameters of which only the sum is identifiable are regrouped "
    "into one of them."
)
TERMS = {
    "Fv": "Fv: viscous friction",
    "Fc": "Fc: Coulomb friction",
    "off": "off: offset",
    "cbrt": "cbrt: friction with the cube root of the speed",
    "by-direction": "by-direction: difference of viscous friction between the two directions",
    "load": "load: friction as a share of the torque of links and payload",
    "load-motor": "load-motor: friction as a share of the motor torque",
    "offset-share": "offset-share: share of the offset that is no torque",
    "rotor-share": "rotor-share: share of the inertia that is the rotor's",
    "load-through": "load-through: friction as a share of the torque of links, payload and other friction",
}
"""Meaning of the names of a joint's own columns."""
ESSENTIAL = 0.1
"""Relative standard deviation below which a parameter is essential, as usual with IDIM-LS."""


class BareParameter(ResultModel):
    """A parameter identified from bare motions."""

    parameter: str = Field(
        description="Name of the parameter, numbered by joint; several names if only their sum is identifiable"
    )
    unit: str = Field(description="Unit of the values")
    estimate: float = Field(description="Estimate, in `unit`")
    std: float = Field(description="Standard deviation, in `unit`, including that of the gains if these are given")

    @classmethod
    def of(cls, found: Quantity) -> "BareParameter":
        """Return an identified parameter."""
        return cls(parameter=found.name, unit=found.unit, estimate=found.value, std=found.std)


class BareJoint(ResultModel):
    """A joint's gain over that of the reference joint, and its friction in drive units.

    Attributes:
        joint: Number of the joint, from 1.
        name: Name of the joint in the robot's model.
        ratio: Ratio of its gain to that of the reference joint, null if not identifiable.
        rel_std: Relative standard deviation of the ratio, 0 for the reference joint; null with the ratio.
        predicted_rel_std: Predicted relative standard deviation, also for a refused ratio.
        reason: Why there is no ratio, null if there is one.
        gain: Given gain used for base parameters in SI and links [N m / drive unit]; null if none is given.
        off_std: Standard deviation of `off`, including that of the given gains; relative.
        predicted_rel_error: Norm of the prediction error of its currents, each part of the motions predicted from the
            others, relative to that of the currents; null without rows.
        fitted_rel_error: Norm of the residual of a fit of all parts, relative to that of the currents.
        friction: Friction and offset of the joint.
    """

    joint: int = Field(ge=1)
    name: str
    ratio: float | None
    rel_std: float | None
    predicted_rel_std: float
    reason: str | None
    gain: float | None = None
    off: float | None = Field(description="Relative difference between this ratio and that of the given gains")
    off_std: float | None
    predicted_rel_error: float | None = None
    fitted_rel_error: float | None = None
    friction: list[BareParameter]


class ExpectedJoint(ResultModel):
    """Expected accuracy of a joint's gain with a payload."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    rel_std: float | None = Field(
        description="Predicted relative standard deviation of the gain, null if it would be refused"
    )
    reason: str | None = Field(description="Why the gain would be refused, null if it would not")


class ExpectedGains(ResultModel):
    """Expected gains if the same motions were repeated with a payload."""

    mass: float = Field(description="Mass of the payload [kg]")
    joints: list[ExpectedJoint] = Field(description="One entry per joint, in order")

    def forecast(self, names: Sequence[str]) -> list[Part]:
        """Return the expected accuracy of every gain; `names` are those of the joints."""
        expected = table(
            self.joints,
            column("Joint", lambda each: each.joint),
            column("Name", lambda each: names[each.joint - 1], words=True),
            column("2 sigma of gain [%]", lambda each: two_sigma(each.rel_std, ".2g")),
            column(
                "Verdict",
                lambda each: "would be identified" if each.reason is None else f"would be refused: {each.reason}",
                words=True,
            ),
            title=f"Forecast: the same motions repeated with the payload of {self.mass:g} kg",
        )
        words = "The forecast assumes noise and friction as in these logs; load-dependent friction may increase it."
        return [expected, Paragraph(words)]


class BareResult(DiagnosedResult):
    """What `rx90 identify --json` prints for bare recordings alone."""

    reference: int = Field(
        ge=1, description="Number of the reference joint, from 1: the one that gives the most accurate ratios"
    )
    joints: list[BareJoint] = Field(description="One entry per joint, in order")
    base_parameters: list[BareParameter] = Field(
        description="Base parameters of the arm, divided by the gain of the reference joint"
    )
    base_parameters_si: list[BareParameter] | None = Field(
        description="Base parameters in SI units, with the given gains; null without gains"
    )
    if_loaded: ExpectedGains | None = Field(description="Expected gains with a payload, null without `--if-loaded`")
    consistent: Links | None = Field(
        description=(
            "Physically consistent links nearest to the model's; null without `--gains`, or if the model has no masses"
        )
    )
    consistent_reason: str | None = Field(description="Why there are no such links, null if there are")
    notes: list[str] = Field(description="What the method selected, and remarks")

    def parts(self) -> Iterable[Part]:
        """Verdict, ratios, comparison with given gains, findings, forecast, parameters, friction, links."""
        shares = {
            each.joint - 1: each.predicted_rel_error for each in self.joints if each.predicted_rel_error is not None
        }
        warnings = prediction_warnings(shares)
        body = [*self._ratios(warnings), *self._parameters()]
        doubtful = any(isinstance(part, Paragraph) and part.mood is Mood.DOUBTFUL for part in body)
        return [_verdict(self, Mood.DOUBTFUL if doubtful else Mood.PLAIN), *body]

    def _ratios(self, warnings: Sequence[str]) -> Iterable[Part]:
        yield _ratio_table(self.joints, self.reference)
        yield Paragraph(
            f"Ratio of each gain to that of joint {self.reference}, from link parameters that joints share. Without "
            "a payload the gains are known up to a common factor, which one known gain or a motion with a weighed "
            "payload determines. Prediction error: of the currents of each fifth of the motions, by a fit to the rest."
        )
        yield from (Paragraph(sentence(f"WARNING: {each}"), Mood.DOUBTFUL, strong=True) for each in warnings)
        for each in self.joints:
            if each.reason is not None:
                yield Paragraph(sentence(f"Joint {each.joint}: {each.reason}"))
        for each in self.joints:
            if each.off is not None:
                yield Paragraph(_off_words(each.joint, each.off, each.off_std or 0.0, self.reference))
        yield from doubt_paragraphs(self.found)
        yield from (Paragraph(sentence(f"Note: {note}")) for note in self.notes if note not in warnings)
        yield from horizon_paragraphs(self.found)
        if self.if_loaded is not None:
            yield from self.if_loaded.forecast([each.name for each in self.joints])

    def _parameters(self) -> Iterable[Part]:
        known = self.base_parameters_si
        shown = self.base_parameters if known is None else known
        unit = f"over the gain of joint {self.reference}" if known is None else "in SI"
        rows = tuple(cells(*_numbers(each)) for each in shown if each.std < ESSENTIAL * abs(each.estimate))
        yield Table(title=f"Essential base parameters, {unit}", columns=PARAMETERS, rows=rows)
        yield Paragraph(
            f"{len(shown) - len(rows)} more have relative standard deviations above {100.0 * ESSENTIAL:g} %. "
            f"{BASE_PARAMETERS}"
        )
        own = tuple(cells(str(each.joint), *_numbers(term)) for each in self.joints for term in each.friction)
        yield Table(title="Friction and offset, in drive units", columns=FRICTION, rows=own)
        there = {term.parameter.partition(" ")[0] for each in self.joints for term in each.friction}
        yield Paragraph(f"{'; '.join(words for name, words in TERMS.items() if name in there)}.")
        if self.consistent is None:
            yield Paragraph(f"No parameters of single links: {self.consistent_reason}.")
        else:
            yield from self.consistent.parts()


def _verdict(result: BareResult, mood: Mood) -> Paragraph:
    """Return the verdict: joints with a ratio, and its accuracy."""
    others = [each for each in result.joints if each.joint != result.reference]
    refused = [each.joint for each in others if each.ratio is None]
    found = {each.joint: 200.0 * (each.rel_std or 0.0) for each in others if each.ratio is not None}
    gains = f"the gains of {joints_named(list(found))}" if found else "no gain"
    text = f"Bare motions give {gains} as a ratio to that of joint {result.reference}"
    within = f" (2 sigma {min(found.values()):.2g} to {max(found.values()):.2g} %)" if found else ""
    without = f"; they do not determine {joints_named(refused)}" if refused else ""
    warned = "" if mood is Mood.PLAIN else " See the warnings below."
    return Paragraph(f"{text}{within}{without}.{warned}", mood, strong=True)


def _ratio_table(joints: Sequence[BareJoint], reference: int) -> Table:
    def verdict(each: BareJoint) -> str:
        return "reference" if each.joint == reference else "refused" if each.ratio is None else "identified"

    return table(
        joints,
        column("Joint", lambda each: each.joint),
        column("Name", lambda each: each.name, words=True),
        column("Gain ratio", lambda each: number(each.ratio, ".4f")),
        column("2 sigma [%]", lambda each: two_sigma(each.rel_std)),
        column("Prediction error [% of rms]", lambda each: percent(each.predicted_rel_error, ".2f")),
        column("Verdict", verdict, words=True),
    )


def _off_words(joint: int, off: float, std: float, reference: int) -> str:
    side = "below" if off < 0.0 else "above"
    words = f"The ratio of joint {joint} to joint {reference} is {two_digits(100.0 * abs(off))} % {side}"
    return f"{words} that of the given gains (2 sigma {two_digits(200.0 * std)} %)."


def _numbers(each: BareParameter) -> tuple[str, str, str, str]:
    spread = 2.0 * each.std
    return each.parameter, rounded(each.estimate, spread), rounded(spread, spread), each.unit
