"""`rx90 torque` in words: what was written, and which joints have no column or an odd gain."""

from ident.support.naming import one_line
from scenarios.gains_in_use.results import Torques
from scenarios.reports.content import Paragraph, Report
from scenarios.reports.gains import sentence


def torque_report(written: Torques) -> Report:
    """What was written."""
    title = f"{one_line(written.out)}: {written.samples} samples, joints {', '.join(map(str, written.joints))}"
    parts = [Paragraph(f"joint {each['joint']} has no column: {each['reason']}") for each in written.missing]
    parts += [Paragraph(sentence(f"Note: {note}")) for note in written.notes]
    return Report(title, tuple(parts), written.model_dump(mode="json"))
