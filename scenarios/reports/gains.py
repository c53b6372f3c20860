"""What tables of identified gains share: the interval and its parts, what it means, notes and reasons."""

from collections.abc import Sequence

import numpy as np

from ident.diagnosis.diagnosis import Diagnosed
from ident.model.parameters import UNITS
from ident.support.arrays import Array
from ident.support.naming import joint_list
from scenarios.reports.content import NONE, Column, Paragraph, Table, cells, percent
from scenarios.reports.diagnoses import doubt_paragraphs
from scenarios.results.models.gains import ResultGain, ResultParameter

INTERVAL = (
    Column(title="2 sigma", unit="%"),
    Column(title="residual", unit="%", file_only=True),
    Column(title="payload", unit="%", file_only=True),
    Column(title="model", unit="%", file_only=True),
)
"""The interval of a gain beside its parts, which a screen leaves out, in percent of the gain."""
MEANING = (
    "2 sigma: two standard deviations of the gain, from the residual, the payload's stated uncertainty and the model "
    "together. Errors of the model's geometry, friction law and elasticity are not included where its part is zero."
)


def gain_unit(revolute: Array) -> str:
    """The unit of a column of gains."""
    return "N m/unit" if revolute.all() else "N/unit" if not revolute.any() else "N (m)/unit"


def meaning(revolute: Array) -> Paragraph:
    """What units and interval of a table of gains mean.

    Args:
        revolute: Whether each joint turns, shape (n,).
    """
    sliding = np.flatnonzero(revolute == 0) + 1
    if sliding.size == len(revolute):
        return Paragraph(f"Gains in N per drive unit. {MEANING}")
    apart = f", of sliding joint {', '.join(map(str, sliding))} in N per drive unit" if sliding.size else ""
    return Paragraph(f"Gains in N m per drive unit{apart}. {MEANING}")


def interval(gain: ResultGain) -> tuple[str, ...]:
    """The cells of `INTERVAL`."""
    shares = (gain.std, gain.residual_std, gain.payload_std, gain.model_std)
    if gain.estimate is None:
        return (NONE,) * len(INTERVAL)
    return tuple(percent(None if std is None else 2.0 * std / abs(gain.estimate), ".2f") for std in shares)


def joints_named(joints: Sequence[int]) -> str:
    """`joint 2`, `joints 1 and 4` or `joints 1 to 5`, of joints from 1."""
    if len(joints) > 2 and list(joints) == list(range(joints[0], joints[-1] + 1)):
        return f"joints {joints[0]} to {joints[-1]}"
    return joint_list([joint - 1 for joint in joints])


def sentence(text: str) -> str:
    """A text with the full stop that a question does not need."""
    return text if text.endswith("?") else f"{text}."


def note_paragraphs(notes: Sequence[str], found: Diagnosed, revolute: Array) -> list[Paragraph]:
    """What units and interval mean, what is said of the logs, a line for each note."""
    return [meaning(revolute), *doubt_paragraphs(found), *(Paragraph(sentence(f"Note: {note}")) for note in notes)]


def reason_paragraph(joint: int, reason: str) -> Paragraph:
    """Why a joint has no gain, or has missed."""
    return Paragraph(sentence(f"Joint {joint}: {reason}"))


def payload_tables(found: Sequence[ResultParameter]) -> list[Table]:
    """The payload parameters that a method found on its way, in a table if there are any."""
    rows = tuple(cells(p.parameter, f"{p.estimate:.4f}", f"{2.0 * p.std:.4f}", UNITS[p.parameter]) for p in found)
    columns = (
        Column(title="Payload", words=True),
        Column(title="Found"),
        Column(title="2 sigma"),
        Column(title="Unit", words=True),
    )
    return [Table(columns=columns, rows=rows)] if rows else []
