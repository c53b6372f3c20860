"""Where a search for a motion begins: at the robot's home, or at positions that are drawn where home will not do."""

import numpy as np

from ident.support.arrays import Array
from scenarios.design.excitation import Design
from scenarios.design.limits import RANGE_SHARE, TORQUE_SHARE
from sim.errors import TrajectoryError
from sim.trajectory import FourierTrajectory

DRAWN = 2000
"""Positions that are tried."""
ENOUGH = 30
"""Admissible ones that are kept."""


def starts(design: Design, home: Array, rng: np.random.Generator) -> Array:
    """Positions that motions may move about at first.

    Args:
        design: The problem.
        home: Positions that the robot's file names [rad or m], shape (n,).
        rng: Draws others.

    Returns:
        Home alone if it is admissible at rest, else admissible positions drawn within the ranges, shape (k, n).

    Raises:
        TrajectoryError: If none of them is.
    """
    if admissible(design, home[None])[0]:
        return home[None]
    limits = design.problem.limits
    center, half = 0.5 * (limits.upper + limits.lower), 0.5 * RANGE_SHARE * (limits.upper - limits.lower)
    drawn = center + half * rng.uniform(-1.0, 1.0, (DRAWN, len(home)))
    found = drawn[admissible(design, drawn)][:ENOUGH]
    if not len(found):
        raise TrajectoryError(
            f"robot {design.problem.plant.robot.name}: neither home nor any of {DRAWN} positions within "
            "the ranges keeps its distance from floor and arm and carries the payload with "
            f"{TORQUE_SHARE:g} of the torque; check shapes, current limits and payload"
        )
    return found


def admissible(design: Design, q: Array) -> np.ndarray:
    """Which positions (k, n) keep every limit at rest, shape (k,)."""
    return np.array([not design.excess(design.rows(_resting(each), 1.0)).any() for each in q], dtype=bool)


def _resting(q: Array) -> FourierTrajectory:
    """One instant at a position."""
    return FourierTrajectory(q, np.zeros((len(q), 1)), np.zeros((len(q), 1)), 1.0)
