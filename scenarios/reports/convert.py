"""What `rx90 convert` says: which columns of a log were taken for what."""

from pathlib import Path

from ident.recordings.files import Log
from ident.recordings.formats.description import Channels
from scenarios.reports.content import NONE, Column, Paragraph, Part, Report, Table, cells
from scenarios.results.written import converted

COLUMNS = (
    Column(title="Joint"),
    Column(title="Position", words=True),
    Column(title="Unit", words=True),
    Column(title="Sign"),
    Column(title="Zero"),
    Column(title="Current", words=True),
    Column(title="Unit", words=True),
    Column(title="Sign"),
)


def log_report(log: Log, out: Path) -> Report:
    """Which columns were taken for what, and what was written.

    Args:
        log: The log that was read.
        out: The file that was written.
    """
    said = log.read.description
    rows = tuple(
        cells(str(joint + 1), *_channel(said.q, joint), _each(said.q.zero, joint, "0"), *_channel(said.v, joint))
        for joint in range(log.recording.n)
    )
    result = converted(log, out)
    parts: list[Part] = [
        Paragraph(
            f"{out}: {result.samples} samples of {result.joints} joints, {result.duration_s:.4g} s at "
            f"{result.rate_hz:.4g} Hz.",
            strong=True,
        ),
        Table(columns=COLUMNS, rows=rows),
        Paragraph(f"Time is {said.t.columns[0]} [{said.t.unit[0]}]; v is {result.v}."),
        *(Paragraph(f"Note: {note}.") for note in result.notes),
    ]
    return Report("Log converted to a recording", tuple(parts), result.model_dump(mode="json"))


def _channel(channels: Channels, joint: int) -> tuple[str, str, str]:
    return channels.columns[joint], _each(channels.unit, joint, NONE), _each(channels.sign, joint, "1")


def _each(values: tuple[object, ...], joint: int, none: str) -> str:
    """The entry of a joint, or that of all joints."""
    if not values:
        return none
    value = values[joint if len(values) > 1 else 0]
    return value if isinstance(value, str) else f"{value:g}"
