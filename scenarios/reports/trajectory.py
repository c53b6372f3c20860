"""What `rx90 trajectory` says: how far, how fast and how sharply each joint moves, beside its limits."""

from pathlib import Path

import numpy as np

from scenarios.design.limits import Limits
from scenarios.design.motion_formats import SampledMotion
from scenarios.design.results import Sampled
from scenarios.reports.content import NONE, Cell, Column, Mood, Paragraph, Part, Report, Table, cells

COLUMNS = (
    Column(title="Joint"),
    Column(title="Name", words=True),
    Column(title="Start"),
    Column(title="Lowest"),
    Column(title="Highest"),
    Column(title="Speed"),
    Column(title="Of limit", unit="%"),
    Column(title="Acceleration"),
    Column(title="Of limit", unit="%"),
)


def motion_table(motion: SampledMotion, limits: Limits) -> Table:
    """How each joint moves."""
    speed, acceleration = np.abs(motion.dq).max(axis=0), np.abs(motion.ddq).max(axis=0)
    rows = tuple(
        cells(
            str(j + 1),
            NONE if motion.joint_names is None else motion.joint_names[j],
            *(f"{x:.4f}" for x in (motion.q[0, j], motion.q[:, j].min(), motion.q[:, j].max())),
            f"{speed[j]:.3f}",
            _share(speed[j] / limits.velocity[j]),
            f"{acceleration[j]:.3f}",
            _share(acceleration[j] / limits.acceleration[j]),
        )
        for j in range(len(speed))
    )
    return Table(columns=COLUMNS, rows=rows)


def trajectory_report(motion: SampledMotion, limits: Limits, out: Path, form: str) -> Report:
    """What was written.

    Args:
        motion: The motion.
        limits: Of the arm.
        out: The file.
        form: Its form.
    """
    broken = limits.broken_by((motion.q, motion.dq, motion.ddq))
    words = f"{out}: {len(motion.t)} samples, {motion.t[-1]:g} s, {form}."
    verdict = Paragraph(words, strong=True)
    if broken:
        verdict = Paragraph(f"{words} Beyond the robot's limits: {', '.join(broken)}.", Mood.BAD, strong=True)
    parts: list[Part] = [
        verdict,
        motion_table(motion, limits),
        Paragraph("In rad, rad/s, rad/s^2; m where a joint slides."),
        Paragraph("Move the robot slowly to the start above, and run the motion at low speed first."),
    ]
    result = Sampled(
        out=str(out),
        format=form,
        samples=len(motion.t),
        duration_s=float(motion.t[-1]),
        start=motion.q[0].tolist(),
        max_velocity=np.abs(motion.dq).max(axis=0).tolist(),
        max_acceleration=np.abs(motion.ddq).max(axis=0).tolist(),
        beyond_limits=list(broken),
    )
    return Report("Motion to command", tuple(parts), result.model_dump(mode="json"))


def _share(share: float) -> Cell:
    """A share of a limit in percent, a dash where there is no limit."""
    if share == 0.0:
        return Cell(NONE)
    return Cell(f"{100.0 * share:.0f}", Mood.BAD if share > 1.0 else Mood.PLAIN)
