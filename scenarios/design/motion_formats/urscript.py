"""URScript: a slow `movej` to the start, then one `servoj` a sample."""

import numpy as np

from ident.support.arrays import Array
from scenarios.design.motion_formats.sampled import SampledMotion
from scenarios.support.errors import ScenarioError

JOINTS = 6
APPROACH = "a=0.3, v=0.2"
"""Of the way to the start [rad/s^2, rad/s]: slow enough to be watched."""
REST = 2.0
"""At the start [s], so that nothing swings when the motion begins."""
LOOKAHEAD, STIFFNESS = 0.1, 300
"""URScript's own defaults of `servoj`: smoothing [s] and gain."""


def text(motion: SampledMotion) -> str:
    """A program without arguments; times are steps between samples.

    Raises:
        ScenarioError: If the arm has not six joints that turn.
    """
    n = motion.q.shape[1]
    if n != JOINTS or (motion.revolute is not None and not motion.revolute.all()):
        slides = 0 if motion.revolute is None else int(np.count_nonzero(~motion.revolute))
        raise ScenarioError(
            f"{motion.name}: URScript moves six joints that turn; these are {n}, {slides} of which slide"
        )
    lines = [
        "def drive_gains():",
        f"  movej({_row(motion.q[0])}, {APPROACH})",
        f"  sleep({REST!r})",
    ]
    for q, step in zip(motion.q[1:], np.diff(motion.t), strict=True):
        lines.append(f"  servoj({_row(q)}, t={step:.9g}, lookahead_time={LOOKAHEAD!r}, gain={STIFFNESS})")
    return "\n".join([*lines, "  stopj(2.0)", "end", "drive_gains()"]) + "\n"


def _row(q: Array) -> str:
    return "[" + ", ".join(f"{x:.9f}" for x in q) + "]"
