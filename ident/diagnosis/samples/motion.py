"""The motion of a log: ranges, speeds, accelerations, time near reversals."""

from dataclasses import dataclass

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Severity
from ident.model.arm import Arm
from ident.numerics.signals import edge_samples
from ident.observation.full_rate import filtered_motion
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording, resampled
from ident.support.arrays import Array

SLOW_TIME = 0.4
"""Share of the time near reversals above which too little of a motion remains."""
LITTLE = 0.2
"""Range of a joint below which gravity hardly varies [rad or m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointMotion:
    """Motion of one joint.

    Attributes:
        low: Lowest position [rad or m].
        high: Highest position.
        covered: Share of the joint's range, None where the model states no limits.
        speed: Largest speed [rad/s or m/s].
        speed_rms: Its root mean square.
        acceleration_rms: Root mean square of the acceleration [rad/s^2 or m/s^2].
        slow: Share of the time in which samples are masked as near a reversal.
        current_rms: Root mean square of the current [drive units].
    """

    low: float
    high: float
    covered: float | None
    speed: float
    speed_rms: float
    acceleration_rms: float
    slow: float
    current_rms: float


def _filtered(recording: Recording, options: ObserveOptions) -> tuple[Array, Array, Array, Array]:
    """Positions, speeds and accelerations after the filters, without edges, shape (N, n) each.

    Also the share of the time that each joint is near a reversal or at rest, shape (n,).
    """
    even = resampled(recording)
    edge = edge_samples(even.period, options.cutoff_hz)
    inner = slice(edge, max(edge + 1, len(even.t) - edge))
    q, dq, ddq = (each[inner] for each in filtered_motion(even, options.cutoff_hz))
    return q, dq, ddq, np.mean(np.abs(dq) <= options.reversal_speed * _rms(dq), axis=0)


def joint_motions(recording: Recording, arm: Arm, options: ObserveOptions) -> tuple[JointMotion, ...]:
    """Return the motion of the joints of a recording, after the filters."""
    q, dq, ddq, slow = _filtered(recording, options)
    speed_rms, acceleration_rms, current_rms = _rms(dq), _rms(ddq), _rms(recording.v)
    span = arm.upper - arm.lower
    return tuple(
        JointMotion(
            low=float(q[:, j].min()),
            high=float(q[:, j].max()),
            covered=float(np.ptp(q[:, j]) / span[j]) if np.isfinite(span[j]) else None,
            speed=float(np.abs(dq[:, j]).max()),
            speed_rms=float(speed_rms[j]),
            acceleration_rms=float(acceleration_rms[j]),
            slow=float(slow[j]),
            current_rms=float(current_rms[j]),
        )
        for j in range(arm.n)
    )


def motion(recording: Recording, observing: ObserveOptions) -> list[Diagnosis]:
    """Check for joints that move too little or too slowly."""
    q, _, _, beside = _filtered(recording, observing)
    ranges = np.ptp(q, axis=0)
    j, k = int(ranges.argmin()), int(beside.argmax())
    short, slow = ranges[j] < LITTLE, beside[k] > SLOW_TIME
    return [
        Diagnosis(
            name="range",
            severity=Severity.WEAK if short else Severity.GOOD,
            sentence=f"every joint moves by at least {ranges[j]:.3g} rad or m (smallest range: q{j + 1})"
            if not short
            else f"q{j + 1} moves by only {ranges[j]:.3g} rad or m",
            advice="move every joint further" if short else None,
            joints=(j,),
            logs=(recording.name,),
            value=float(ranges[j]),
            unit="rad or m",
        ),
        Diagnosis(
            name="reversals",
            severity=Severity.WEAK if slow else Severity.GOOD,
            sentence=f"q{k + 1} is near a reversal or at rest for {100.0 * beside[k]:.3g} % of the time"
            if slow
            else f"joints are near a reversal or at rest for {100.0 * beside[k]:.3g} % of the time or less",
            advice="reverse less often, and leave out samples at rest" if slow else None,
            joints=(k,),
            logs=(recording.name,),
            value=100.0 * float(beside[k]),
            unit="% of the time",
        ),
    ]


def _rms(x: Array) -> Array:
    return np.sqrt(np.mean(x**2, axis=0))
