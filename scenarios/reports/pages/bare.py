"""The page of bare motions: the report, joint ranges, and provenance."""

from pathlib import Path

from ident.diagnosis.samples.motion import joint_motions
from scenarios.reports.bare import bare_report
from scenarios.reports.content import Heading, Part, Report
from scenarios.reports.motion import coverage_plot
from scenarios.reports.pages import provenance
from scenarios.results.models.bare import BareResult
from scenarios.results.models.check import CheckLog
from scenarios.results.record import identify_words, read_saved


def page(folder: Path) -> Report:
    """Return the page of a folder.

    Raises:
        ScenarioError: If it holds no bare motions, or some of another version; if a file is missing or changed.
    """
    record, result, given = read_saved(folder, BareResult)
    report = bare_report(result, given.arm.revolute)
    seen = {
        name: CheckLog.of(name, joint_motions(each.recording, given.arm, given.observing)).joints
        for name, each in zip(provenance.named(record.sources), given.motions, strict=True)
    }
    parts: list[Part] = [*report.parts, Heading("Joint ranges covered by the motion"), coverage_plot(seen, given.arm)]
    origin = provenance.origin(record, provenance.asked(folder, record), given.arm, identify_words(folder, record))
    return Report(record.title, (*parts, *origin), report.document)
