"""Report of `rx90 identify` for bare motions: ratios of gains, parameters, links, expected gains with a payload."""

from collections.abc import Sequence

from ident.diagnosis.alternative import two_digits
from ident.diagnosis.plausibility import prediction_warnings
from ident.support.arrays import Array
from scenarios.gains_in_use.model_values import FAR
from scenarios.rendering.content import (
    Column,
    Mood,
    Paragraph,
    Part,
    Report,
    Table,
    cells,
    column,
    joints_named,
    number,
    percent,
    places_of,
    rounded,
    sentence,
    table,
    two_sigma,
)
from scenarios.results.bare import BareJoint, BareParameter, BareResult, ExpectedGains
from scenarios.results.diagnoses import doubt_paragraphs, horizon_paragraphs
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


def bare_report(result: BareResult, revolute: Array) -> Report:
    """Return the report: verdict, ratios, test of given gains, expected gains, parameters, friction, links.

    `revolute`, shape (n,), states which joints are revolute.
    """
    said, joints = result.found, result.joints
    parts: list[Part] = [_ratio_table(joints, result.reference)]
    parts.append(
        Paragraph(
            f"Ratio of each gain to that of joint {result.reference}, from link parameters that joints share. Without "
            "a payload the gains are known up to a common factor, which one known gain or a motion with a weighed "
            "payload determines. Prediction error: of the currents of each fifth of the motions, by a fit to the rest."
        )
    )
    shares = {each.joint - 1: each.predicted_rel_error for each in joints if each.predicted_rel_error is not None}
    warnings = prediction_warnings(shares)
    parts += [Paragraph(sentence(f"WARNING: {each}"), Mood.DOUBTFUL, strong=True) for each in warnings]
    parts += [Paragraph(sentence(f"Joint {each.joint}: {each.reason}")) for each in joints if each.reason is not None]
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
        Paragraph(f"{left} more have relative standard deviations above {100.0 * ESSENTIAL:g} %. {BASE_PARAMETERS}")
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


def _essential(each: BareParameter) -> bool:
    return each.std < ESSENTIAL * abs(each.estimate)


def _numbers(each: BareParameter) -> tuple[str, str, str, str]:
    spread = 2.0 * each.std
    return each.parameter, rounded(each.estimate, spread), rounded(spread, spread), each.unit


def if_loaded_parts(found: ExpectedGains, names: Sequence[str]) -> list[Part]:
    """Return the expected accuracy of every gain."""
    forecast = table(
        found.joints,
        column("Joint", lambda each: each.joint),
        column("Name", lambda each: names[each.joint - 1], words=True),
        column("2 sigma of gain [%]", lambda each: two_sigma(each.rel_std, ".2g")),
        column(
            "Verdict",
            lambda each: "would be identified" if each.reason is None else f"would be refused: {each.reason}",
            words=True,
        ),
        title=f"Forecast: the same motions repeated with the payload of {found.mass:g} kg",
    )
    words = "The forecast assumes noise and friction as in these logs; load-dependent friction may increase it."
    return [forecast, Paragraph(words)]


def links_parts(links: Links | None, reason: str | None, revolute: Array) -> list[Part]:
    """Return the links as a table, with the largest deviation from the estimates; or the reason why there are none.

    `revolute`, shape (n,), states which joints are revolute.
    """
    if links is None:
        return [Paragraph(f"No parameters of single links: {reason}.")]
    unit = "kg m^2" if revolute.all() else "kg" if not revolute.any() else "kg (m^2)"
    title = "Physically consistent links, in SI, each in the frame of its joint"
    far = links.farthest_deviations
    words = (
        "Data determine only base parameters. Shown are the physically consistent links nearest to the model that "
        f"have these base parameters. {links.farthest_parameter} differs most from its estimate, by {far:.2g} "
        "standard deviations."
    )
    doubt = "" if far <= FAR else " This is too large; check the model, the gains and the data."
    return [
        table(
            links.links,
            column("Joint", lambda each: each.joint),
            column("Mass [kg]", lambda each: f"{each.mass:#.4g}"),
            column("Centre [m]", lambda each: " ".join(f"{x:z.4f}" for x in each.com), words=True),
            column(
                "ixx iyy izz ixy ixz iyz [kg m^2]",
                lambda each: _alike(each.inertia.six),
                words=True,
            ),
            column(f"Motor [{unit}]", lambda each: f"{each.motor_inertia:#.4g}"),
            title=title,
        ),
        Paragraph(words + doubt, Mood.DOUBTFUL if doubt else Mood.PLAIN),
    ]


def _alike(numbers: Sequence[float]) -> str:
    """Return numbers with the same decimals."""
    return " ".join(f"{x:z.{places_of(max(map(abs, numbers)))}f}" for x in numbers)
