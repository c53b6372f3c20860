"""Report of `rx90 verify`: estimated and weighed mass, or predicted currents."""

from collections.abc import Callable, Sequence

import numpy as np

from ident.diagnosis.alternative import two_digits
from ident.diagnosis.diagnosis import Diagnosed
from ident.estimation.cross_validation import TIME_BLOCKS, JointPrediction
from ident.estimation.known_gains import OTHER_UNIT
from ident.identification import Identification
from ident.parameters.payload import Quantity
from ident.parameters.weighing import AGREES, DIFFERS, SAYS_NOTHING, CommonError, Verification, Weighed, common_error
from ident.support.naming import joint_list
from ident.unseen import Unseen
from scenarios.gains_in_use.weighing import cross_validation_result, verification_result
from scenarios.rendering.content import (
    NONE,
    Cell,
    Mood,
    Paragraph,
    Part,
    Report,
    Table,
    column,
    percent,
    plus_minus,
    sentence,
    table,
    two_sigma,
)
from scenarios.results.diagnoses import doubt_paragraphs
from scenarios.results.unseen import unseen_parts, unseen_verdict

VERDICTS = {
    AGREES: Cell(AGREES, Mood.GOOD),
    DIFFERS: Cell(DIFFERS, Mood.BAD),
    SAYS_NOTHING: Cell("inconclusive", Mood.DOUBTFUL),
}


def verification_report(found: Verification, diagnosed: Diagnosed, unseen: Unseen | None = None) -> Report:
    """Return the report: mass from all joints and from each alone, and the verdict on the gains."""
    result = verification_result(found, diagnosed, unseen)
    payload = found.payload
    parts: list[Part] = [
        _conclusion(found),
        *unseen_verdict(result.unseen, this="these gains"),
        Paragraph(f"Weighed mass: {payload.mass:.6g} kg, standard deviation {payload.mass_std:.2g} kg."),
        _masses(found),
        Paragraph(
            "The relative error of the mass from one joint equals that of its gain. 2 sigma [kg]: from residual, "
            f"gains and model; 2 sigma [%]: also from the scale. A verdict is {DIFFERS!r} beyond {found.limit:.2f} "
            "standard deviations (5 % false alarms for all verdicts together). Correlation through a bare motion "
            "that was also used for identification is neglected."
        ),
    ]
    reasons = [(k, each.reason) for k, each in enumerate(found.joints, 1) if each.reason is not None]
    parts += [Paragraph(sentence(f"Joint {k}: {reason}")) for k, reason in reasons]
    parts += unseen_parts(result.unseen)
    parts += doubt_paragraphs(diagnosed)
    parts += [Paragraph(sentence(f"Note: {remark}")) for remark in found.remarks]
    return Report("Gains verified with the weighed mass", tuple(parts), result.model_dump(mode="json"))


def _masses(found: Verification) -> Table:
    def kilograms(std: Callable[[Quantity], float]) -> Callable[[tuple[str, Weighed]], str | None]:
        return lambda row: row[1].mass and f"{std(row[1].mass):.3f}"

    return table(
        [("all joints", found.together), *((f"joint {k}", each) for k, each in enumerate(found.joints, 1))],
        column("Estimated from", lambda row: row[0], words=True),
        column("Mass [kg]", kilograms(lambda mass: mass.value)),
        column("2 sigma [kg]", kilograms(lambda mass: 2.0 * mass.std)),
        column("From residual [kg]", kilograms(lambda mass: 2.0 * mass.residual_std), file_only=True),
        column("From gains [kg]", kilograms(lambda mass: 2.0 * mass.gain_std), file_only=True),
        column("From model [kg]", kilograms(lambda mass: 2.0 * mass.model_std), file_only=True),
        column("Error [%]", lambda row: row[1].mass and percent(row[1].rel_error, "+.2f")),
        column("2 sigma [%]", lambda row: row[1].mass and two_sigma(row[1].rel_std or 0.0)),
        column("Verdict", lambda row: VERDICTS[row[1].verdict], words=True),
    )


