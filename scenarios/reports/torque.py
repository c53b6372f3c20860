"""Report of `rx90 torque`: largest torques, written file, joints without a column, remarks on gains."""

import numpy as np

from ident.estimation.joint_torque import JointTorque
from ident.support.naming import one_line
from scenarios.experiments.gains_file import TURNING, GainsFile
from scenarios.gains_in_use.results import Torques
from scenarios.rendering.content import (
    Paragraph,
    Report,
    column,
    joints_named,
    percent,
    plus_minus,
    rounded,
    sentence,
    table,
)

INCLUDED = (
    "Torque of the drive, current times gain. It includes friction and the amplifier's offset, which currents "
    "alone do not separate from the torque of the links. 2 sigma: of the gain, and of the torque at its peak."
)

OF_ROBOT = "The gains are of robot {}. Logs do not name their robot: make sure that this log is of the same one."


def torque_report(written: Torques, found: JointTorque, file: GainsFile) -> Report:
    """Return the report: largest torques and written file."""
    title = f"{one_line(written.out)}: {written.samples} samples, {joints_named(written.joints)}"
    peaks, joints = [_peak(found, k) for k in range(len(found.joints))], found.joints.tolist()
    names = [str(file.gains[joint].name or "") for joint in joints]
    rms = np.sqrt(np.mean(found.tau**2, axis=0))
    precise = [reach or 0.01 * size for size, reach in peaks]  # four digits without a standard deviation
    rows = table(
        range(len(joints)),
        column("Joint", lambda k: joints[k] + 1),
        column("Name", lambda k: names[k], words=True),
        column("Rms", lambda k: rounded(float(rms[k]), precise[k])),
        column("Peak", lambda k: rounded(peaks[k][0], precise[k])),
        column("2 sigma", lambda k: rounded(peaks[k][1] or None, precise[k])),
        column("Unit", lambda k: _unit(file, joints[k]), words=True),
        column("2 sigma [%]", lambda k: percent(peaks[k][1] / peaks[k][0] if peaks[k][1] else None, ".2f")),
    )
    parts = [_verdict(found, file), rows, Paragraph(INCLUDED)]
    parts += [] if file.robot is None else [Paragraph(OF_ROBOT.format(one_line(file.robot)))]
    parts += [Paragraph(sentence(f"Joint {each['joint']} has no column: {each['reason']}")) for each in written.missing]
    parts += [Paragraph(sentence(f"Note: {note}")) for note in written.notes]
    return Report(title, tuple(parts), written.model_dump(mode="json"))


def _verdict(found: JointTorque, file: GainsFile) -> Paragraph:
    """Return the largest torque, or force of prismatic joints."""
    largest = list[str]()
    for unit in dict.fromkeys(_unit(file, joint) for joint in found.joints.tolist()):
        own = [k for k, joint in enumerate(found.joints.tolist()) if _unit(file, joint) == unit]
        k = max(own, key=lambda k: float(np.abs(found.tau[:, k]).max()))
        size, reach = _peak(found, k)
        largest.append(f"{plus_minus(size, reach)} {unit} on joint {found.joints[k] + 1}")
    return Paragraph(f"Peak {' and '.join(largest)}{' (2 sigma)' * bool(found.std.any())}.", strong=True)


def _peak(found: JointTorque, k: int) -> tuple[float, float]:
    """Return the largest magnitude of torque and two standard deviations of it."""
    at = int(np.argmax(np.abs(found.tau[:, k])))
    return float(abs(found.tau[at, k])), 2.0 * float(found.std[at, k])


def _unit(file: GainsFile, joint: int) -> str:
    return "N m" if file.gains[joint].unit == TURNING else "N"
