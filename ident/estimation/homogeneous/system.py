"""The stacked homogeneous equations of all joints and motions."""

from dataclasses import dataclass

import numpy as np

from ident.estimation.all_joints.columns import JointColumns, SharedParameters, joint_columns, shared_parameters
from ident.estimation.all_joints.friction import OwnColumns, own_columns
from ident.estimation.homogeneous.weights import WEIGHTS
from ident.estimation.problem import Problem
from ident.numerics.least_squares import factors
from ident.support.arrays import Array, Indices
from ident.support.errors import NotIdentifiable, TooFewRows


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HomogeneousSystem:
    """`H @ x = k` with x = (g, theta, phi), the rows of a joint together; rows are weighted.

    Attributes:
        problem: Motions and payloads.
        shared: Which parameters joints share.
        columns: Rows of every joint, n.
        own: Own columns of every joint, n.
        H: Currents of each joint, -A of the shared parameters, -F of each joint, shape (r, u).
        k: Torque of the known payload parameters, shape (r,).
        weight: Of each row [1/(N m)], shape (r,).
        joint: Joint of each row, from 0, shape (r,).
    """

    problem: Problem
    shared: SharedParameters
    columns: tuple[JointColumns, ...]
    own: tuple[OwnColumns, ...]
    H: Array
    k: Array
    weight: Array
    joint: Indices

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.columns)

    def friction_at(self, joint: int) -> int:
        """Place of the first own column of a joint in H."""
        return self.n + self.shared.count + sum(each.F.shape[1] for each in self.own[:joint])


def homogeneous_system(problem: Problem, weights: str) -> HomogeneousSystem:
    """Stack the equations of a problem.

    Args:
        problem: Motions, bare and loaded.
        weights: A name in `WEIGHTS`.

    Raises:
        NotIdentifiable: If no motion is bare, none is loaded, or nothing that is known of a payload puts a torque on
            the arm that its own parameters cannot imitate.
        TooFewRows: If there are no more rows than unknowns.
    """
    problem.check_difference()
    shared = shared_parameters(problem)
    columns = joint_columns(problem, shared)
    own = tuple(own_columns(each, {}, per_motion=False) for each in columns)
    joint = np.repeat(np.arange(len(columns)), [len(each.V) for each in columns])
    n, p = len(columns), shared.count
    H = np.zeros((len(joint), n + p + sum(each.F.shape[1] for each in own)))
    if len(H) <= H.shape[1]:
        raise TooFewRows(f"{len(H)} rows cannot give {H.shape[1]} unknowns; record a longer motion")
    first = n + p
    for j, (each, F) in enumerate(zip(columns, own, strict=True)):
        rows = joint == j
        H[rows, j] = each.V
        H[rows, n : n + p] = -each.shared
        H[rows, first : first + F.F.shape[1]] = -F.F
        first += F.F.shape[1]
    k = np.concatenate([each.known for each in columns])
    _check_load(H[:, n:], k, problem.options.rank_tol)
    weight = WEIGHTS[weights](problem, columns)[joint]
    return HomogeneousSystem(
        problem=problem,
        shared=shared,
        columns=columns,
        own=own,
        H=H * weight[:, None],
        k=k * weight,
        weight=weight,
        joint=joint,
    )


def _check_load(W: Array, k: Array, rank_tol: float) -> None:
    """Refuse a known torque that the arm's own parameters explain: gains of zero would solve the equations."""
    Q = factors(W, rank_tol=rank_tol).Q
    if np.linalg.norm(k - Q @ (Q.T @ k)) <= rank_tol * np.linalg.norm(k):
        raise NotIdentifiable(
            "no known payload parameter has an independent torque on the arm; mount a payload of known mass"
        )
