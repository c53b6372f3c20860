"""Result of `rx90 torque`: largest torques, written file, joints without a column, remarks on gains."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from pydantic import Field

from ident.estimation.joint_torque import JointTorque
from ident.support.naming import one_line
from scenarios.experiments.gains_file import TURNING, GainsFile
from scenarios.rendering.content import Paragraph, Part, column, plus_minus, rounded, sentence, table, two_sigma
from scenarios.rendering.result import ResultModel


class TorqueJoint(ResultModel):
    """Torque of a joint, or force if it slides."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    name: str = Field(description="Name of the joint, empty if the gains have none")
    unit: str = Field(description="Unit of the values")
    rms: float = Field(description="Root mean square, in `unit`")
    peak: float = Field(description="Largest magnitude, in `unit`")
    peak_std: float = Field(description="Standard deviation of the peak from that of the gain, in `unit`")


class Torques(ResultModel):
    """What `rx90 torque --json` prints.

    Attributes:
        out: The written file.
        samples: Number of samples, and of rows of the file.
    """

    out: str
    samples: int
    joints: list[int] = Field(description="Joints that have columns")
    missing: list[dict[str, int | str]] = Field(description="Joints without columns, with the reason")
    notes: list[str] = Field(description="Remarks on implausible gains")
    robot: str | None = Field(None, description="Robot of the gains, null if unknown")
    torques: list[TorqueJoint] = Field(default_factory=list[TorqueJoint], description="Torques of these joints")

    @classmethod
    def of(cls, found: JointTorque, file: GainsFile, out: Path) -> "Torques":
        """Return the result of written torques."""
        peaks = np.argmax(np.abs(found.tau), axis=0)
        return cls(
            out=str(out),
            samples=len(found.t),
            joints=[joint + 1 for joint in found.joints.tolist()],
            missing=[
                {"joint": entry.joint, "reason": one_line(entry.reason or "its gain is refused")}
                for entry in file.gains
                if not entry.identifiable
            ],
            notes=list(file.notes),
            robot=file.robot,
            torques=[
                TorqueJoint(
                    joint=joint + 1,
                    name=str(file.gains[joint].name or ""),
                    unit="N m" if file.gains[joint].unit == TURNING else "N",
                    rms=float(np.sqrt(np.mean(found.tau[:, k] ** 2))),
                    peak=float(abs(found.tau[at, k])),
                    peak_std=float(found.std[at, k]),
                )
                for k, (joint, at) in enumerate(zip(found.joints.tolist(), peaks.tolist(), strict=True))
            ],
        )

    def parts(self) -> Iterable[Part]:
        """Largest torques, and what they include."""
        largest = list[str]()
        for unit in dict.fromkeys(each.unit for each in self.torques):
            most = max((each for each in self.torques if each.unit == unit), key=lambda each: each.peak)
            largest.append(f"{plus_minus(most.peak, 2.0 * most.peak_std)} {unit} on joint {most.joint}")
        sure = not any(each.peak_std for each in self.torques)
        yield Paragraph(f"Peak {' and '.join(largest)}{'' if sure else ' (2 sigma)'}.", strong=True)
        yield table(
            self.torques,
            column("Joint", lambda each: each.joint),
            column("Name", lambda each: each.name, words=True),
            column("Rms", lambda each: rounded(each.rms, _precision(each))),
            column("Peak", lambda each: rounded(each.peak, _precision(each))),
            column("2 sigma", lambda each: rounded(2.0 * each.peak_std or None, _precision(each))),
            column("Unit", lambda each: each.unit, words=True),
            column("2 sigma [%]", lambda each: two_sigma(each.peak_std / each.peak if each.peak_std else None)),
        )
        yield Paragraph(
            "Torque of the drive, current times gain. It includes friction and the amplifier's offset, which currents "
            "alone do not separate from the torque of the links. 2 sigma: of the gain, and of the torque at its peak."
        )
        if self.robot is not None:
            yield Paragraph(
                f"The gains are of robot {one_line(self.robot)}. Logs do not name their robot: make sure that this log "
                "is of the same one."
            )
        for each in self.missing:
            yield Paragraph(sentence(f"Joint {each['joint']} has no column: {each['reason']}"))
        for note in self.notes:
            yield Paragraph(sentence(f"Note: {note}"))


def _precision(each: TorqueJoint) -> float:
    """Return the uncertainty that determines the digits: four of them without a standard deviation."""
    return 2.0 * each.peak_std or 0.01 * each.peak
