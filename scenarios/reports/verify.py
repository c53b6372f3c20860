"""What `rx90 verify` says: masses against the scale, or currents against their prediction."""

from collections.abc import Sequence

import numpy as np

from ident.diagnosis.diagnosis import Diagnosed
from ident.estimation.cross_validation import TIME_BLOCKS, JointPrediction
from ident.identification import Identification
from ident.payload_identification.common_scale import CommonError, common_error
from ident.payload_identification.verification import AGREES, DIFFERS, Verification, Weighed
from ident.support.naming import joint_list
from scenarios.gains_in_use.weighing import cross_validation_result, verification_result
from scenarios.reports.content import NONE, Cell, Column, Mood, Paragraph, Part, Report, Table, cells, percent
from scenarios.reports.diagnoses import doubt_paragraphs
from scenarios.reports.gains import sentence

MASSES = (
    Column(title="From", words=True),
    Column(title="Mass", unit="kg"),
    Column(title="2 sigma", unit="kg"),
    Column(title="residual", unit="kg"),
    Column(title="gains", unit="kg"),
    Column(title="model", unit="kg"),
    Column(title="Off", unit="%"),
    Column(title="2 sigma", unit="%"),
    Column(title="Verdict", words=True),
)
MOODS = {AGREES: Mood.GOOD, DIFFERS: Mood.BAD}


def verification_report(found: Verification, diagnosed: Diagnosed) -> Report:
    """The mass from all joints and from each alone, and what that says of the gains.

    Args:
        found: The masses.
        diagnosed: What is said of the recordings.
    """
    payload = found.payload
    rows = (_row("all joints", found.together), *(_row(f"joint {k}", each) for k, each in enumerate(found.joints, 1)))
    parts: list[Part] = [
        Paragraph(f"The scale says {payload.mass:.6g} kg, standard deviation {payload.mass_std:.2g} kg."),
        Table(columns=MASSES, rows=rows),
        Paragraph(
            "Of a joint alone, the mass is off by as much as its gain. 2 sigma: two standard deviations, "
            f"in kg of residual, gains and model, in % also of the scale. A verdict is {DIFFERS!r} beyond "
            f"{found.limit:.2f} deviations, a false alarm rate of 5 % for all together. A bare motion "
            "that was also used for identification correlates the errors, which is neglected."
        ),
    ]
    reasons = [(k, each.reason) for k, each in enumerate(found.joints, 1) if each.reason is not None]
    parts += [Paragraph(sentence(f"Joint {k}: {reason}")) for k, reason in reasons]
    parts += doubt_paragraphs(diagnosed)
    parts += [Paragraph(sentence(f"Note: {remark}")) for remark in found.remarks]
    parts.append(_conclusion(found))
    return Report(
        "Gains against the scale", tuple(parts), verification_result(found, diagnosed).model_dump(mode="json")
    )


def _row(name: str, each: Weighed) -> tuple[Cell, ...]:
    verdict = Cell(each.verdict, MOODS.get(each.verdict, Mood.DOUBTFUL))
    if each.mass is None:
        return cells(name, *[NONE] * 7, verdict)
    mass = each.mass
    spreads = [f"{2.0 * std:.3f}" for std in (mass.std, mass.residual_std, mass.gain_std, mass.model_std)]
    off = percent(each.rel_error, "+.2f")
    return cells(name, f"{mass.value:.3f}", *spreads, off, percent(2.0 * (each.rel_std or 0.0), ".2f"), verdict)


def _conclusion(found: Verification) -> Paragraph:
    common = common_error(found)
    if common is not None:
        return Paragraph(f"MISSED: {_common_words(common, found)}.", Mood.BAD, strong=True)
    off = sorted(
        (each for each in found.joints if each.verdict == DIFFERS),
        key=lambda each: -abs(each.rel_error or 0.0) / (each.rel_std or 1.0),
    )
    named = ", ".join(
        f"joint {(each.joint or 0) + 1} by {_off(each.rel_error or 0.0, each.rel_std or 0.0)}" for each in off
    )
    if found.passed:
        return Paragraph("PASSED: the mass from the currents agrees with the scale.", Mood.GOOD, strong=True)
    if off:
        more = "; the most certain one is listed first and may bias the others" if len(off) > 1 else ""
        return Paragraph(f"MISSED: gains are off: {named}{more}.", Mood.BAD, strong=True)
    if found.together.verdict == DIFFERS:
        words = "the mass differs, and no single joint explains it; or the payload is not the stated one"
        return Paragraph(f"MISSED: {words}.", Mood.BAD, strong=True)
    return Paragraph(sentence(f"MISSED: the mass is inconclusive: {found.together.reason}"), Mood.BAD, strong=True)


def _common_words(common: CommonError, found: Verification) -> str:
    shown = sum(each.mass is not None for each in found.joints)
    who = "all joints" if len(common.joints) == shown else joint_list(common.joints)
    apart = "".join(
        f"; joint {each.joint + 1} departs from the others by {_off(each.rel_error, each.rel_std)}: its gain is off"
        for each in common.apart
    )
    return (
        f"{who} alike are off by {_off(common.rel_error, common.rel_std)}: check the weight, here or "
        f"where the gains were found, or all gains in common{apart}"
    )


def _off(rel_error: float, rel_std: float) -> str:
    return f"{100.0 * rel_error:+.2g} % (2 sigma {200.0 * rel_std:.2g})"


PREDICTIONS = (
    Column(title="Joint"),
    Column(title="Name", words=True),
    Column(title="Predicted within", unit="% of rms"),
    Column(title="fitted within", unit="% of rms"),
    Column(title="Gain moves by", unit="% rms"),
    Column(title="at most", unit="%"),
)


def prediction_report(identified: Identification, found: Sequence[JointPrediction]) -> Report:
    """How well each part of the motions follows from the others.

    Args:
        identified: The gains, and what is said of the recordings.
        found: How well each joint's currents are predicted.
    """
    estimate = identified.estimate
    rows = tuple(
        cells(
            str(each.joint + 1),
            estimate.joints[each.joint].joint,
            percent(each.share, ".2f"),
            percent(each.fitted, ".2f"),
            *_moves(each),
        )
        for each in found
    )
    words = (
        f"Gains from {TIME_BLOCKS - 1} of {TIME_BLOCKS} parts of each motion, currents predicted on the "
        "part left out, each part in turn. An error common to all parts, such as a wrong mass or model, "
        "stays undetected. A recording with another weight reveals it: --gains G.toml --loaded B "
        "--payload P.toml."
    )
    parts = (Table(columns=PREDICTIONS, rows=rows), Paragraph(words), *doubt_paragraphs(identified.found))
    result = cross_validation_result(identified, found)
    return Report(f"Motions predicted from each other, by {result.method}", parts, result.model_dump(mode="json"))


def _moves(each: JointPrediction) -> tuple[str, str]:
    if not len(each.gain_change):
        return NONE, NONE
    rms = float(np.sqrt(np.mean(each.gain_change**2)))
    return percent(rms, ".2f"), percent(float(np.abs(each.gain_change).max()), ".2f")
