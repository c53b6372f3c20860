"""All joints and motions at once: the stacked system of the identification model (paper, eq. 15, 16 and 25)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.arrays import Array, Indices, Mask
from ident.observation import Observation


@dataclass(frozen=True, slots=True, eq=False)
class StackedSystem:
    """`g V = W @ chi + W_L @ chi_L + rho`, the rows of a joint together (eq. 16), unloaded ones first.

    Attributes:
        V: Currents [drive units], shape (r,).
        W: Base columns of the arm, shape (r, b).
        W_L: The payload's ten columns, zero in unloaded rows, shape (r, 10).
        joint: Joint of each row, from 0, shape (r,).
        loaded: Which rows are of a loaded motion, shape (r,).
        t: Time of each row [s], shape (r,).
    """

    V: Array
    W: Array
    W_L: Array
    joint: Indices
    loaded: Mask
    t: Array


def stacked_system(unloaded: Sequence[Observation], loaded: Sequence[Observation]) -> StackedSystem:
    """Stack motions of one structure; either sequence may be empty, not both."""
    motions = [(o, False) for o in unloaded] + [(o, True) for o in loaded]
    structure = motions[0][0].structure
    parts = [(j, o.joints[j], heavy) for j in range(structure.arm.n) for o, heavy in motions]
    W = np.zeros((sum(len(joint.V) for _, joint, _ in parts), len(structure.base.columns)))
    start = 0
    for _, joint, _ in parts:
        W[start : start + len(joint.V), joint.columns] = joint.W
        start += len(joint.V)
    return StackedSystem(
        V=np.concatenate([joint.V for _, joint, _ in parts]),
        W=W,
        W_L=np.vstack([joint.W_L if heavy else np.zeros_like(joint.W_L) for _, joint, heavy in parts]),
        joint=np.concatenate([np.full(len(joint.V), j) for j, joint, _ in parts]),
        loaded=np.concatenate([np.full(len(joint.V), heavy) for _, joint, heavy in parts]),
        t=np.concatenate([joint.t for _, joint, _ in parts]),
    )
