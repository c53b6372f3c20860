"""`rx90 torque` in words: what was written, and which joints have no column or an odd gain."""

from pathlib import Path

from ident.estimation.joint_torque import JointTorque
from ident.support.naming import one_line
from scenarios.experiments.files.gains import GainsFile
from scenarios.gains_in_use.results import torques
from scenarios.reports.content import Paragraph, Report
from scenarios.reports.gains import sentence


def torque_report(found: JointTorque, file: GainsFile, out: Path) -> Report:
    """What was written.

    Args:
        found: Torques.
        file: The gains that they were found with.
        out: The file.
    """
    result = torques(found, file, out)
    title = f"{one_line(out)}: {result.samples} samples, joints {', '.join(map(str, result.joints))}"
    parts = [Paragraph(f"joint {each['joint']} has no column: {each['reason']}") for each in result.missing]
    parts += [Paragraph(sentence(f"Note: {note}")) for note in result.notes]
    return Report(title, tuple(parts), result.model_dump(mode="json"))
