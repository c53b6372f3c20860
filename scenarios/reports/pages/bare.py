"""The page of bare motions: ratios, what a payload would add, parameters, friction, links, where each joint went."""

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from pydantic import JsonValue
from threadpoolctl import threadpool_limits

from ident.diagnosis.samples.motion import joint_motions
from ident.estimation.estimators.nls import AllJointsOptions
from ident.model.arm import Arm
from ident.model.structure import structure_of
from ident.payload.files import read_payload
from ident.recordings.motion import Motion
from ident.support.errors import IdentificationError
from ident.support.options import options_from_table
from scenarios.experiments.files.gains import read_gains
from scenarios.gains_in_use.bare import bare_answer
from scenarios.gains_in_use.model_update.link_document import Links
from scenarios.gains_in_use.model_update.values import Unknown
from scenarios.reports.bare import bare_report
from scenarios.reports.content import Heading, Mood, Paragraph, Part, Report
from scenarios.reports.motion import coverage_plot
from scenarios.reports.pages import provenance
from scenarios.reports.pages.reanalysis import SAME
from scenarios.results.record import RECORD, RESULT, RecordFile, identify_words, read_record, recorded_problem
from scenarios.support.errors import DamagedResult


def page(folder: Path) -> Report:
    """Everything that the folder tells.

    Raises:
        ForeignResult: If it holds no bare motions, or some of another version.
        DamagedResult: If a file is missing or changed, or the files say nothing any more.
    """
    record = read_record(folder)
    saved: dict[str, JsonValue] = json.loads((folder / RESULT).read_text(encoding="utf-8"))
    try:
        given = recorded_problem(folder, record)
        payload = None if record.payload is None else read_payload(folder / record.payload)
        motions = [
            Motion(replace(each.recording, name=name)) for each, name in zip(given.motions, record.sources, strict=True)
        ]
        with threadpool_limits(1):  # small matrices gain nothing from a threaded BLAS
            answer = bare_answer(
                motions,
                structure_of(given.arm),
                observing=given.observing,
                gains=given.gains,
                options=options_from_table(AllJointsOptions, record.options),
                known=None if record.believed is None else read_gains(folder / record.believed).known,
                payload=payload,
            )
    except IdentificationError as error:
        raise DamagedResult(f"{folder / RECORD}: the files of this folder give no estimate: {error}") from error
    report = bare_report(answer, _saved_links(saved), given.arm)
    seen = {
        name: joint_motions(each.recording, given.arm, given.observing)
        for name, each in zip(provenance.named(record.sources), motions, strict=True)
    }
    doubtful = any(isinstance(part, Paragraph) and part.mood is Mood.DOUBTFUL for part in report.parts)
    verdict = _verdict(saved, Mood.DOUBTFUL if doubtful else Mood.PLAIN)
    parts: list[Part] = [verdict, *_differences(saved, report.document), *report.parts]
    parts += [Heading("What the motion covers"), coverage_plot(seen, given.arm)]
    return Report(record.title, (*parts, *_origin(folder, record, given.arm)), saved)


def _saved_links(saved: dict[str, JsonValue]) -> Links | Unknown:
    """The links as they were found: the folder's model has none to be near to."""
    links = saved["consistent"]
    return Unknown(str(saved["consistent_reason"])) if links is None else Links.model_validate(links)


def _verdict(saved: dict[str, JsonValue], mood: Mood) -> Paragraph:
    joints = saved["joints"]
    assert isinstance(joints, list), "written with a list of joints"
    reference, found, refused = saved["reference"], list[str](), list[str]()
    for each in joints:
        assert isinstance(each, dict), "written as objects"
        if each["joint"] != reference:
            (refused if each["ratio"] is None else found).append(str(each["joint"]))
    text = f"Bare motions give the gains of {_joints(found)} as ratios to that of joint {reference}"
    without = f"; of {_joints(refused)} they give none" if refused else ""
    warned = "" if mood is Mood.PLAIN else " Warnings stand below."
    return Paragraph(f"{text}{without}.{warned}", mood, strong=True)


def _joints(numbers: list[str]) -> str:
    *most, last = numbers
    return f"joints {', '.join(most)} and {last}" if most else f"joint {last}"


def _differences(saved: dict[str, JsonValue], now: Mapping[str, object]) -> list[Part]:
    """That the files give other ratios now, if they do."""
    pairs = zip(_ratios(saved), _ratios(now), strict=False)
    if len(_ratios(saved)) == len(_ratios(now)) and all(_same(*pair) for pair in pairs):
        return []
    text = f"Re-identified, these files give other ratios than {RESULT}; the page shows the new ones."
    return [Paragraph(text, Mood.BAD, strong=True)]


def _ratios(document: Mapping[str, object]) -> list[object]:
    joints = document["joints"]
    assert isinstance(joints, list), "written with a list of joints"
    return [each["ratio"] for each in joints]


def _same(one: object, other: object) -> bool:
    """Whether two ratios, or none, are the same but for rounding on another machine."""
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=SAME)
    return one is None and other is None


def _origin(folder: Path, record: RecordFile, arm: Arm) -> list[Part]:
    asked = {} if record.payload is None else {record.payload: read_payload(folder / record.payload)}
    commands = {"As it was made": record.command, "The same from these files": identify_words(folder, record)}
    about = {
        "Made": record.created,
        "Recordings": ", ".join(record.sources),
        "Versions": provenance.versions_in_words(record.versions),
    }
    return [
        *provenance.assumed(record, asked, arm),
        *provenance.repeated(commands, about, record.files),
    ]
