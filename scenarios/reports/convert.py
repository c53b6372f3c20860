"""What `rx90 convert` says: which columns of a log were taken for what."""

from pathlib import Path

from ident.recordings.files import Log
from ident.recordings.formats.description import Channels
from ident.recordings.formats.notes import signal_of
from scenarios.reports.content import NONE, Column, Paragraph, Part, Report, Table, cells

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
    said, recording = log.read.description, log.recording
    rows = tuple(
        cells(str(joint + 1), *_channel(said.q, joint), _each(said.q.zero, joint, "0"), *_channel(said.v, joint))
        for joint in range(recording.n)
    )
    seconds, rate = float(recording.t[-1] - recording.t[0]), 1.0 / recording.period
    parts: list[Part] = [
        Table(columns=COLUMNS, rows=rows),
        Paragraph(f"Time is {said.t.columns[0]} [{said.t.unit[0]}]; v is {signal_of(log.read)}."),
        *(Paragraph(f"Note: {note}.") for note in log.notes),
        Paragraph(
            f"{out}: {len(recording.t)} samples of {recording.n} joints, {seconds:.4g} s at {rate:.4g} Hz.", strong=True
        ),
    ]
    document = {
        "out": str(out),
        "layout": log.read.layout,
        "signal": said.signal,
        "v": signal_of(log.read),
        "samples": len(recording.t),
        "joints": recording.n,
        "duration_s": seconds,
        "rate_hz": rate,
        "columns": {"t": said.t.columns[0], "q": list(said.q.columns), "v": list(said.v.columns)},
        "notes": list(log.notes),
    }
    return Report("Log to recording", tuple(parts), document)


def _channel(channels: Channels, joint: int) -> tuple[str, str, str]:
    return channels.columns[joint], _each(channels.unit, joint, NONE), _each(channels.sign, joint, "1")


def _each(values: tuple[object, ...], joint: int, none: str) -> str:
    """The entry of a joint, or that of all joints."""
    if not values:
        return none
    value = values[joint if len(values) > 1 else 0]
    return value if isinstance(value, str) else f"{value:g}"
