"""`rx90 torque` in words: how large torques are, what was written, which joints have no column or an odd gain."""

import numpy as np

from ident.estimation.joint_torque import JointTorque
from ident.support.naming import one_line
from scenarios.experiments.files.gains import TURNING, GainsFile
from scenarios.gains_in_use.results import Torques
from scenarios.reports.content import Cell, Column, Paragraph, Report, Table, cells, percent, plus_minus
from scenarios.reports.gains import sentence

COLUMNS = (
    Column(title="Joint"),
    Column(title="Name", words=True),
    Column(title="Rms"),
    Column(title="Peak"),
    Column(title="2 sigma"),
    Column(title="Unit", words=True),
    Column(title="2 sigma", unit="%"),
)
INCLUDED = (
    "Torque of the drive, current times gain. Friction and the amplifier's offset are in it: currents alone do not "
    "separate them from the torque of the links. 2 sigma: of the gain; of the torque, at the peak."
)


def torque_report(written: Torques, found: JointTorque, file: GainsFile) -> Report:
    """How large torques are, and what was written.

    Args:
        written: What was written.
        found: The torques.
        file: The gains that they are from.
    """
    title = f"{one_line(written.out)}: {written.samples} samples, joints {', '.join(map(str, written.joints))}"
    largest = float(np.abs(found.tau).max())
    places = max(3 - int(np.floor(np.log10(largest))), 0) if largest else 0  # four digits of the largest torque
    rows = tuple(_row(found, file, k, places) for k in range(len(found.joints)))
    parts = [_verdict(found, file), Table(columns=COLUMNS, rows=rows), Paragraph(INCLUDED)]
    parts += [Paragraph(f"joint {each['joint']} has no column: {each['reason']}") for each in written.missing]
    parts += [Paragraph(sentence(f"Note: {note}")) for note in written.notes]
    return Report(title, tuple(parts), written.model_dump(mode="json"))


def _verdict(found: JointTorque, file: GainsFile) -> Paragraph:
    """The largest torque, and force where joints slide."""
    largest = list[str]()
    for unit in dict.fromkeys(_unit(file, joint) for joint in found.joints.tolist()):
        own = [k for k, joint in enumerate(found.joints.tolist()) if _unit(file, joint) == unit]
        k = max(own, key=lambda k: float(np.abs(found.tau[:, k]).max()))
        size, reach = _peak(found, k)
        largest.append(f"{plus_minus(size, reach)} {unit} on joint {found.joints[k] + 1}")
    return Paragraph(f"Peak {' and '.join(largest)} (2 sigma).", strong=True)


def _row(found: JointTorque, file: GainsFile, k: int, places: int) -> tuple[Cell, ...]:
    joint, (size, reach) = int(found.joints[k]), _peak(found, k)
    rms = float(np.sqrt(np.mean(found.tau[:, k] ** 2)))
    return cells(
        str(joint + 1),
        file.gains[joint].name or "",
        *(f"{each:.{places}f}" for each in (rms, size, reach)),
        _unit(file, joint),
        percent(reach / size if size else None, ".2f"),
    )


def _peak(found: JointTorque, k: int) -> tuple[float, float]:
    """The largest torque, either way, and two standard deviations of it."""
    at = int(np.argmax(np.abs(found.tau[:, k])))
    return float(abs(found.tau[at, k])), 2.0 * float(found.std[at, k])


def _unit(file: GainsFile, joint: int) -> str:
    return "N m" if file.gains[joint].unit == TURNING else "N"
