"""File formats of motions for controllers."""

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from ident.support.arrays import Array, Mask
from scenarios.support.errors import ScenarioError

ENDINGS = {".csv": "csv", ".yaml": "ros", ".yml": "ros", ".script": "urscript"}
"""Format by the ending of a file."""
URSCRIPT_JOINTS = 6
APPROACH = "a=0.3, v=0.2"
"""URScript: acceleration and speed of the move to the start [rad/s^2, rad/s]: slow enough to be supervised."""
REST = 2.0
"""URScript: pause at the start [s], so that vibrations decay before the motion."""
SERVOJ = "lookahead_time=0.1, gain=300"
"""Defaults of URScript: smoothing [s] and stiffness."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampledMotion:
    """A motion of n joints at the samples of a controller, including its end.

    Attributes:
        name: Name of the scenario or file.
        joint_names: Names in the model; None without a model.
        revolute: Whether each joint is revolute, shape (n,); None without a model.
        t: Times [s], shape (N,).
        q: Positions [rad, m], shape (N, n).
        dq: Speeds [rad/s, m/s], shape (N, n).
        ddq: Accelerations [rad/s^2, m/s^2], shape (N, n).
    """

    name: str
    joint_names: tuple[str, ...] | None
    revolute: Mask | None
    t: Array
    q: Array
    dq: Array
    ddq: Array


def csv_text(motion: SampledMotion) -> str:
    """Return CSV with `t`, `q1` ..

    `qn`, `dq1` .. `dqn`, `ddq1` .. `ddqn`, all digits, below a comment with joint names.
    """
    n = motion.q.shape[1]
    names = "" if motion.joint_names is None else f"; joints: {', '.join(motion.joint_names)}"
    header = ["t", *(f"{kind}{j}" for kind in ("q", "dq", "ddq") for j in range(1, n + 1))]
    rows = np.column_stack((motion.t, motion.q, motion.dq, motion.ddq))
    lines = [f"# s, rad, rad/s, rad/s^2 (m for prismatic joints){names}", ",".join(header)]
    return "\n".join([*lines, *(",".join(map(repr, row)) for row in rows.tolist())]) + "\n"


def ros_text(motion: SampledMotion) -> str:
    """Return a ROS 2 `trajectory_msgs/JointTrajectory` as YAML, whose first point is the start position.

    Raises:
        ScenarioError: If there are no joint names.
    """
    if motion.joint_names is None:
        raise ScenarioError(f"{motion.name}: a JointTrajectory names its joints; add --model ROBOT")
    lines = [f"joint_names: {json.dumps(motion.joint_names)}", "points:"]
    for t, q, dq, ddq in zip(motion.t, motion.q, motion.dq, motion.ddq, strict=True):
        sec, nanosec = divmod(round(float(t) * 10**9), 10**9)
        lines += [
            f"- positions: {_row(q, 12)}",
            f"  velocities: {_row(dq, 12)}",
            f"  accelerations: {_row(ddq, 12)}",
            f"  time_from_start: {{sec: {sec}, nanosec: {nanosec}}}",
        ]
    return "\n".join(lines) + "\n"


def urscript_text(motion: SampledMotion) -> str:
    """Return a URScript program: a slow `movej` to the start, then one `servoj` per sample.

    Raises:
        ScenarioError: If the arm does not have six revolute joints.
    """
    n = motion.q.shape[1]
    slides = 0 if motion.revolute is None else int(np.count_nonzero(~motion.revolute))
    if n != URSCRIPT_JOINTS or slides:
        raise ScenarioError(
            f"{motion.name}: URScript moves arms of six revolute joints; this one has {n} joints, {slides} of them "
            "prismatic"
        )
    lines = [f"  movej({_row(motion.q[0], 9)}, {APPROACH})", f"  sleep({REST!r})"]
    for q, step in zip(motion.q[1:], np.diff(motion.t), strict=True):
        lines.append(f"  servoj({_row(q, 9)}, t={step:.9g}, {SERVOJ})")
    return "\n".join(["def drive_gains():", *lines, "  stopj(2.0)", "end", "drive_gains()"]) + "\n"


def _row(values: Iterable[float], digits: int) -> str:
    """Return a number without exponent: YAML reads 1e-05 as a string."""
    return "[" + ", ".join(f"{x:.{digits}f}" for x in values) + "]"


FORMATS: dict[str, tuple[str, Callable[[SampledMotion], str]]] = {
    "csv": ("positions, speeds and accelerations, one row per sample", csv_text),
    "ros": ("ROS 2 JointTrajectory, YAML", ros_text),
    "urscript": ("URScript, a slow movej to the start and a list of servoj; six revolute joints", urscript_text),
}
"""Formats by name: description and function."""
