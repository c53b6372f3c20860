"""How late the currents of one log are, beside any motion of the arm."""

import numpy as np

from ident.checks.remark import Grade, Remark
from ident.delay import Delay, common_delay, joint_delay
from ident.errors import RecordingError
from ident.gain_system import joint_rows
from ident.observation import ObserveOptions, observe
from ident.options import GainOptions
from ident.problem import Motion, Problem
from ident.recording import Recording
from ident.structure import Structure

WORTH, MOST = 0.002, 0.008
"""Delays [s] that are worth a word, and that move gains by a per cent or more where motions differ in it."""


def log_delay(recording: Recording, structure: Structure, options: ObserveOptions) -> Delay | None:
    """How late the currents of a log are, of all joints together; None where no joint shows it.

    Raises:
        RecordingError: If the recording is too short or too slow for the filters.
    """
    problem = Problem(structure, (Motion(observe(recording, structure, options), None),), GainOptions())
    found = [joint_delay(problem, joint_rows(problem, joint)) for joint in range(structure.arm.n)]
    own = [each for each in found if each is not None]
    return common_delay(own) if own else None


def delay_remark(recording: Recording, structure: Structure, options: ObserveOptions) -> Remark:
    """What the delay of a log is, with its deviation."""
    try:
        found = log_delay(recording, structure, options)
    except RecordingError as error:
        return Remark(topic="delay of v", log=recording.name, seen=f"not to be seen: {error}", grade=Grade.WEAK)
    if found is None:
        return Remark(topic="delay of v", log=recording.name, seen="too few rows show it", grade=Grade.WEAK)
    value, std = float(found.value[0]), float(np.sqrt(found.covariance[0, 0]))
    seen = f"{1e3 * value:.2g} ms, 2 sigma {2e3 * std:.2g}"
    if not found.sure or abs(value) < WORTH:
        return Remark(topic="delay of v", log=recording.name, seen=seen)
    return Remark(
        topic="delay of v",
        log=recording.name,
        seen=f"{seen} ({'later' if value > 0 else 'earlier'} than the positions)",
        grade=Grade.WRONG if abs(value) > MOST else Grade.WEAK,
        advice="shift v against q, or log both with one clock",
    )
