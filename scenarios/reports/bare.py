"""What `rx90 identify` says of bare motions: ratios of gains, base parameters, friction in drive units."""

from collections.abc import Sequence

from ident.diagnosis.plausibility import prediction_warnings
from ident.support.arrays import Array
from scenarios.reports.bare_links import links_parts
from scenarios.reports.content import (
    NONE,
    VERDICT,
    Column,
    Mood,
    Paragraph,
    Part,
    Report,
    Table,
    cells,
    percent,
    rounded,
)
from scenarios.reports.diagnoses import doubt_paragraphs, horizon_paragraphs
from scenarios.reports.gains import joints_named, reason_paragraph, sentence
from scenarios.reports.payload_forecast import if_loaded_parts
from scenarios.results.models.bare import BareJoint, BareParameter, BareResult

RATIOS = (
    Column(title="Joint"),
    Column(title="Name", words=True),
    Column(title="Gain ratio"),
    Column(title="2 sigma", unit="%"),
    Column(title="Predicted within", unit="% of rms"),
    VERDICT,
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
    "load-through": "load-through: friction as a share of the torque of links, payload and other friction",
}
"""What the names of a joint's own columns mean."""
ESSENTIAL = 0.1
"""Relative deviation under which a parameter is essential: the usual limit of IDIM-LS."""


def bare_report(result: BareResult, revolute: Array) -> Report:
    """The verdict, ratios, what they say of gains given beforehand or a payload would add, parameters, friction, links.

    Args:
        result: What the motions say.
        revolute: Whether each joint turns, shape (n,).
    """
    said, joints = result.found, result.joints
    parts: list[Part] = [_ratio_table(joints, result.reference)]
    parts.append(
        Paragraph(
            f"Gains over that of joint {result.reference}, from the links that joints share. Without "
            "a payload the gains are known up to a common factor: one gain, or a motion with a weighed payload, "
            "determines it. Predicted: each fifth of the motions from the others."
        )
    )
    shares = {each.joint - 1: each.predicted_rel_error for each in joints if each.predicted_rel_error is not None}
    warnings = prediction_warnings(shares)
    parts += [Paragraph(sentence(f"WARNING: {each}"), Mood.DOUBTFUL, strong=True) for each in warnings]
    parts += [reason_paragraph(each.joint, each.reason) for each in joints if each.reason is not None]
    parts += [
        Paragraph(_off_words(each.joint, each.off, each.off_std or 0.0, result.reference))
        for each in joints
        if each.off is not None
    ]
    parts += doubt_paragraphs(said)
    parts += [Paragraph(sentence(f"Note: {note}")) for note in result.notes if note not in warnings]
    parts += horizon_paragraphs(said)
    names = [each.name for each in joints]
    parts += [] if result.if_loaded is None else if_loaded_parts(result.if_loaded, names)
    known = result.base_parameters_si
    shown = result.base_parameters if known is None else known
    unit = f"over the gain of joint {result.reference}" if known is None else "in SI"
    rows = tuple(cells(*_numbers(each)) for each in shown if _essential(each))
    left = len(shown) - len(rows)
    parts.append(Table(title=f"Essential base parameters, {unit}", columns=PARAMETERS, rows=rows))
    parts.append(
        Paragraph(f"{left} more have deviations beyond {100.0 * ESSENTIAL:g} % of themselves. {BASE_PARAMETERS}")
    )
    own = tuple(cells(str(each.joint), *_numbers(term)) for each in joints for term in each.friction)
    parts.append(Table(title="Friction and offset, in drive units", columns=FRICTION, rows=own))
    there = {term.parameter.partition(" ")[0] for each in joints for term in each.friction}
    parts.append(Paragraph(f"{'; '.join(words for name, words in TERMS.items() if name in there)}."))
    parts += links_parts(result.consistent, result.consistent_reason, revolute)
    doubtful = any(isinstance(part, Paragraph) and part.mood is Mood.DOUBTFUL for part in parts)
    verdict = _verdict(result, Mood.DOUBTFUL if doubtful else Mood.PLAIN)
    return Report("Bare motions", (verdict, *parts), result.model_dump(mode="json"))


def _verdict(result: BareResult, mood: Mood) -> Paragraph:
    """Of which joints the ratio is found, and how well."""
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
    rows = tuple(
        cells(
            str(each.joint),
            each.name,
            NONE if each.ratio is None else f"{each.ratio:.4f}",
            percent(None if each.rel_std is None else 2.0 * each.rel_std, ".2f"),
            percent(each.predicted_rel_error, ".2f"),
            "reference" if each.joint == reference else "refused" if each.ratio is None else "found",
        )
        for each in joints
    )
    return Table(columns=RATIOS, rows=rows)


def _off_words(joint: int, off: float, std: float, reference: int) -> str:
    side = "below" if off < 0.0 else "above"
    words = f"Joint {joint} is {100.0 * abs(off):.2g} % {side} what joint {reference} says"
    return f"{words} (2 sigma {200.0 * std:.2g} %), relative to the given gains."


def _essential(each: BareParameter) -> bool:
    return each.std < ESSENTIAL * abs(each.estimate)


def _numbers(each: BareParameter) -> tuple[str, str, str, str]:
    spread = 2.0 * each.std
    return each.parameter, rounded(each.estimate, spread), rounded(spread, spread), each.unit