def _conclusion(found: Verification) -> Paragraph:
    common = common_error(found)
    if common is not None:
        return Paragraph(f"FAILED: {_common_words(common, found)}.", Mood.BAD, strong=True)
    off = sorted(
        (each for each in found.joints if each.verdict == DIFFERS),
        key=lambda each: -abs(each.rel_error or 0.0) / (each.rel_std or 1.0),
    )
    named = ", ".join(
        f"joint {(each.joint or 0) + 1} by {_off(each.rel_error or 0.0, each.rel_std or 0.0)}" for each in off
    )
    if found.passed:
        agreed = f"error {_off(found.together.rel_error or 0.0, found.together.rel_std or 0.0)}"
        return Paragraph(f"PASSED: {_weighed(found)}, {agreed}.", Mood.GOOD, strong=True)
    if off:
        more = "; the most significant one is listed first and may bias the others" if len(off) > 1 else ""
        return Paragraph(f"FAILED: gains are off: {named}{more}.", Mood.BAD, strong=True)
    if found.together.verdict == DIFFERS:
        words = (
            f"{_weighed(found)}, off by "
            f"{_off(found.together.rel_error or 0.0, found.together.rel_std or 0.0)}, and "
            "no single joint explains it; check which payload was mounted"
        )
        return Paragraph(f"FAILED: {words}.", Mood.BAD, strong=True)
    return Paragraph(sentence(f"FAILED: the mass is inconclusive: {found.together.reason}"), Mood.BAD, strong=True)


def _weighed(found: Verification) -> str:
    """Return a sentence with the mass from all joints and the weighed one."""
    mass = found.together.mass
    assert mass is not None, "a mass that agrees or differs is there"
    return f"{plus_minus(mass.value, 2.0 * mass.std)} kg from the currents, {found.payload.mass:.6g} kg weighed"


def _common_words(common: CommonError, found: Verification) -> str:
    shown = sum(each.mass is not None for each in found.joints)
    who = "all joints" if len(common.joints) == shown else joint_list(common.joints)
    apart = "".join(
        f"; joint {each.joint + 1} differs from them by {_off(each.rel_error, each.rel_std)}: its gain is off"
        for each in common.apart
    )
    times = 1.0 + common.rel_error
    if not 1.0 / OTHER_UNIT < times < OTHER_UNIT:
        return (
            f"the mass from {who} is {two_digits(times)} times that on the scale: check the units of mass, currents "
            f"and gains{apart}"
        )
    return (
        f"the mass from {who} is off by the same {_off(common.rel_error, common.rel_std)}: check the weighed masses, "
        f"here and of the identification{apart}"
    )


def _off(rel_error: float, rel_std: float) -> str:
    return f"{two_digits(100.0 * rel_error, sign='+')} % (2 sigma {two_digits(200.0 * rel_std)} %)"


def prediction_report(
    identified: Identification, found: Sequence[JointPrediction], unseen: Unseen | None = None
) -> Report:
    """Return the report of the cross-validation."""
    result = cross_validation_result(identified, found, unseen)
    estimate = identified.estimate
    words = (
        f"Cross-validation: gains from {TIME_BLOCKS - 1} of {TIME_BLOCKS} time blocks of each motion predict "
        "the currents "
        "of the block left out. An error common to all blocks, such as a wrong mass or model, is not detected; to "
        "detect it, record a motion with another payload: --gains G.toml --loaded B --payload P.toml."
    )
    parts = (
        _predicted(found),
        *unseen_verdict(result.unseen),
        table(
            found,
            column("Joint", lambda each: each.joint + 1),
            column("Name", lambda each: estimate.joints[each.joint].joint, words=True),
            column("Prediction error [% of rms]", lambda each: percent(each.share, ".2f")),
            column("Fit residual [% of rms]", lambda each: percent(each.fitted, ".2f")),
            column("Gain change [% rms]", lambda each: _moves(each)[0]),
            column("At most [%]", lambda each: _moves(each)[1]),
        ),
        Paragraph(words),
        *unseen_parts(result.unseen),
        *doubt_paragraphs(identified.found),
    )
    return Report(f"Motions predicted from each other, by {result.method}", parts, result.model_dump(mode="json"))


def _predicted(found: Sequence[JointPrediction]) -> Paragraph:
    """Return a sentence on prediction errors and changes of gains."""
    shares = [each.share for each in found]
    text = f"Currents of time blocks left out are predicted within {percent(min(shares), '.2f')} to "
    text += f"{percent(max(shares), '.2f')} % of rms"
    moves = {each.joint + 1: float(np.abs(each.gain_change).max()) for each in found if len(each.gain_change)}
    if moves:
        joint = max(moves, key=moves.__getitem__)
        text += f"; no gain changes by more than {percent(moves[joint], '.2f')} % (joint {joint})"
    return Paragraph(f"{text}.", strong=True)


def _moves(each: JointPrediction) -> tuple[str, str]:
    if not len(each.gain_change):
        return NONE, NONE
    rms = float(np.sqrt(np.mean(each.gain_change**2)))
    return percent(rms, ".2f"), percent(float(np.abs(each.gain_change).max()), ".2f")
