"""What `rx90 check` says: a line a finding, with its verdict; how each joint moved."""

from pathlib import PurePath

from ident.arm import Arm
from ident.checks.check import Checked
from ident.checks.remark import Grade, Remark
from scenarios.reports.content import NONE, Cell, Column, Mood, Paragraph, Part, Report, Table, cells
from scenarios.reports.motion import motion_table
from scenarios.store.check_document import check_document

MOODS = {Grade.GOOD: Mood.GOOD, Grade.WEAK: Mood.DOUBTFUL, Grade.WRONG: Mood.BAD}
COLUMNS = (
    Column(title="Log", words=True),
    Column(title="What", words=True),
    Column(title="Verdict", words=True),
    Column(title="Seen", words=True),
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
        motion_table(f"Motion of {PurePath(log.recording.name).name}", log.motions, arm)
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
