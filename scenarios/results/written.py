"""Results on files: a converted log, the built-in scenarios."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path

from pydantic import Field

from ident.recordings.description import EPISODE, UNKNOWN, Channels, LogDescription
from ident.recordings.files import Log
from scenarios.rendering.content import Paragraph, Part, column, table
from scenarios.rendering.result import ResultModel
from scenarios.support.texts import toml_value


def description_text(said: LogDescription) -> str:
    """Return what is declared of a log as a log description, TOML, for all logs like it: without an episode."""
    only = {json.dumps(name): value for name, value in said.only if name != EPISODE}
    tables = {part: dict(getattr(said, part).stated) for part in "tqv"} | {"file": asdict(said.text)}
    tables[""] = {key: getattr(said, key) for key in ("signal", "layout", "joints", "topic")} | {"only": only or None}
    tables["t"] = {"column": tables["t"].pop("columns", None), **tables["t"], "rate_hz": said.rate_hz}
    if said.v.constant == ():
        tables["v"]["constant"] = UNKNOWN
    if said.text.header == 0:
        tables["file"]["header"] = "none"
    lines = list[str]()
    for part in ("", "t", "q", "v", "file"):
        own = [f"{key} = {toml_value(_plain(each))}" for key, each in tables[part].items() if each is not None]
        lines += ["", f"[{part}]"] * bool(part and own) + own
    return "\n".join(lines).lstrip() + "\n"


def _plain(value: object) -> object:
    """Whole numbers without a decimal point, as numbers of bits and joints need it; one entry for a single one."""
    if isinstance(value, tuple):
        each = list(map(_plain, value))
        return each[0] if len(each) == 1 and not isinstance(each[0], list) else each
    return int(value) if isinstance(value, float) and value.is_integer() else value


class ConvertedChannel(ResultModel):
    """A column of a log, and how it becomes a joint's position or current."""

    column: str = Field(description="Name of the column")
    unit: str = Field(description="Name of the column's unit")
    sign: float = Field(description="Ratio of the direction of the joint to that of the column, 1 or -1")
    zero: float = Field(0.0, description="Position at a reading of 0, added after the sign, in `unit`")
    factor: float = Field(1.0, description="Factor of the result, such as 1 over the ratio of a gear")


class Converted(ResultModel):
    """What `rx90 convert --json` prints."""

    out: str = Field(description="The recording that was written")
    description: str | None = Field(description="The log description that was written; null if none was wanted")
    layout: str | None = Field(description="Layout of the log, recognised or named; null if the columns are declared")
    signal: str | None = Field(description="Declared quantity of v")
    v: str | None = Field(description="Quantity of v in the recording")
    samples: int = Field(description="Number of samples of the recording")
    joints: int = Field(description="Number of joints")
    duration_s: float = Field(description="Time from the first to the last sample [s]")
    rate_hz: float = Field(description="Mean sampling rate [Hz]")
    columns: dict[str, str | list[str]] = Field(description="Columns of the log that are used for t, q and v")
    time_unit: str = Field(description="Name of the unit of the column of time")
    positions: list[ConvertedChannel] = Field(description="Column of each joint's position, in order")
    currents: list[ConvertedChannel] = Field(description="Column of each joint's current, in order")
    notes: list[str] = Field(description="Assumptions and remarks")

    @classmethod
    def of(cls, log: Log, out: Path, description: Path | None) -> "Converted":
        """Return the result of a converted log."""
        said, recording = log.description, log.recording
        return cls(
            out=str(out),
            description=None if description is None else str(description),
            layout=log.layout,
            signal=said.signal,
            v=log.v,
            samples=len(recording.t),
            joints=recording.n,
            duration_s=float(recording.t[-1] - recording.t[0]),
            rate_hz=1.0 / recording.period,
            columns={"t": said.t.columns[0], "q": list(said.q.columns), "v": list(said.v.columns)},
            time_unit=said.t.unit[0],
            positions=_channels(said.q),
            currents=_channels(said.v),
            notes=list(log.notes),
        )

    def parts(self) -> Iterable[Part]:
        """The written file, the columns that were used, assumptions."""
        yield Paragraph(
            f"{self.out}: {self.samples} samples of {self.joints} joints, {self.duration_s:.4g} s at "
            f"{self.rate_hz:.4g} Hz.",
            strong=True,
        )
        yield table(
            enumerate(zip(self.positions, self.currents, strict=True), 1),
            column("Joint", lambda row: row[0]),
            column("Position", lambda row: row[1][0].column, words=True),
            column("Unit", lambda row: row[1][0].unit or None, words=True),
            column("Factor", lambda row: f"{row[1][0].sign * row[1][0].factor:g}"),
            column("Zero", lambda row: f"{row[1][0].zero:g}"),
            column("Current", lambda row: row[1][1].column, words=True),
            column("Unit", lambda row: row[1][1].unit or None, words=True),
            column("Factor", lambda row: f"{row[1][1].sign * row[1][1].factor:g}"),
        )
        yield Paragraph(f"Time is {self.columns['t']} [{self.time_unit}]; v is {self.v}.")
        if self.description is not None:
            yield Paragraph(f"Other logs like it: --log-description {self.description}.")
        yield from (Paragraph(f"Note: {note}.") for note in self.notes)


def _channels(of: Channels) -> list[ConvertedChannel]:
    return [
        ConvertedChannel(column=own.column, unit=own.unit, sign=own.sign, zero=own.zero, factor=own.factor)
        for own in of.each
    ]


class ListedScenario(ResultModel):
    """A built-in scenario."""

    name: str = Field(description="Name of the scenario")
    description: str = Field(description="Description in one line")


class ListedScenarios(ResultModel):
    """What `rx90 list --json` prints."""

    scenarios: list[ListedScenario] = Field(description="Built-in scenarios")

    @classmethod
    def of(cls, described: Mapping[str, str]) -> "ListedScenarios":
        """Return scenarios by name, with descriptions."""
        return cls(scenarios=[ListedScenario(name=name, description=said) for name, said in described.items()])

    def parts(self) -> Iterable[Part]:
        """A table of names and descriptions."""
        yield table(
            self.scenarios,
            column("Scenario", lambda each: each.name, words=True),
            column("Description", lambda each: each.description, words=True),
        )
