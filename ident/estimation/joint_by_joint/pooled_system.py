"""All joints and motions at once: the stacked identification model (paper, eq. 15, 16 and 25)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.estimation.problem import ObservedMotion
from ident.support.arrays import Array, Indices, Mask


@dataclass(frozen=True, slots=True, eq=False)
class PooledSystem:
    """`g V = W @ chi + W_L @ chi_L + rho`, rows in order of joints (eq. 16), then of motions.

    Attributes:
        V: Currents [drive units], shape (r,).
        W: Base columns of the arm, shape (r, b).
        W_L: The payload's ten columns, zero in unloaded rows, shape (r, 10).
        joint: Joint of each row, from 0, shape (r,).
        motion: Motion of each row, in the order given, shape (r,).
        loaded: Mask of the rows of loaded motions, shape (r,).
        t: Time of each row [s], shape (r,).
    """

    V: Array
    W: Array
    W_L: Array
    joint: Indices
    motion: Indices
    loaded: Mask
    t: Array


def pooled_system(motions: Sequence[ObservedMotion]) -> PooledSystem:
    """Stack motions of one structure, one or more."""
    structure = motions[0].observation.structure
    parts = [(j, k, motion.observation.joints[j]) for j in range(structure.arm.n) for k, motion in enumerate(motions)]
    heavy = [motion.payload is not None for motion in motions]
    W = np.zeros((sum(len(joint.V) for _, _, joint in parts), len(structure.base.columns)))
    start = 0
    for _, _, joint in parts:
        W[start : start + len(joint.V), joint.columns] = joint.W
        start += len(joint.V)
    return PooledSystem(
        V=np.concatenate([joint.V for _, _, joint in parts]),
        W=W,
        W_L=np.vstack([joint.W_L if heavy[k] else np.zeros_like(joint.W_L) for _, k, joint in parts]),
        joint=np.concatenate([np.full(len(joint.V), j) for j, _, joint in parts]),
        motion=np.concatenate([np.full(len(joint.V), k) for _, k, joint in parts]),
        loaded=np.concatenate([np.full(len(joint.V), heavy[k]) for _, k, joint in parts]),
        t=np.concatenate([joint.t for _, _, joint in parts]),
    )
