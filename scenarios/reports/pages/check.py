"""The page of a check: its verdict, the lines, what to do, each log's motion and currents."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from ident.arm import Arm
from ident.checks.check import Checked, LogRead, check
from ident.checks.remark import Grade, Remark
from ident.checks.warming import TOPIC
from ident.errors import IdentificationError
from ident.payload import Payload
from ident.payload_files import read_payload
from ident.structure import structure_of
from scenarios.errors import DamagedResult
from scenarios.reports.check import check_report
from scenarios.reports.content import Cell, Heading, Mood, Paragraph, Part, Report, Table
from scenarios.reports.motion import coverage_plot
from scenarios.reports.pages import provenance
from scenarios.reports.plot import Axis, Mark, Plot, Series, Tone, values
from scenarios.store.record import RECORD, RESULT, RecordFile, check_words, read_record, recorded_problem

PIXELS = 400
"""Stretches of time of which the lowest and the highest value are drawn."""


def page(folder: Path) -> Report:
    """Everything that the folder tells.

    Raises:
        ForeignResult: If it holds no check, or one of another version.
        DamagedResult: If a file is missing or changed.
    """
    record = read_record(folder)
    try:
        given = recorded_problem(folder, record)
        payload = None if record.payload is None else read_payload(folder / record.payload)
        recordings = [
            replace(each.recording, name=name) for each, name in zip(given.motions, record.sources, strict=True)
        ]
        with threadpool_limits(1):  # small matrices gain nothing from a threaded BLAS
            found = check(
                recordings,
                structure_of(given.arm),
                observing=given.observing,
                gains=given.gains,
                loaded=[each.payload is not None for each in given.motions],
                payload=payload,
                about=None if record.about is None else np.array(record.about),
            )
    except IdentificationError as error:
        raise DamagedResult(f"{folder / RECORD}: the files of this folder cannot be checked: {error}") from error
    saved = json.loads((folder / RESULT).read_text(encoding="utf-8"))
    found = replace(found, remarks=(*found.remarks, *_of_temperature(saved)))
    told = check_report(found, given.arm)
    asked = {} if record.payload is None or payload is None else {record.payload: payload}
    said = [worst_first(part) if isinstance(part, Table) else part for part in told.parts[:-1]]
    said.sort(key=lambda part: not isinstance(part, Paragraph))  # what to do, then the lines
    parts = [told.parts[-1], *_differences(saved, told.document), *said, *_plots(found, given.arm)]
    return Report(record.title, (*parts, *_origin(folder, record, asked, given.arm)), saved)


def worst_first(table: Table) -> Table:
    """The table with its bad rows before its doubtful and all others, else in their order."""
    order = (Mood.BAD, Mood.DOUBTFUL)

    def rank(row: tuple[Cell, ...]) -> int:
        return min((order.index(cell.mood) for cell in row if cell.mood in order), default=len(order))

    return replace(table, rows=tuple(sorted(table.rows, key=rank)))


def _differences(saved: object, now: Mapping[str, object]) -> list[Part]:
    """That the check says something else now, if it does."""
    said = json.loads(json.dumps(now))
    if isinstance(saved, dict) and all(saved.get(key) == said[key] for key in ("verdict", "lines")):
        return []
    text = f"Checked again, these files give other lines than {RESULT}; the page shows those of now."
    return [Paragraph(text, Mood.BAD, strong=True)]


def _of_temperature(saved: Mapping[str, list[dict[str, Any]]]) -> list[Remark]:
    """Lines on temperatures as they were told: the folder's recordings have none."""
    return [
        Remark(
            topic=TOPIC,
            log=each["log"],
            joint=each["joint"] - 1,
            seen=each["seen"],
            grade=Grade(each["verdict"]),
            advice=each["advice"],
        )
        for each in saved["lines"]
        if each["what"] == TOPIC
    ]


def _plots(found: Checked, arm: Arm) -> list[Part]:
    """Where joints went, and every log as it was recorded."""
    names = dict(
        zip(
            [log.recording.name for log in found.logs],
            provenance.named([log.recording.name for log in found.logs]),
            strict=True,
        )
    )
    recorded = {names[log.recording.name]: log.motions for log in found.logs if log.motions is not None}
    parts: list[Part] = [Heading("What the motion covers"), coverage_plot(recorded, arm)] if recorded else []
    for log in found.logs:
        parts += [Heading(f"Currents of {names[log.recording.name]}, as recorded")]
        parts += [current_plot(log, joint) for joint in range(arm.n)]
    return parts


def current_plot(log: LogRead, joint: int) -> Plot:
    """The current of a joint as it was recorded, the lowest and highest value of every stretch of time.

    Args:
        log: The log.
        joint: The joint, from 0.
    """
    t, v = log.recording.t, log.recording.v[:, joint]
    size = max(1, -(-len(t) // PIXELS))
    starts = np.arange(0, len(t), size)
    low, high = np.minimum.reduceat(v, starts), np.maximum.reduceat(v, starts)
    middle = np.repeat(t[starts], 2) if size > 1 else t
    drawn = np.column_stack((low, high)).ravel() if size > 1 else v
    how = f"Of every {size} samples the lowest and the highest." if size > 1 else "Every sample."
    return Plot(
        title=f"Joint {joint + 1}",
        caption=how,
        x=Axis(title="time", unit="s"),
        y=Axis(title="current", unit="drive units"),
        series=(Series(label="", mark=Mark.LINE, tone=Tone.FIRST, x=values(middle), y=values(drawn)),),
        zoom=True,
        height=110,
    )


def _origin(folder: Path, record: RecordFile, asked: Mapping[str, Payload], arm: Arm) -> list[Part]:
    commands = {"As it was made": record.command, "The same from these files": check_words(folder, record)}
    about = {
        "Made": record.created,
        "Recordings": ", ".join(record.sources),
        "Versions": provenance.versions_in_words(record.versions),
    }
    return [
        *provenance.assumed(record, asked, arm),
        *provenance.repeated(commands, about, record.files),
    ]
