"""Identifiable structure from the kinematics: parameters that act on each joint's torque."""

from dataclasses import dataclass

import numpy as np

from ident.model.arm import Arm
from ident.model.base import BaseParameters, base_parameters, independent_columns, random_regressor
from ident.model.parameters import INERTIAL, STANDARD
from ident.support.arrays import Array, Indices

PROBE_SEED = 20110930
"""Seed of the random states; any other gives the same structure."""


@dataclass(frozen=True, slots=True, eq=False)
class Structure:
    """The identifiable structure of an arm.

    Attributes:
        arm: The arm, n joints.
        base: Its base parameters, b columns.
        joint_columns: Base columns that act on each joint, n index arrays into `base.columns`.
        joint_independent: A maximal subset of these that is independent in that joint's row, n index arrays into
            `base.columns`.
        payload_probes: The payload's ten columns of each joint on random states, shape (n, probes, 10).
    """

    arm: Arm
    base: BaseParameters
    joint_columns: tuple[Indices, ...]
    joint_independent: tuple[Indices, ...]
    payload_probes: Array

    @property
    def payload_columns(self) -> Indices:
        """Indices of the payload's columns, which are those of the last link, shape (10,)."""
        return len(STANDARD) * (self.arm.n - 1) + np.arange(len(INERTIAL))


def structure_of(arm: Arm) -> Structure:
    """Return base parameters, and the columns of arm and payload that act on each joint."""
    rng = np.random.default_rng(PROBE_SEED)
    base = base_parameters(arm, rng)
    W = random_regressor(arm, rng)
    seen, independent = [], []
    for j in range(arm.n):
        row = W[:, j, base.columns]
        seen.append(np.flatnonzero(np.abs(row).max(axis=0) > 1e-9))
        independent.append(np.sort(independent_columns(row, [np.arange(len(base.columns))])))
    first = len(STANDARD) * (arm.n - 1)
    probes = np.moveaxis(W[..., first : first + len(INERTIAL)], 0, 1)
    return Structure(arm, base, tuple(seen), tuple(independent), probes)
