"""Which readings of a log no currents can tell apart, because the kinematics let them explain the same.

What a joint's currents can be explained by is the span of its columns. Two readings are the same if these spans agree
on all joints and states. Equal spans project a vector alike, other spans project a random one differently, so that one
vector a joint, on random states, tells: no pair has to be compared (Freivalds' check).
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from ident.arrays import Array
from ident.explanation import Unknowns, joint_columns, regressor_as_read
from ident.readings import Reading
from ident.structure import PROBE_SEED, Structure

STATES, MORE = 20, 30
"""Random states a joint and a motion, more than twice the columns of either."""
SAME = 1e-6
"""Difference of two unit projections that rounding makes; other spans differ by more than 1e-3."""


@dataclass(frozen=True, slots=True, eq=False)
class Fingerprint:
    """What a reading's spans make of one random vector.

    Attributes:
        projected: Of each column of currents, n unit vectors over the random states.
    """

    projected: tuple[Array, ...]


def fingerprint(structure: Structure, unknowns: Unknowns, reading: Reading, *, motions: int) -> Fingerprint:
    """What tells a reading from others that explain something else.

    Args:
        structure: Of the arm.
        unknowns: What is solved for under the reading's gravity.
        reading: The reading.
        motions: Of the logs that are compared.
    """
    arm = structure.arm
    states = STATES * arm.n + MORE * motions
    rng = np.random.default_rng(PROBE_SEED)
    q, dq, ddq = rng.uniform(-np.pi, np.pi, (3, states, arm.n))
    vectors = rng.normal(size=(states, arm.n))
    motion = np.arange(states) % motions
    columns = regressor_as_read(arm, reading, q, dq, ddq)
    found = [np.zeros(0)] * arm.n
    for joint in range(arm.n):
        column = int(reading.v_order[joint])
        W = joint_columns(columns[:, joint], unknowns, joint, motion)
        size = np.linalg.norm(W, axis=0)
        Q = linalg.qr(W / np.where(size > 0.0, size, 1.0), mode="economic", check_finite=False)[0]
        projected = Q @ (Q.T @ vectors[:, column])
        found[column] = projected / np.linalg.norm(projected)
    return Fingerprint(tuple(found))


def same(one: Fingerprint, other: Fingerprint) -> bool:
    """Whether two readings explain the same of any currents."""
    return all(float(np.abs(a - b).max()) < SAME for a, b in zip(one.projected, other.projected, strict=True))
