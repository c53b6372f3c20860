"""A ROS 2 `trajectory_msgs/JointTrajectory` as YAML, joints by the names of the model."""

import json

from ident.support.arrays import Array
from scenarios.design.motion_formats.sampled import SampledMotion
from scenarios.support.errors import ScenarioError

NANO = 1_000_000_000


def text(motion: SampledMotion) -> str:
    """The message; its first point is the start, where the robot has to be before.

    Raises:
        ScenarioError: If no model names the joints.
    """
    if motion.joint_names is None:
        raise ScenarioError(f"{motion.name}: a JointTrajectory names its joints; add --model ROBOT")
    lines = [f"joint_names: {json.dumps(motion.joint_names)}", "points:"]
    for t, q, dq, ddq in zip(motion.t, motion.q, motion.dq, motion.ddq, strict=True):
        sec, nanosec = divmod(round(float(t) * NANO), NANO)
        lines += [
            f"- positions: {_row(q)}",
            f"  velocities: {_row(dq)}",
            f"  accelerations: {_row(ddq)}",
            f"  time_from_start: {{sec: {sec}, nanosec: {nanosec}}}",
        ]
    return "\n".join(lines) + "\n"


def _row(values: Array) -> str:
    """Without exponents: YAML takes 1e-05 for a word."""
    return "[" + ", ".join(f"{x:.12f}" for x in values) + "]"
