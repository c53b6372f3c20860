"""All joints at once: the stacked system of the identification model with given drive gains (paper, eq. 12 to 16)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.arrays import Array, Indices
from ident.observation import Observation


@dataclass(frozen=True, slots=True, eq=False)
class StackedSystem:
    """`Y = W @ chi + rho`, the rows of a joint together (eq. 16).

    Attributes:
        W: Base columns of the arm, shape (r, b).
        Y: Torques, gain times current [N m], shape (r,).
        joint: Joint of each row, from 0, shape (r,).
    """

    W: Array
    Y: Array
    joint: Indices


def stacked_system(observations: Sequence[Observation], gain: Array) -> StackedSystem:
    """Stack the rows of motions with a bare flange.

    Args:
        observations: One or more, of one structure.
        gain: Drive gains [N m / drive unit], shape (n,).
    """
    W, Y, numbers = [], [], []
    for j in range(observations[0].structure.arm.n):
        for observation in observations:
            joint = observation.joints[j]
            rows = np.zeros((len(joint.V), len(observation.structure.base.columns)))
            rows[:, joint.columns] = joint.W
            W.append(rows)
            Y.append(gain[j] * joint.V)
            numbers.append(np.full(len(joint.V), j))
    return StackedSystem(np.vstack(W), np.concatenate(Y), np.concatenate(numbers))
