"""CSV: `t`, `q1` .. `qn`, `dq1` .. `dqn`, `ddq1` .. `ddqn`, every digit kept."""

import numpy as np

from scenarios.design.motion_formats.sampled import SampledMotion


def text(motion: SampledMotion) -> str:
    """The rows below their header; `q1`, ... are named in a comment."""
    n = motion.q.shape[1]
    names = "" if motion.joint_names is None else f"; joints: {', '.join(motion.joint_names)}"
    header = ["t", *(f"{kind}{j}" for kind in ("q", "dq", "ddq") for j in range(1, n + 1))]
    rows = np.column_stack((motion.t, motion.q, motion.dq, motion.ddq))
    lines = [f"# s, rad, rad/s, rad/s^2 (m where a joint slides){names}", ",".join(header)]
    return "\n".join([*lines, *(",".join(map(repr, row)) for row in rows.tolist())]) + "\n"
