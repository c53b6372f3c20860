"""What tables of identified gains share: the interval and its parts, what it means, notes and reasons."""

from collections.abc import Sequence

from ident.gains import JointGain
from scenarios.reports.content import Column, Paragraph, percent
from scenarios.store.documents import gain_parts

INTERVAL = (
    Column(title="2 sigma", unit="%"),
    Column(title="residual", unit="%"),
    Column(title="payload", unit="%"),
)
"""The interval of a gain beside its parts, in percent of the gain."""
MEANING = Paragraph(
    "Gains in N m per drive unit. 2 sigma: two standard deviations, from the residual and from the payload's stated "
    "uncertainty together. "
    "No error of the model is in it: of geometry, friction law, couplings."
)


def interval(joint: JointGain) -> tuple[str, str, str]:
    """The cells of `INTERVAL`."""
    parts = gain_parts(joint)
    if parts is None:
        return percent(None), percent(None), percent(None)
    size = abs(parts.value) / 2.0
    return (
        percent(parts.total_std / size, ".2f"),
        percent(parts.std / size, ".2f"),
        percent(parts.payload_std / size, ".2f"),
    )


def note_paragraphs(notes: Sequence[str]) -> list[Paragraph]:
    """What the interval means, and a line a note."""
    return [MEANING, *(Paragraph(f"Note: {note}.") for note in notes)]


def reason_paragraph(joint: int, reason: str) -> Paragraph:
    """Why a joint has no gain, or has missed."""
    return Paragraph(f"Joint {joint}: {reason}.")
