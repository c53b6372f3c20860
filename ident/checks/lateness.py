"""How late the currents of one log are, beside any motion of the arm.

Currents are shifted against positions in steps, and what any arm of these kinematics leaves of them is compared: the
logarithm of the likelihood, `-sum_j f_j ln s_j` over the joints, has its peak at the delay, and its curvature there is
one over the variance. A delay so long that friction steps leave the instants beside reversals, which the first order of
`ident.delay` cannot bear, is found as well.
"""

from dataclasses import dataclass

import numpy as np

from ident.checks.remark import Grade, Remark
from ident.errors import RecordingError
from ident.explanation import shares_left
from ident.gain_system import joint_rows
from ident.observation import ObserveOptions, observe
from ident.options import GainOptions
from ident.problem import Motion, Problem
from ident.recording import Recording, resampled
from ident.structure import Structure
from ident.wiring import NOTHING

LONGEST, STEPS = 0.06, 6
"""Longest delay that is looked for, either way [s], and steps to it."""
FINE = 0.004
"""Distance of the shifts that the peak is placed between [s]."""
BENT = 0.003
"""Standard deviation of what friction beside reversals makes of a delay [s]; clean logs read up to 6.5 ms."""
WEAK, WRONG = 2.0, 3.0
"""Deviations of a delay from none."""
SURE = 12.0
"""Logarithm of the likelihood ratio to no delay that it takes besides."""


@dataclass(frozen=True, slots=True)
class Lateness:
    """How late currents are logged.

    Attributes:
        value: Delay [s]; negative where they are early.
        std: Its standard deviation [s], what friction bends included; None where the search ends at its limit.
        evidence: Logarithm of the likelihood ratio to no delay.
    """

    value: float
    std: float | None
    evidence: float


def lateness(recording: Recording, structure: Structure, options: ObserveOptions) -> Lateness | None:
    """How late the currents of a log are, of all joints together; None where too few instants tell.

    Args:
        recording: Long enough for the filters.
        structure: Of the arm.
        options: Filters.

    Raises:
        RecordingError: If it is too short for the filters once it is cut to what all shifts have.
    """
    even = resampled(recording)
    step = max(1, round(LONGEST / STEPS / even.period))
    most = step * (STEPS + 1)
    if len(even.t) < 6 * most:
        return None

    def likelihood(rows: int) -> float:
        return _likelihood(_shifted(even, rows, most), structure, options)

    shifts = step * np.arange(-STEPS, STEPS + 1)
    coarse = np.array([likelihood(int(rows)) for rows in shifts])
    if not np.isfinite(coarse).all():
        return None
    middle = int(shifts[coarse.argmax()])
    if abs(middle) == shifts[-1]:
        return Lateness(float(middle * even.period), None, float(coarse.max() - coarse[STEPS]))
    fine = max(1, round(FINE / even.period))
    before, peak, after = likelihood(middle - fine), float(coarse.max()), likelihood(middle + fine)
    bend = 2.0 * peak - before - after
    if bend <= 0.0:
        return None
    spacing = fine * even.period
    value = middle * even.period + 0.5 * spacing * (after - before) / bend
    gained = peak + 0.125 * (after - before) ** 2 / bend - float(coarse[STEPS])
    return Lateness(float(value), float(np.hypot(spacing / np.sqrt(bend), BENT)), gained)


def _shifted(recording: Recording, rows: int, most: int) -> Recording:
    """The recording with each current as many rows earlier, cut to what all shifts have."""
    inner = slice(most, len(recording.t) - most)
    v = recording.v[most + rows : len(recording.t) - most + rows]
    return Recording(recording.t[inner], recording.q[inner], v, recording.name)


def _likelihood(recording: Recording, structure: Structure, options: ObserveOptions) -> float:
    """Of the currents of all joints, each alone; minus infinity where a joint has too few rows."""
    problem = Problem(structure, (Motion(observe(recording, structure, options), None),), GainOptions())
    total = 0.0
    for joint in range(structure.arm.n):
        rows = joint_rows(problem, joint)
        left = float(shares_left(rows.W, rows.V[:, None])[0])
        total -= (len(rows.V) - rows.W.shape[1]) * float(np.log(max(left, NOTHING)))
    return total


def delay_remark(recording: Recording, structure: Structure, options: ObserveOptions) -> Remark:
    """What the delay of a log is, with its deviation."""
    try:
        found = lateness(recording, structure, options)
    except RecordingError:  # long enough for the filters, but not once it is cut for the shifts
        found = None
    if found is None:
        return Remark(topic="delay of v", log=recording.name, seen="too few rows show it", grade=Grade.WEAK)
    spread = "" if found.std is None else f", 2 sigma {2e3 * found.std:.2g}"
    seen = f"{1e3 * found.value:.2g} ms{spread}"
    deviations = abs(found.value) / (found.std or BENT)
    if found.evidence < SURE or deviations < WEAK:
        return Remark(topic="delay of v", log=recording.name, seen=seen)
    return Remark(
        topic="delay of v",
        log=recording.name,
        seen=f"{seen} ({'later' if found.value > 0 else 'earlier'} than the positions)",
        grade=Grade.WRONG if deviations > WRONG else Grade.WEAK,
        advice="shift v against q, or log both with one clock",
    )
