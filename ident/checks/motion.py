"""What the motion of a log shows of an arm: ranges, speeds, accelerations, time beside reversals."""

from dataclasses import dataclass

import numpy as np

from ident.arm import Arm
from ident.arrays import Array
from ident.checks.remark import Grade, Remark
from ident.observation import ObserveOptions
from ident.recording import Recording, resampled
from ident.signals import edge_samples, smooth_motion

SLOW_TIME = 0.4
"""Share of the time beside reversals that leaves too little of a motion."""
LITTLE = 0.2
"""Range of a joint that shows little of its gravity [rad or m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointMotion:
    """How one joint moved.

    Attributes:
        low: Lowest position [rad or m].
        high: Highest position.
        covered: Share of the joint's range, None where the model states no limits.
        speed: Largest speed [rad/s or m/s].
        speed_rms: Its root mean square.
        acceleration_rms: The same of the acceleration [rad/s^2 or m/s^2].
        slow: Share of the time below the speed at which samples are left out as beside a reversal.
        current_rms: Of the current [drive units].
    """

    low: float
    high: float
    covered: float | None
    speed: float
    speed_rms: float
    acceleration_rms: float
    slow: float
    current_rms: float


def joint_motions(recording: Recording, arm: Arm, options: ObserveOptions) -> tuple[JointMotion, ...]:
    """How the joints of a recording moved, after the filters."""
    even = resampled(recording)
    edge = edge_samples(even.period, options.cutoff_hz)
    inner = slice(edge, max(edge + 1, len(even.t) - edge))
    q, dq, ddq = (each[inner] for each in smooth_motion(even.q, even.period, options.cutoff_hz))
    rms, acceleration_rms, current_rms = _rms(dq), _rms(ddq), _rms(recording.v)
    slow = np.mean(np.abs(dq) <= options.reversal_speed * rms, axis=0)
    span = arm.upper - arm.lower
    return tuple(
        JointMotion(
            low=float(q[:, j].min()),
            high=float(q[:, j].max()),
            covered=float(np.ptp(q[:, j]) / span[j]) if np.isfinite(span[j]) else None,
            speed=float(np.abs(dq[:, j]).max()),
            speed_rms=float(rms[j]),
            acceleration_rms=float(acceleration_rms[j]),
            slow=float(slow[j]),
            current_rms=float(current_rms[j]),
        )
        for j in range(arm.n)
    )


def motion_remarks(recording: Recording, motions: tuple[JointMotion, ...]) -> list[Remark]:
    """Which joints moved too little, or too slowly."""
    short = [(m.high - m.low, j) for j, m in enumerate(motions)]
    least, j = min(short)
    slow, k = max((m.slow, j) for j, m in enumerate(motions))
    return [
        Remark(
            topic="range",
            log=recording.name,
            joint=j,
            seen=f"at least {least:.3g} rad or m (q{j + 1})",
            grade=Grade.WEAK if least < LITTLE else Grade.GOOD,
            advice="let every joint move further" if least < LITTLE else None,
        ),
        Remark(
            topic="reversals",
            log=recording.name,
            joint=k,
            seen=f"at most {100.0 * slow:.3g} % of the time beside reversals or at rest (q{k + 1})",
            grade=Grade.WEAK if slow > SLOW_TIME else Grade.GOOD,
            advice="let joints reverse more rarely, and cut off what is recorded at rest" if slow > SLOW_TIME else None,
        ),
    ]


def _rms(x: Array) -> Array:
    return np.sqrt(np.mean(x**2, axis=0))
