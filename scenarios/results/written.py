"""What commands print of files: those that they wrote, and the built-in scenarios."""

from collections.abc import Mapping
from pathlib import Path

from pydantic import Field

from ident.recordings.files import Log
from ident.recordings.formats.resolution import signal_of
from scenarios.support.result_model import ResultModel


class Written(ResultModel):
    """What `rx90 recipe --json` and `rx90 view --render FILE --json` print."""

    out: str = Field(description="the file that was written")


class Converted(ResultModel):
    """What `rx90 convert --json` prints."""

    out: str = Field(description="The recording that was written")
    layout: str | None = Field(description="of recognised or named logs, null where the columns are declared")
    signal: str | None = Field(description="declared quantity of v")
    v: str | None = Field(description="quantity of v in the recording")
    samples: int = Field(description="Of the recording")
    joints: int = Field(description="How many it has")
    duration_s: float = Field(description="From the first sample to the last [s]")
    rate_hz: float = Field(description="One over the mean time between samples [Hz]")
    columns: dict[str, str | list[str]] = Field(description="of the log, used for t, q and v")
    notes: list[str] = Field(description="Assumptions and remarks")


def converted(log: Log, out: Path) -> Converted:
    """A log that was written as a recording."""
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


class ListedScenario(ResultModel):
    """A built-in scenario."""

    name: str = Field(description="Name that commands take")
    description: str = Field(description="What it shows, in a line")


class ListedScenarios(ResultModel):
    """What `rx90 list --json` prints."""

    scenarios: list[ListedScenario] = Field(description="Those that are built in")


def listed(described: Mapping[str, str]) -> ListedScenarios:
    """Scenarios by their names, with their descriptions."""
    return ListedScenarios(scenarios=[ListedScenario(name=name, description=said) for name, said in described.items()])
