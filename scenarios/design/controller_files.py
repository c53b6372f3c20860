"""A sampled motion as files for a controller: CSV, ROS 2 JointTrajectory, URScript."""

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass
from io import StringIO

import numpy as np

from ident.support.arrays import Array
from scenarios.experiments.scenario import Setup
from scenarios.support.errors import ScenarioError

MOST = 1_000_000
"""Largest number of samples of a file."""
ROUNDING = 1e-9
"""Tolerance of the duration, in sampling periods."""
APPROACH = "a=0.3, v=0.2"
"""URScript: acceleration and speed of the move to the start [rad/s^2, rad/s]: slow enough to be supervised."""
REST = 2.0
"""URScript: pause at the start [s], so that vibrations decay before the motion."""
SERVOJ = "lookahead_time=0.1, gain=300"
"""Defaults of URScript: smoothing [s] and stiffness."""
URSCRIPT_JOINTS = 6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampledMotion:
    """A motion of n joints at the samples of a controller, including its end.

    Attributes:
        joint_names: Names in the model.
        t: Times [s], shape (N,); the last period may be shorter.
        q: Positions [rad, m], shape (N, n).
        dq: Speeds [rad/s, m/s], shape (N, n).
        ddq: Accelerations [rad/s^2, m/s^2], shape (N, n).
    """

    joint_names: tuple[str, ...]
    t: Array
    q: Array
    dq: Array
    ddq: Array


def sampled(setup: Setup, rate_hz: float) -> SampledMotion:
    """Return the motion of a scenario at a rate [Hz].

    Raises:
        ScenarioError: If there are too many samples.
    """
    motion, arm = setup.experiments[0].trajectory, setup.structure.arm
    periods = math.ceil(motion.duration * rate_hz * (1.0 - ROUNDING))
    if not 1 <= periods <= MOST:
        raise ScenarioError(
            f"{setup.scenario.name}: {motion.duration:g} s at {rate_hz:g} Hz are {periods:g} samples; "
            f"expected 1 to {MOST}"
        )
    t = np.minimum(np.arange(periods + 1) / rate_hz, motion.duration)
    t[-1] = motion.duration
    q, dq, ddq = motion(t)
    return SampledMotion(joint_names=arm.joint_names, t=t, q=q, dq=dq, ddq=ddq)


def controller_files(setup: Setup, motion: SampledMotion) -> dict[str, str]:
    """Return the texts of all files that the arm's kind of joints permits, by name."""
    texts = {"motion.csv": csv_text(motion), "motion.yaml": ros_text(motion)}
    if setup.structure.arm.revolute.all() and setup.structure.arm.n == URSCRIPT_JOINTS:
        texts["motion.script"] = urscript_text(motion)
    return texts


def csv_text(motion: SampledMotion) -> str:
    """Return CSV with columns t, q1 .. qn, dq1 .. dqn, ddq1 .. ddqn, all digits, below a comment."""
    names = [f"{kind}{j}" for kind in ("q", "dq", "ddq") for j in range(1, len(motion.joint_names) + 1)]
    comment = f"# s, rad, rad/s, rad/s^2 (m for prismatic joints); joints: {', '.join(motion.joint_names)}"
    text, rows = StringIO(), np.column_stack((motion.t, motion.q, motion.dq, motion.ddq))
    header = "\n".join((comment, ",".join(["t", *names])))
    np.savetxt(text, rows, fmt="%.17g", delimiter=",", header=header, comments="")
    return text.getvalue()


def ros_text(motion: SampledMotion) -> str:
    """Return a ROS 2 `trajectory_msgs/JointTrajectory` as YAML, whose first point is the start position."""
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
    """Return a URScript program: a slow `movej` to the start, then one `servoj` per sample."""
    lines = [f"  movej({_row(motion.q[0], 9)}, {APPROACH})", f"  sleep({REST!r})"]
    for q, step in zip(motion.q[1:], np.diff(motion.t), strict=True):
        lines.append(f"  servoj({_row(q, 9)}, t={step:.9g}, {SERVOJ})")
    return "\n".join(["def drive_gains():", *lines, "  stopj(2.0)", "end", "drive_gains()"]) + "\n"


def _row(values: Iterable[float], digits: int) -> str:
    """Return numbers without exponents: YAML reads 1e-05 as a string."""
    return "[" + ", ".join(f"{x:.{digits}f}" for x in values) + "]"
