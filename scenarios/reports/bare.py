"""What `rx90 identify` says of bare motions: ratios of gains, base parameters, friction in drive units."""

from collections.abc import Sequence

from ident.arm_parameters.bare import GainRatios
from ident.arm_parameters.parameter_values import Parameter
from ident.arm_parameters.ratio_discrepancies import RatioDiscrepancy
from ident.diagnosis.plausibility import prediction_warnings
from ident.estimation.cross_validation import JointPrediction
from ident.model.arm import Arm
from scenarios.gains_in_use.bare import BareAnswer
from scenarios.gains_in_use.model_update.link_document import Links
from scenarios.gains_in_use.model_update.values import Unknown
from scenarios.reports.bare_links import links_parts
from scenarios.reports.content import NONE, Column, Mood, Paragraph, Part, Report, Table, cells, percent
from scenarios.reports.diagnoses import doubt_paragraphs, horizon_paragraphs
from scenarios.reports.gains import reason_paragraph, sentence
from scenarios.reports.payload_forecast import if_loaded_document, if_loaded_parts
from scenarios.results.documents import diagnosed_document

RATIOS = (
    Column(title="Joint"),
    Column(title="Name", words=True),
    Column(title="Gain ratio"),
    Column(title="2 sigma", unit="%"),
    Column(title="Predicted within", unit="% of rms"),
    Column(title="Verdict", words=True),
)
PARAMETERS = (
    Column(title="Parameter", words=True),
    Column(title="Found"),
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
}
"""What the names of a joint's own columns mean."""
ESSENTIAL = 0.1
"""Relative deviation under which a parameter is essential: the usual limit of IDIM-LS."""


def bare_report(answer: BareAnswer, links: Links | Unknown, arm: Arm) -> Report:
    """Ratios, what they say of gains believed beforehand, what a payload would add, parameters, friction, links.

    Args:
        answer: What the motions say.
        links: Physically consistent set, or why there is none.
        arm: The arm.
    """
    found, in_si, off = answer.found, answer.in_si, answer.off
    ratios = found.ratios
    assert ratios is not None, "asked of motions whose gains are not held"
    parts: list[Part] = [_ratio_table(ratios, answer.predicted, arm)]
    parts.append(
        Paragraph(
            f"Gains over that of joint {ratios.reference + 1}, from the links that joints share. Without "
            "a payload the gains are known up to a common factor: one gain, or a motion with a weighed "
            "payload, determines it. Predicted: each fifth of the motions from the others."
        )
    )
    warnings = prediction_warnings(answer.predicted)
    parts += [Paragraph(sentence(f"WARNING: {each}"), Mood.DOUBTFUL, strong=True) for each in warnings]
    reasons = ((j, ratios.reason(j)) for j in range(arm.n))
    parts += [reason_paragraph(j + 1, reason) for j, reason in reasons if reason is not None]
    parts += [Paragraph(_off_words(each, ratios.reference)) for each in off]
    parts += doubt_paragraphs(answer.said)
    parts += [Paragraph(sentence(f"Note: {remark}")) for remark in found.selected.remarks]
    parts += horizon_paragraphs(answer.said)
    parts += [] if answer.if_loaded is None else if_loaded_parts(answer.if_loaded, arm)
    shown = found if in_si is None else in_si
    unit = "in SI" if in_si is not None else f"over the gain of joint {ratios.reference + 1}"
    rows = tuple(cells(*_numbers(each)) for each in shown.inertial if _essential(each))
    left = len(shown.inertial) - len(rows)
    parts.append(Table(title=f"Essential base parameters, {unit}", columns=PARAMETERS, rows=rows))
    parts.append(
        Paragraph(f"{left} more have deviations beyond {100.0 * ESSENTIAL:g} % of themselves. {BASE_PARAMETERS}")
    )
    own = tuple(cells(str(j), *_numbers(each)) for j, all_of in enumerate(found.friction, 1) for each in all_of)
    parts.append(Table(title="Friction and offset, in drive units", columns=FRICTION, rows=own))
    there = {each.name.partition(" ")[0] for all_of in found.friction for each in all_of}
    parts.append(Paragraph(f"{'; '.join(words for name, words in TERMS.items() if name in there)}."))
    parts += links_parts(links, arm.revolute)
    return Report("Bare motions", tuple(parts), _document(answer, links, arm))


def _ratio_table(ratios: GainRatios, predicted: Sequence[JointPrediction], arm: Arm) -> Table:
    share = {each.joint: each.share for each in predicted}
    rows = tuple(
        cells(
            str(j + 1),
            arm.joint_names[j],
            f"{ratios.value[j]:.4f}" if ratios.given[j] else NONE,
            percent(2.0 * float(ratios.rel_std[j]) if ratios.given[j] else None, ".2f"),
            percent(share.get(j), ".2f"),
            "reference" if j == ratios.reference else "found" if ratios.given[j] else "refused",
        )
        for j in range(arm.n)
    )
    return Table(columns=RATIOS, rows=rows)


def _off_words(each: RatioDiscrepancy, reference: int) -> str:
    side = "below" if each.rel < 0.0 else "above"
    words = f"Joint {each.joint + 1} is {100.0 * abs(each.rel):.2g} % {side} what joint {reference + 1} says"
    return f"{words} (2 sigma {200.0 * each.std:.2g} %), beside the gains that are given."


def _essential(each: Parameter) -> bool:
    return each.std < ESSENTIAL * abs(each.value)


def _numbers(each: Parameter) -> tuple[str, str, str, str]:
    return each.name, f"{each.value:.4f}", f"{2.0 * each.std:.4f}", each.unit


def _document(answer: BareAnswer, links: Links | Unknown, arm: Arm) -> dict[str, object]:
    found, in_si = answer.found, answer.in_si
    ratios = found.ratios
    assert ratios is not None, "asked of motions whose gains are not held"
    moved = {each.joint: each for each in answer.off}
    share = {each.joint: each for each in answer.predicted}
    return {
        "reference": ratios.reference + 1,
        "joints": [
            {
                "joint": j + 1,
                "name": arm.joint_names[j],
                "ratio": float(ratios.value[j]) if ratios.given[j] else None,
                "rel_std": float(ratios.rel_std[j]) if ratios.given[j] else None,
                "predicted_rel_std": float(ratios.rel_std[j]),
                "reason": ratios.reason(j),
                "off": moved[j].rel if j in moved else None,
                "off_std": moved[j].std if j in moved else None,
                "predicted_rel_error": share[j].share if j in share else None,
                "fitted_rel_error": share[j].fitted if j in share else None,
                "friction": [_parameter(each) for each in found.friction[j]],
            }
            for j in range(arm.n)
        ],
        "base_parameters": [_parameter(each) for each in found.inertial],
        "base_parameters_si": None if in_si is None else [_parameter(each) for each in in_si.inertial],
        "if_loaded": None if answer.if_loaded is None else if_loaded_document(answer.if_loaded),
        "consistent": None if isinstance(links, Unknown) else links.model_dump(mode="json"),
        "consistent_reason": links.reason if isinstance(links, Unknown) else None,
        "notes": [*prediction_warnings(answer.predicted), *found.selected.remarks],
        **diagnosed_document(answer.said),
    }


def _parameter(each: Parameter) -> dict[str, object]:
    return {"parameter": each.name, "unit": each.unit, "estimate": each.value, "std": each.std}
