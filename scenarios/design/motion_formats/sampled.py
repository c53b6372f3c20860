"""A motion at the samples of a controller."""

import math
from dataclasses import dataclass

import numpy as np

from ident.support.arrays import Array, Mask
from scenarios.support.errors import ScenarioError
from sim.trajectory import FourierTrajectory

MOST = 1_000_000
"""Samples of a file."""
ROUNDING = 1e-9
"""Share of a sample by which a duration may miss a whole number of samples."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampledMotion:
    """A motion of n joints, its end included.

    Attributes:
        name: Of the scenario or file.
        joint_names: Those of the model; None where no model is named.
        revolute: Which joints turn, shape (n,); None where no model is named.
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


def sampled(
    motion: FourierTrajectory, rate_hz: float, *, name: str, joint_names: tuple[str, ...] | None, revolute: Mask | None
) -> SampledMotion:
    """Sample a motion; its last sample is its end, which may come sooner than a period after the one before.

    Args:
        motion: The motion.
        rate_hz: Samples a second.
        name: Of the scenario or file.
        joint_names: Of the model.
        revolute: Which joints turn.

    Raises:
        ScenarioError: If that gives fewer than two samples or more than a file should hold, or names do not fit.
    """
    if joint_names is not None and len(joint_names) != motion.n:
        raise ScenarioError(f"{name}: a motion of {motion.n} joints, but the model has {len(joint_names)}")
    whole = math.ceil(motion.duration * rate_hz * (1.0 - ROUNDING))
    if not 1 <= whole <= MOST:
        raise ScenarioError(f"{name}: {motion.duration:g} s at {rate_hz:g} Hz are {whole:g} samples, up to {MOST}")
    t = np.minimum(np.arange(whole + 1) / rate_hz, motion.duration)
    t[-1] = motion.duration
    q, dq, ddq = motion(t)
    return SampledMotion(name=name, joint_names=joint_names, revolute=revolute, t=t, q=q, dq=dq, ddq=ddq)
