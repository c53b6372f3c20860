"""Payloads estimated with gains of a file, `rx90 payload-of`, and gains tested with a weighed mass, `rx90 verify`."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

from pydantic import AliasChoices, Field

import ident.parameters.payload as payload
import ident.parameters.weighing as weighing
from ident.diagnosis.diagnosis import Diagnosed, two_digits
from ident.estimation.known_gains import OTHER_UNIT
from ident.parameters.weighing import AGREES, DIFFERS, SAYS_NOTHING, CommonError, Departure, Weighed
from ident.support.naming import joint_list
from ident.unseen import Unseen
from scenarios.rendering.content import Cell, Mood, Paragraph, Part, column, table
from scenarios.rendering.result import NAME, VALUE, FromOne, ResultModel
from scenarios.rendering.wording import number, percent, plus_minus, sentence, twice, two_sigma
from scenarios.results.diagnoses import DiagnosedResult, doubt_paragraphs, unseen_parts, unseen_verdict
from scenarios.results.gains import quantity_table

if TYPE_CHECKING:
    from scenarios.gains_in_use.known_gains import Weighing

UNSEEN = "Prediction of a motion that was not used in any fit, null if none is given"

VERDICTS = {
    AGREES: Cell(AGREES, Mood.GOOD),
    DIFFERS: Cell(DIFFERS, Mood.BAD),
    SAYS_NOTHING: Cell("inconclusive", Mood.DOUBTFUL),
}


class _Estimate(ResultModel):
    """An estimate of `ident` with the contributions to its standard deviation."""

    std: float  # standard deviation, in `unit`
    residual_std: float  # contribution of the residuals to `std`, in `unit`
    gain_std: float  # contribution of the gains' standard deviations to `std`, in `unit`
    model_std: float  # contribution of the model's assumptions to `std`, in `unit`
    unit: str  # unit of the values
    estimate: float = Field(validation_alias=VALUE)  # estimate, in `unit`


class Quantity(_Estimate):
    """Mass, a coordinate of the centre, or an inertia about the centre."""

    quantity: str = Field(
        description="Name of the quantity: mass; x, y and z of the centre of mass; ixx to iyz",
        validation_alias=AliasChoices("quantity", "name"),
    )


class PayloadParameter(_Estimate):
    """A standard parameter at the origin of the last frame."""

    parameter: str = Field(validation_alias=NAME)  # name of the parameter: XX to ZZ, MX, MY, MZ or M


class Verification(DiagnosedResult):
    """What `rx90 verify --gains G --json` prints."""

    passed: bool = Field(
        description="Whether the mass from all joints agrees with the weighed one, that of no joint differs, and a "
        "motion that was not used in any fit is predicted better than with other gains, if both are given"
    )
    mass: float  # weighed mass [kg]
    mass_std: float  # standard deviation of the weighed mass [kg]
    limit: float  # number of standard deviations beyond which a mass differs significantly
    together: FromOne[Weighed]  # mass from all joints
    joints: list[FromOne[Weighed]]  # mass from each joint alone, in order
    payload: list[Quantity]  # identifiable values of the payload: mass, centre and inertia
    common: FromOne[CommonError] | None  # error of the mass that joints have in common, or null
    notes: list[str]  # what the method selected, and remarks
    unseen: FromOne[Unseen] | None = Field(None, description=UNSEEN)

    @classmethod
    def of(cls, found: weighing.Verification, diagnosed: Diagnosed, unseen: Unseen | None = None) -> "Verification":
        """Return the result of a verification."""
        return cls(
            passed=found.passed and (unseen is None or unseen.passed),
            mass=found.payload.mass,
            mass_std=found.payload.mass_std,
            limit=found.limit,
            together=found.together,
            joints=list(found.joints),
            payload=list(map(Quantity.model_validate, found.body.quantities)),
            common=weighing.common_error(found),
            notes=list(found.remarks),
            unseen=unseen,
            **cls.values_of(diagnosed),
        )

    def parts(self) -> Iterable[Part]:
        """Verdict on the gains, mass from all joints and from each alone."""
        yield self._verdict()
        yield from unseen_verdict(self.unseen, this="these gains")
        yield Paragraph(f"Weighed mass: {self.mass:.6g} kg, standard deviation {self.mass_std:.2g} kg.")
        yield table(
            [self.together, *self.joints],
            column(
                "Estimated from",
                lambda each: "all joints" if each.joint is None else f"joint {each.joint + 1}",
                words=True,
            ),
            column("Mass [kg]", lambda each: number(each.mass, ".3f")),
            column("2 sigma [kg]", lambda each: number(twice(each.std), ".3f")),
            column("From residual [kg]", lambda each: number(twice(each.residual_std), ".3f"), file_only=True),
            column("From gains [kg]", lambda each: number(twice(each.gain_std), ".3f"), file_only=True),
            column("From model [kg]", lambda each: number(twice(each.model_std), ".3f"), file_only=True),
            column("Error [%]", lambda each: percent(each.rel_error, "+.2f")),
            column("2 sigma [%]", lambda each: two_sigma(each.rel_std)),
            column("Verdict", lambda each: VERDICTS[each.verdict], words=True),
        )
        yield Paragraph(
            "The relative error of the mass from one joint equals that of its gain. 2 sigma [kg]: from residual, "
            f"gains and model; 2 sigma [%]: also from the scale. A verdict is {DIFFERS!r} beyond {self.limit:.2f} "
            "standard deviations (5 % false alarms for all verdicts together). Correlation through a bare motion "
            "that was also used for identification is neglected."
        )
        for each in self.joints:
            if each.reason is not None:
                yield Paragraph(sentence(f"Joint {(each.joint or 0) + 1}: {each.reason}"))
        yield from unseen_parts(self.unseen)
        yield from doubt_paragraphs(self.found)
        yield from (Paragraph(sentence(f"Note: {note}")) for note in self.notes)

    def _verdict(self) -> Paragraph:
        together, common = self.together, self.common
        off = [each for each in self.joints if each.verdict == DIFFERS]
        off.sort(key=lambda each: -abs(each.rel_error or 0.0) / (each.rel_std or 1.0))
        mass = f"{plus_minus(together.mass or 0.0, 2.0 * (together.std or 0.0))} kg from the currents, "
        mass += f"{self.mass:.6g} kg weighed"
        if common is None and together.verdict == AGREES and not off:
            return Paragraph(f"PASSED: {mass}, error {_error(together)}.", Mood.GOOD, strong=True)
        if common is not None:
            shown = sum(each.mass is not None for each in self.joints)
            who = "all joints" if len(common.joints) == shown else joint_list(common.joints)
            times, words = 1.0 + common.rel_error, f"off by the same {_error(common)}: check the weighed masses, here "
            words += "and of the identification"
            if not 1.0 / OTHER_UNIT < times < OTHER_UNIT:
                words = f"{two_digits(times)} times that on the scale: check the units of mass, currents and gains"
            words = f"the mass from {who} is {words}"
            for each in common.apart:
                words += f"; joint {each.joint + 1} differs from them by {_error(each)}: its gain is off"
        elif off:
            more = "; the most significant one is listed first and may bias the others" if len(off) > 1 else ""
            listed = ", ".join(f"joint {(each.joint or 0) + 1} by {_error(each)}" for each in off)
            words = f"gains are off: {listed}{more}"
        elif together.verdict == DIFFERS:
            alone = "no single joint explains it; check which payload was mounted"
            words = f"{mass}, off by {_error(together)}, and {alone}"
        else:
            words = f"the mass is inconclusive: {together.reason}"
        return Paragraph(sentence(f"FAILED: {words}"), Mood.BAD, strong=True)


def _error(of: Weighed | CommonError | Departure) -> str:
    """Return a relative error with its interval, in words."""
    error, std = of.rel_error or 0.0, of.rel_std or 0.0
    return f"{two_digits(100.0 * error, sign='+')} % (2 sigma {two_digits(200.0 * std)} %)"


class FoundPayload(DiagnosedResult):
    """What `rx90 payload-of --json` prints."""

    parameters: list[PayloadParameter]  # identifiable ones of the ten standard parameters
    covariance: list[list[float]]  # total covariance of `parameters`, in products of their units [kg m^2, kg m, kg]
    body: list[Quantity]  # mass, centre and inertia about the centre, as far as identifiable
    refused: dict[str, str]  # reasons why parameters or quantities have no value, by name
    possible: bool | None  # whether the parameters are physically consistent, null if not all are known
    joints: list[FromOne[Weighed]] = Field(
        description="Mass from each joint alone compared with that from all; empty if the latter is not significant"
    )
    notes: list[str]  # what the method selected, and remarks
    unseen: FromOne[Unseen] | None = Field(None, description=UNSEEN)
    written: str | None = None  # the file for a controller, null for none
    load: str | None = None  # the frame of that file and what it lacks, or why it was not written

    @classmethod
    def of(cls, found: "Weighing", unseen: Unseen | None) -> "FoundPayload":
        """Return the result of a payload: parameters, mass, centre and inertia, estimates of single joints."""
        own = found.payload
        return cls(
            parameters=list(map(PayloadParameter.model_validate, own.parameters)),
            covariance=own.shares.total.tolist(),
            body=list(map(Quantity.model_validate, own.body.quantities)),
            refused={**own.refused, **own.body.refused},
            possible=own.body.possible,
            joints=[] if found.verified is None else list(found.verified.joints),
            notes=list(own.selected.remarks),
            unseen=unseen,
            **cls.values_of(found.found),
        )

    def parts(self) -> Iterable[Part]:
        """Payload in the frame of the last link, with intervals that include those of the gains."""
        doubts = list(self._doubts())
        yield self.verdict(Mood.DOUBTFUL if doubts else Mood.PLAIN)
        yield from unseen_verdict(self.unseen, this="this payload")
        if self.load is not None:
            yield Paragraph(sentence(self.load), Mood.BAD if self.written is None else Mood.PLAIN, strong=True)
        stds = [[2.0 * std for std in (x.std, x.residual_std, x.gain_std, x.model_std)] for x in self.body]
        yield quantity_table((x.quantity, x.unit, x.estimate, *own) for x, own in zip(self.body, stds, strict=True))
        yield Paragraph(
            "In the frame of the last link; the inertia is about the centre of mass. 2 sigma: two standard deviations, "
            "from the residual, the gains and the model together."
        )
        for why in dict.fromkeys(self.refused[name] for name in payload.UNITS if name in self.refused):
            names = ", ".join(name for name in payload.UNITS if self.refused.get(name) == why)
            yield Paragraph(sentence(f"No {names}: {why}"))
        yield from unseen_parts(self.unseen)
        yield from doubt_paragraphs(self.found)
        yield from (Paragraph(sentence(f"Note: {note}")) for note in self.notes)
        if self.possible is False:
            words = "Note: not physically consistent; parameters within their intervals may be."
            yield Paragraph(words, Mood.DOUBTFUL)
        yield from (Paragraph(words, Mood.DOUBTFUL) for words in doubts)

    def verdict(self, mood: Mood = Mood.PLAIN) -> Paragraph:
        """Return a sentence on mass and centre."""
        found = {each.quantity: (each.estimate, 2.0 * each.std) for each in self.body}
        if "mass" not in found:
            return Paragraph("The recordings do not determine the mass of the payload.", Mood.DOUBTFUL, strong=True)
        centre = [f"{x} {plus_minus(*(1e3 * value for value in found[x]))}" for x in payload.CENTRE if x in found]
        where = f"; centre of mass at {', '.join(centre)} mm" if centre else ""
        return Paragraph(f"{plus_minus(*found['mass'])} kg (2 sigma){where}.", mood, strong=True)

    @property
    def apart(self) -> list[Weighed]:
        """Joints whose masses differ significantly from that of all."""
        return [each for each in self.joints if each.verdict == DIFFERS]

    def _doubts(self) -> Iterable[str]:
        mass = next((each.estimate for each in self.body if each.quantity == "mass"), None)
        if mass is not None and mass < 0.0:
            said = "Note: the mass is negative, but not significantly. Check that a payload was mounted and that "
            yield f"{said}bare and loaded are not swapped."
        apart = [
            f"joint {(each.joint or 0) + 1} alone {each.mass or 0.0:.3f} kg (2 sigma {2.0 * (each.std or 0.0):.3f})"
            for each in self.apart
        ]
        if apart and mass is not None:
            said = f"WARNING: the joints disagree on the mass: {', '.join(apart)}; all together {mass:.3f} kg. A gain "
            said += "is wrong or the payload moved, and the intervals do not include this; check the gains "
            yield f"{said}with rx90 verify."
