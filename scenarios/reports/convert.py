"""Report of `rx90 convert`: the columns of a log that were used."""

from pathlib import Path

from ident.recordings.description import Channels
from ident.recordings.files import Log
from scenarios.rendering.content import NONE, ColumnOf, Paragraph, Part, Report, column, table
from scenarios.results.written import converted


def log_report(log: Log, out: Path) -> Report:
    """Return the report: the columns that were used, and the written file."""
    said = log.read.description
    result = converted(log, out)
    parts: list[Part] = [
        Paragraph(
            f"{out}: {result.samples} samples of {result.joints} joints, {result.duration_s:.4g} s at "
            f"{result.rate_hz:.4g} Hz.",
            strong=True,
        ),
        table(
            range(log.recording.n),
            column("Joint", lambda joint: joint + 1),
            *_channel("Position", said.q),
            column("Zero", lambda joint: _each(said.q.zero, joint, "0")),
            *_channel("Current", said.v),
        ),
        Paragraph(f"Time is {said.t.columns[0]} [{said.t.unit[0]}]; v is {result.v}."),
        *(Paragraph(f"Note: {note}.") for note in result.notes),
    ]
    return Report("Log converted to a recording", tuple(parts), result.model_dump(mode="json"))


def _channel(title: str, of: Channels) -> tuple[ColumnOf[int], ...]:
    return (
        column(title, lambda joint: of.columns[joint], words=True),
        column("Unit", lambda joint: _each(of.unit, joint, NONE), words=True),
        column("Sign", lambda joint: _each(of.sign, joint, "1")),
    )


def _each(values: tuple[object, ...], joint: int, none: str) -> str:
    """Return the entry of a joint, or the common entry of all joints."""
    if not values:
        return none
    value = values[joint if len(values) > 1 else 0]
    return value if isinstance(value, str) else f"{value:g}"
