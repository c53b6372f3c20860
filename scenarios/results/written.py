"""What commands print of a file that they wrote."""

from pathlib import Path

from pydantic import Field

from ident.recordings.files import Log
from ident.recordings.formats.resolution import signal_of
from scenarios.support.result_model import ResultModel


class Written(ResultModel):
    """What `rx90 recipe --json` and `rx90 view --render FILE --json` print."""

    out: str = Field(description="the file that was written")


class Converted(ResultModel):
    """What `rx90 convert --json` prints.

    Attributes:
        out: The recording that was written.
        samples: Of the recording.
        joints: How many it has.
        duration_s: From the first sample to the last [s].
        rate_hz: One over the mean time between samples [Hz].
        notes: What was taken for granted, and what one should know.
    """

    out: str
    layout: str | None = Field(description="of recognised or named logs, null where the columns are declared")
    signal: str | None = Field(description="declared quantity of v")
    v: str | None = Field(description="quantity of v in the recording")
    samples: int
    joints: int
    duration_s: float
    rate_hz: float
    columns: dict[str, str | list[str]] = Field(description="of the log, used for t, q and v")
    notes: list[str]


def converted(log: Log, out: Path) -> Converted:
    """A log that was written as a recording.

    Args:
        log: The log that was read.
        out: The file that was written.
    """
    said, recording = log.read.description, log.recording
    return Converted(
        out=str(out),
        layout=log.read.layout,
        signal=said.signal,
        v=signal_of(log.read),
        samples=len(recording.t),
        joints=recording.n,
        duration_s=float(recording.t[-1] - recording.t[0]),
        rate_hz=1.0 / recording.period,
        columns={"t": said.t.columns[0], "q": list(said.q.columns), "v": list(said.v.columns)},
        notes=list(log.notes),
    )
