"""The page of bare motions: all that is told of them, where each joint went, and their origin."""

from pathlib import Path

from ident.diagnosis.samples.motion import joint_motions
from ident.model.arm import Arm
from ident.payload.files import read_payload
from ident.support.errors import IdentificationError
from scenarios.reports.bare import bare_report
from scenarios.reports.content import Heading, Part, Report
from scenarios.reports.motion import coverage_plot
from scenarios.reports.pages import provenance
from scenarios.results.models.bare import BareResult
from scenarios.results.models.check import CheckLog
from scenarios.results.record import RECORD, RecordFile, identify_words, read_record, read_result, recorded_problem
from scenarios.support.errors import ScenarioError


def page(folder: Path) -> Report:
    """Everything that the folder tells.

    Raises:
        ScenarioError: If it holds no bare motions, or some of another version; if a file is missing or changed.
    """
    record = read_record(folder)
    result = read_result(folder, BareResult)
    try:
        given = recorded_problem(folder, record)
    except IdentificationError as error:
        raise ScenarioError(f"{folder / RECORD}: the files of this folder cannot be read: {error}") from error
    report = bare_report(result, given.arm.revolute)
    seen = {
        name: CheckLog.of(name, joint_motions(each.recording, given.arm, given.observing)).joints
        for name, each in zip(provenance.named(record.sources), given.motions, strict=True)
    }
    parts: list[Part] = [*report.parts, Heading("Joint ranges covered by the motion"), coverage_plot(seen, given.arm)]
    return Report(record.title, (*parts, *_origin(folder, record, given.arm)), report.document)


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
