"""What `rx90 check` says: a line a finding, with its verdict; how each joint moved."""

from pathlib import PurePath

import numpy as np

from ident.arm import Arm
from ident.checks.check import Checked, LogRead
from ident.checks.motion import JointMotion
from ident.checks.remark import Grade, Remark
from scenarios.reports.content import NONE, Cell, Column, Mood, Paragraph, Part, Report, Table, cells, number, percent
from scenarios.store.check_document import check_document

MOODS = {Grade.GOOD: Mood.GOOD, Grade.WEAK: Mood.DOUBTFUL, Grade.WRONG: Mood.BAD}
COLUMNS = (
    Column(title="Log", words=True),
    Column(title="What", words=True),
    Column(title="Verdict", words=True),
    Column(title="Seen", words=True),
)
MOTION_COLUMNS = (
    Column(title="Joint"),
    Column(title="Name", words=True),
    Column(title="From", unit="rad, m"),
    Column(title="To", unit="rad, m"),
    Column(title="Of its range", unit="%"),
    Column(title="Fastest", unit="rad/s, m/s"),
    Column(title="Acceleration", unit="rms"),
    Column(title="Slow", unit="% of time"),
    Column(title="Current", unit="rms"),
)


def check_report(found: Checked, arm: Arm) -> Report:
    """The lines, what to do about those that are not good, and how each joint moved.

    Args:
        found: What the check found.
        arm: That moved.
    """
    rows = tuple(_row(remark) for remark in found.all_remarks)
    parts: list[Part] = [Table(columns=COLUMNS, rows=rows)]
    parts += [
        Table(
            title=f"Motion of {PurePath(log.recording.name).name}", columns=MOTION_COLUMNS, rows=_motion_rows(log, arm)
        )
        for log in found.logs
        if log.motions is not None
    ]
    parts += [
        Paragraph(f"{_place(remark)}{remark.topic}: {remark.advice}.", MOODS[remark.grade])
        for remark in found.all_remarks
        if remark.advice is not None
    ]
    counts = {grade: sum(each.grade is grade for each in found.all_remarks) for grade in Grade}
    parts.append(
        Paragraph(
            f"{found.grade.value.upper()}: {counts[Grade.WRONG]} wrong, {counts[Grade.WEAK]} weak of "
            f"{len(found.all_remarks)} lines.",
            MOODS[found.grade],
            strong=True,
        )
    )
    return Report(f"Logs of {arm.name}", tuple(parts), check_document(found, arm))


def _row(remark: Remark) -> tuple[Cell, ...]:
    return cells(
        NONE if remark.log is None else PurePath(remark.log).name,
        remark.topic,
        Cell(remark.grade.value, MOODS[remark.grade]),
        remark.seen,
    )


def _place(remark: Remark) -> str:
    return "" if remark.log is None else f"{PurePath(remark.log).name}, "


def _motion_rows(log: LogRead, arm: Arm) -> tuple[tuple[Cell, ...], ...]:
    assert log.motions is not None, "asked of logs that could be filtered"
    return tuple(_motion_row(j, arm.joint_names[j], motion) for j, motion in enumerate(log.motions))


def _motion_row(j: int, name: str, motion: JointMotion) -> tuple[Cell, ...]:
    ends = (number(float(np.round(end, 3)), ".3f") for end in (motion.low, motion.high))
    return cells(
        str(j + 1),
        name,
        *ends,
        percent(motion.covered, ".0f"),
        f"{motion.speed:.3g}",
        f"{motion.acceleration_rms:.3g}",
        percent(motion.slow, ".0f"),
        f"{motion.current_rms:.3g}",
    )
