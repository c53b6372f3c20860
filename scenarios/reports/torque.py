"""`rx90 torque` in words: what was written, and which joints have no column or an odd gain."""

from pathlib import Path

from ident.estimation.joint_torque import JointTorque
from ident.support.naming import one_line
from scenarios.experiments.files.gains import GainsFile
from scenarios.reports.content import Paragraph, Report
from scenarios.reports.gains import sentence


def torque_report(found: JointTorque, file: GainsFile, out: Path) -> Report:
    """What was written.

    Args:
        found: Torques.
        file: The gains that they were found with.
        out: The file.
    """
    joints = [int(joint) + 1 for joint in found.joints]
    missing = [
        {"joint": entry.joint, "reason": one_line(entry.reason or "its gain is refused")}
        for entry in file.gains
        if not entry.identifiable
    ]
    title = f"{one_line(out)}: {len(found.t)} samples, joints {', '.join(map(str, joints))}"
    notes = list(file.notes)
    parts = [Paragraph(f"joint {each['joint']} has no column: {each['reason']}") for each in missing]
    parts += [Paragraph(sentence(f"Note: {note}")) for note in notes]
    document = {"out": str(out), "samples": len(found.t), "joints": joints, "missing": missing, "notes": notes}
    return Report(title, tuple(parts), document)
