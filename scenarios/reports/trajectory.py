"""Report of `rx90 trajectory`: range, speed and acceleration of each joint, with its limits."""

from pathlib import Path

import numpy as np

from scenarios.design.limits import Limits
from scenarios.design.motion_formats import SampledMotion
from scenarios.design.results import Sampled
from scenarios.reports.content import NONE, Cell, Mood, Paragraph, Part, Report, Table, column, table


def motion_table(motion: SampledMotion, limits: Limits) -> Table:
    """Return the table of the joints' motion."""
    speed, acceleration = np.abs(motion.dq).max(axis=0), np.abs(motion.ddq).max(axis=0)
    names = motion.joint_names or (NONE,) * len(speed)
    return table(
        range(len(speed)),
        column("Joint", lambda j: j + 1),
        column("Name", lambda j: names[j], words=True),
        column("Start", lambda j: f"{motion.q[0, j]:.4f}"),
        column("Lowest", lambda j: f"{motion.q[:, j].min():.4f}"),
        column("Highest", lambda j: f"{motion.q[:, j].max():.4f}"),
        column("Speed", lambda j: f"{speed[j]:.3f}"),
        column("Of limit [%]", lambda j: _share(speed[j] / limits.velocity[j])),
        column("Acceleration", lambda j: f"{acceleration[j]:.3f}"),
        column("Of limit [%]", lambda j: _share(acceleration[j] / limits.acceleration[j])),
    )


def trajectory_report(motion: SampledMotion, limits: Limits, out: Path, form: str) -> Report:
    """Return the report."""
    broken = limits.broken_by((motion.q, motion.dq, motion.ddq))
    words = f"{out}: {len(motion.t)} samples, {motion.t[-1]:g} s, {form}."
    verdict = Paragraph(words, strong=True)
    if broken:
        verdict = Paragraph(f"{words} Beyond the robot's limits: {', '.join(broken)}.", Mood.BAD, strong=True)
    parts: list[Part] = [
        verdict,
        motion_table(motion, limits),
        Paragraph("In rad, rad/s, rad/s^2; m for prismatic joints."),
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
    """Return a share of a limit in percent, a dash without a limit."""
    if share == 0.0:
        return Cell(NONE)
    return Cell(f"{100.0 * share:.0f}", Mood.BAD if share > 1.0 else Mood.PLAIN)
