"""Results on files: written files, and built-in scenarios."""

from collections.abc import Mapping
from pathlib import Path

from pydantic import Field

from ident.recordings.files import Log
from scenarios.rendering.result import ResultModel


class Written(ResultModel):
    """What `rx90 view --render FILE --json` prints."""

    out: str = Field(description="The file that was written")


class Converted(ResultModel):
    """What `rx90 convert --json` prints."""

    out: str = Field(description="The recording that was written")
    layout: str | None = Field(description="Layout of the log, recognised or named; null if the columns are declared")
    signal: str | None = Field(description="Declared quantity of v")
    v: str | None = Field(description="Quantity of v in the recording")
    samples: int = Field(description="Number of samples of the recording")
    joints: int = Field(description="Number of joints")
    duration_s: float = Field(description="Time from the first to the last sample [s]")
    rate_hz: float = Field(description="Mean sampling rate [Hz]")
    columns: dict[str, str | list[str]] = Field(description="Columns of the log that are used for t, q and v")
    notes: list[str] = Field(description="Assumptions and remarks")


def converted(log: Log, out: Path) -> Converted:
    """Return the result of a converted log."""
    said, recording = log.read.description, log.recording
    return Converted(
        out=str(out),
        layout=log.read.layout,
        signal=said.signal,
        v=log.read.v,
        samples=len(recording.t),
        joints=recording.n,
        duration_s=float(recording.t[-1] - recording.t[0]),
        rate_hz=1.0 / recording.period,
        columns={"t": said.t.columns[0], "q": list(said.q.columns), "v": list(said.v.columns)},
        notes=list(log.read.notes),
    )


class ListedScenario(ResultModel):
    """A built-in scenario."""

    name: str = Field(description="Name of the scenario")
    description: str = Field(description="Description in one line")


class ListedScenarios(ResultModel):
    """What `rx90 list --json` prints."""

    scenarios: list[ListedScenario] = Field(description="Built-in scenarios")


def listed(described: Mapping[str, str]) -> ListedScenarios:
    """Return scenarios by name, with descriptions."""
    return ListedScenarios(scenarios=[ListedScenario(name=name, description=said) for name, said in described.items()])
