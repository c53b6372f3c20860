"""The payload's first moments from joints whose gains the mass alone has given (paper, eq. 25)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.estimation.joint_by_joint.joint_fit import JointFit
from ident.estimation.joint_by_joint.pooled_system import PooledSystem, pooled_system
from ident.estimation.problem import Problem
from ident.model.base import independent_columns, random_regressor
from ident.model.parameters import INERTIAL
from ident.model.structure import PROBE_SEED, Structure
from ident.numerics.least_squares import least_squares, row_weights
from ident.payload.payload import KnownPayload
from ident.support.arrays import Array, Indices

MOMENTS = ("MX", "MY", "MZ")
MOMENT_COLUMNS: Indices = np.array([INERTIAL.index(name) for name in MOMENTS])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FirstMoments:
    """First moments of the payload found with identified gains.

    Attributes:
        value: MX, MY, MZ at the origin of the last frame [kg m], 0 where no joint shows it, shape (3,).
        seen: Names of those that some joint shows.
        influence: Derivative by the current of each row, directly and through the gains, shape (3, r).
        joints: Joints of those rows, from 0, in ascending order.
        mass: The mass they rest on [kg].
    """

    value: Array
    seen: tuple[str, ...]
    influence: Array
    joints: tuple[int, ...]
    mass: float


def first_moments(problem: Problem, found: Sequence[JointFit], mass: KnownPayload) -> FirstMoments:
    """Find the payload's first moments from the joints whose gains are known (paper, eq. 25).

    Args:
        problem: Motions, one payload.
        found: Solutions of the joints whose gains the mass gives, in the order of the joints.
        mass: The mass, known.
    """
    joints = [fit.system.rows.joint for fit in found]
    system = _rows_of(pooled_system(problem.motions), joints)
    gain = np.array([1.0 / fit.inverse for fit in found])
    each_gain = gain[np.searchsorted(joints, system.joint)]
    arm, body = _independent(problem.structure, joints, mass)
    W = np.hstack((system.W[:, arm], system.W_L[:, body]))
    Y = each_gain * system.V - system.W_L[:, mass.mask] @ mass.chi[mass.mask]
    weight = row_weights(W, Y, system.joint)
    fit = least_squares(W * weight[:, None], Y * weight, rank_tol=problem.options.rank_tol)
    at = {int(column): len(arm) + k for k, column in enumerate(body)}
    seen = [k for k, column in enumerate(MOMENT_COLUMNS) if int(column) in at]
    chosen = [at[int(MOMENT_COLUMNS[k])] for k in seen]
    P = fit.cofactor[chosen] @ (W * weight[:, None] ** 2).T  # moments = P @ Y, shape (seen, r)
    value, influence = np.zeros(len(MOMENTS)), np.zeros((len(MOMENTS), len(Y)))
    value[seen], influence[seen] = fit.x[chosen], P * each_gain
    for g, own in zip(gain, found, strict=True):  # dg = -g^2 d(1/g) moves the left side as well
        rows = system.joint == own.system.rows.joint
        influence[np.ix_(seen, rows)] -= g**2 * np.outer(P[:, rows] @ system.V[rows], own.influence)
    return FirstMoments(
        value=value,
        seen=tuple(MOMENTS[k] for k in seen),
        influence=influence,
        joints=tuple(joints),
        mass=float(mass.chi[INERTIAL.index("M")]),
    )


def _rows_of(system: PooledSystem, joints: Sequence[int]) -> PooledSystem:
    """The rows of some joints."""
    rows = np.isin(system.joint, joints)
    return PooledSystem(
        V=system.V[rows],
        W=system.W[rows],
        W_L=system.W_L[rows],
        joint=system.joint[rows],
        motion=system.motion[rows],
        loaded=system.loaded[rows],
        t=system.t[rows],
    )


def _independent(structure: Structure, joints: Sequence[int], mass: KnownPayload) -> tuple[Indices, Indices]:
    """Base columns and payload columns that are independent on the rows of some joints."""
    W = random_regressor(structure.arm, np.random.default_rng(PROBE_SEED))
    rows = np.vstack([W[:, j, structure.base.columns] for j in joints])
    probes = np.vstack([structure.payload_probes[j] for j in joints])
    arm = np.sort(independent_columns(rows, [np.arange(rows.shape[1])]))
    rest = np.array([k for k in range(10) if not mass.mask[k] and k not in MOMENT_COLUMNS])
    return arm, np.sort(independent_columns(probes, [MOMENT_COLUMNS, rest]))
