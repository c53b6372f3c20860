"""The page of a check: its verdict, what is not good, all checks, each log's motion and currents."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from ident.check import Checked, LogRead, check
from ident.diagnosis.diagnosis import Diagnosis, Severity, worst_first
from ident.diagnosis.samples.temperature import NAME
from ident.model.arm import Arm
from ident.model.structure import structure_of
from ident.payload.files import read_payload
from ident.payload.payload import Payload
from ident.support.errors import IdentificationError
from scenarios.reports.check import findings, verdict
from scenarios.reports.content import Heading, Mood, Paragraph, Part, Report
from scenarios.reports.diagnoses import MOODS, every_line
from scenarios.reports.motion import coverage_plot
from scenarios.reports.pages import provenance
from scenarios.reports.plot import Axis, Mark, Plot, Series, Tone, values
from scenarios.results.check_document import check_document
from scenarios.results.record import RECORD, RESULT, RecordFile, check_words, read_record, recorded_problem
from scenarios.support.errors import DamagedResult

PIXELS = 400
"""Intervals of time of which the lowest and the highest value are drawn."""


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
            checked = check(
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
    diagnoses = worst_first((*checked.found.diagnoses, *_of_temperature(saved)))
    checked = replace(checked, found=replace(checked.found, diagnoses=diagnoses))
    found, now = checked.found, check_document(checked, given.arm)
    asked = {} if record.payload is None or payload is None else {record.payload: payload}
    parts: list[Part] = [Paragraph(verdict(found, given.arm), MOODS[found.severity], strong=True)]
    parts += [*_differences(saved, now), *findings(found), Heading("All checks"), every_line(found.diagnoses)]
    parts += [*_plots(checked, given.arm), *_origin(folder, record, asked, given.arm)]
    return Report(record.title, tuple(parts), saved)


def _differences(saved: object, now: Mapping[str, object]) -> list[Part]:
    """That the check says something else now, if it does."""
    said = json.loads(json.dumps(now))
    if isinstance(saved, dict) and all(saved.get(key) == said[key] for key in ("verdict", "lines")):
        return []
    text = f"A new check of these files differs from {RESULT}; the page shows the new one."
    return [Paragraph(text, Mood.BAD, strong=True)]


def _of_temperature(saved: Mapping[str, list[dict[str, Any]]]) -> list[Diagnosis]:
    """Temperatures as they were judged: the folder's recordings have none."""
    return [
        Diagnosis(
            name=NAME,
            severity=Severity(each["verdict"]),
            sentence=each["seen"],
            advice=each["advice"],
            joints=(each["joint"] - 1,),
            logs=(each["log"],),
        )
        for each in saved["lines"]
        if each["what"] == NAME
    ]


def _plots(checked: Checked, arm: Arm) -> list[Part]:
    """Where joints went, and every log as it was recorded."""
    names = dict(
        zip(
            [log.recording.name for log in checked.logs],
            provenance.named([log.recording.name for log in checked.logs]),
            strict=True,
        )
    )
    recorded = {names[log.recording.name]: log.motions for log in checked.logs if log.motions is not None}
    parts: list[Part] = [Heading("What the motion covers"), coverage_plot(recorded, arm)] if recorded else []
    for log in checked.logs:
        parts += [Heading(f"Currents of {names[log.recording.name]}, as recorded")]
        parts += [current_plot(log, joint) for joint in range(arm.n)]
    return parts


def current_plot(log: LogRead, joint: int) -> Plot:
    """The current of a joint as it was recorded, the lowest and highest value of every interval of time.

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
