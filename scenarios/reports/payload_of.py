"""Report of `rx90 payload-of`: mass, centre and inertia of a payload."""

from collections.abc import Iterator, Sequence

from ident.diagnosis.diagnosis import Diagnosed
from ident.parameters.payload import CENTRE, FoundBody, FoundPayload
from ident.parameters.weighing import DIFFERS, Weighed
from scenarios.gains_in_use.weighing import found_payload_result
from scenarios.rendering.content import Column, Mood, Paragraph, Part, Report, Table, plus_minus, sentence
from scenarios.results.diagnoses import doubt_paragraphs
from scenarios.results.gains import quantity_row

COLUMNS = (
    Column(title="Payload", words=True),
    Column(title="Estimate"),
    Column(title="2 sigma"),
    Column(title="Unit", words=True),
    Column(title="From residual", file_only=True),
    Column(title="From gains", file_only=True),
    Column(title="From model", file_only=True),
)


def payload_report(found: FoundPayload, body: FoundBody, joints: Sequence[Weighed], diagnosed: Diagnosed) -> Report:
    """Return the report: payload in the frame of the last link, with intervals that include those of the gains."""
    rows = tuple(
        quantity_row(
            each.name,
            each.unit,
            each.value,
            *(2.0 * std for std in (each.std, each.residual_std, each.gain_std, each.model_std)),
        )
        for each in body.quantities
    )
    doubts = list(_doubts(body, joints))
    parts: list[Part] = [verdict(body, Mood.DOUBTFUL if doubts else Mood.PLAIN), Table(columns=COLUMNS, rows=rows)]
    parts.append(
        Paragraph(
            "In the frame of the last link; the inertia is about the centre of mass. 2 sigma: two standard deviations, "
            "from the residual, the gains and the model together."
        )
    )
    parts += [Paragraph(sentence(f"No {name}: {reason}")) for name, reason in body.refused.items()]
    parts += doubt_paragraphs(diagnosed)
    parts += [Paragraph(sentence(f"Note: {remark}")) for remark in found.selected.remarks]
    if body.possible is False:
        words = "not physically consistent; parameters within their intervals may be"
        parts.append(Paragraph(sentence(f"Note: {words}"), Mood.DOUBTFUL))
    parts += [Paragraph(words, Mood.DOUBTFUL) for words in doubts]
    result = found_payload_result(found, body, joints, diagnosed)
    return Report("Payload estimated from currents", tuple(parts), result.model_dump(mode="json"))


def verdict(body: FoundBody, mood: Mood) -> Paragraph:
    """Return a sentence on mass and centre."""
    mass = body.of("mass")
    if mass is None:
        return Paragraph("The recordings do not determine the mass of the payload.", Mood.DOUBTFUL, strong=True)
    found = [each for name in CENTRE if (each := body.of(name))]
    centre = [f"{each.name} {plus_minus(1e3 * each.value, 2e3 * each.std)}" for each in found]
    where = f"; centre of mass at {', '.join(centre)} mm" if centre else ""
    return Paragraph(f"{plus_minus(mass.value, 2.0 * mass.std)} kg (2 sigma){where}.", mood, strong=True)


def _doubts(body: FoundBody, joints: Sequence[Weighed]) -> Iterator[str]:
    mass = body.of("mass")
    if mass is not None and mass.value < 0.0:
        yield (
            "Note: the mass is negative, but not significantly. Check that a payload was mounted and that "
            "bare and loaded are not swapped."
        )
    apart = [
        f"joint {(each.joint or 0) + 1} alone {each.mass.value:.3f} kg (2 sigma {2.0 * each.mass.std:.3f})"
        for each in joints
        if each.verdict == DIFFERS and each.mass is not None
    ]
    if apart and mass is not None:
        yield (
            f"WARNING: the joints disagree on the mass: {', '.join(apart)}; all together {mass.value:.3f} kg. "
            "A gain is wrong or the payload moved, and the intervals do not include this; check the gains "
            "with rx90 verify."
        )
