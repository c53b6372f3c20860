"""All joints at once, in torque units: unknowns are the gains and the arm's parameters; the known payload is given.

    V_j g_j - A_j theta - F_j phi_j = k_j

    V_j          currents of joint j [drive units]
    A_j, theta   columns and values of what joints share [SI]
    F_j, phi_j   columns of the joint's own friction and offset, and their values [N m, ...]
    k_j          torque of the known payload parameters [N m]

The currents, the only noisy part, are columns, so every method in this form is biased. This module has the weights of
the rows, the stacked equations, and the conversion of a solution to gains; the methods solve the equations.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ident.estimation.all_joints.columns import JointColumns, SharedParameters, joint_columns, shared_parameters
from ident.estimation.all_joints.friction import OwnColumns, own_columns
from ident.estimation.all_joints.reduction import reduced_joint
from ident.estimation.all_joints.start import alone, start_of
from ident.estimation.estimate import GainSolution
from ident.estimation.problem import Problem
from ident.estimation.rows import Rows
from ident.numerics.least_squares import factors
from ident.support.arrays import Array, Indices, Mask
from ident.support.errors import NotIdentifiable, TooFewRows
from ident.support.options import NAMES, unknown_name

UNSEEN = "its rows do not determine the gain"


def equal(problem: Problem, columns: Sequence[JointColumns]) -> Array:
    """Equal weights for all joints, shape (n,)."""
    return np.ones(len(columns))


def by_joint(problem: Problem, columns: Sequence[JointColumns]) -> Array:
    """Inverse standard deviation of each joint's residual in torque units, shape (n,).

    It is that of the joint's own least squares in current units, times the gain of eq. 27. With the residual of the
    homogeneous form, a gain of zero would give its joint an infinite weight.
    """
    own = [own_columns(each, {}, per_motion=False) for each in columns]
    joints = [reduced_joint(each, F) for each, F in zip(columns, own, strict=True)]
    sigma = np.array([each.sigma for each in joints])
    return np.abs(start_of(alone(problem), joints, own, {})) / sigma


WEIGHTS: dict[str, Callable[[Problem, Sequence[JointColumns]], Array]] = {"equal": equal, "joint": by_joint}


@dataclass(frozen=True, slots=True, kw_only=True)
class HomogeneousOptions:
    """Options of the methods in homogeneous form.

    Attributes:
        weights: Weighting of the joints' rows.
    """

    weights: str = field(default="joint", metadata={NAMES: WEIGHTS})

    def __post_init__(self) -> None:
        """Check the name; raises `OptionError`."""
        if self.weights not in WEIGHTS:
            raise unknown_name("weights", self.weights, WEIGHTS)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HomogeneousSystem:
    """`H @ x = k` with x = (g, theta, phi), the rows of a joint together; rows are weighted.

    Attributes:
        problem: Motions and payloads.
        shared: The parameters that joints share.
        columns: Rows of each of the n joints.
        own: Own columns of each of the n joints.
        H: Currents of each joint, -A of the shared parameters, -F of each joint, shape (r, u).
        k: Torque of the known payload parameters, shape (r,).
        weight: Weight of each row [1/(N m)], shape (r,).
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
        """Index of a joint's first own column in H."""
        return self.n + self.shared.count + sum(each.F.shape[1] for each in self.own[:joint])


def homogeneous_system(problem: Problem, weights: str) -> HomogeneousSystem:
    """Stack the equations of a problem.

    Raises:
        NotIdentifiable: If no motion is bare, none is loaded, or the torque of the known payload cannot be separated
            from that of the arm.
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
        raise TooFewRows.of(*H.shape)
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
    """Refuse a known torque in the column space of the arm: zero gains would solve the equations."""
    Q = factors(W, rank_tol=rank_tol).Q
    if np.linalg.norm(k - Q @ (Q.T @ k)) <= rank_tol * np.linalg.norm(k):
        raise NotIdentifiable(
            "the torque of the known payload cannot be separated from that of the arm; mount a payload of known mass"
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Unknowns:
    """A solution of the homogeneous equations.

    Attributes:
        x: Gains, shared parameters, own friction, shape (u,).
        by_current: Derivative of x by the current of each row, shape (u, r).
        by_load: Derivative of x by the known torque of each row [1/(N m)], shape (u, r).
        explained: Orthonormal basis of the column space, shape (r, e).
        seen: Mask of the gains that the equations determine, shape (n,).
    """

    x: Array
    by_current: Array
    by_load: Array
    explained: Array
    seen: Mask


def gain_solution(system: HomogeneousSystem, found: Unknowns) -> GainSolution:
    """Convert a solution to the output of an estimator: gains, residuals and influence."""
    solved = np.flatnonzero(found.seen)
    kept = found.seen[system.joint]
    g = found.x[: system.n]
    h = 1.0 / g[solved]
    influence = -(h**2)[:, None] * found.by_current[solved]
    stated = np.hstack(
        [
            np.concatenate([each.payload[which] for each in system.columns]) @ spread
            for which, spread in enumerate(system.shared.spread)
        ]
    )
    loaded = np.concatenate([each.payload.any(axis=(0, 2)) for each in system.columns])
    known = system.k / system.weight
    friction, by_current = _friction(system, found)
    friction_influence = h[:, None, None] * by_current[solved] + friction[solved][:, :, None] * influence[:, None, :]
    return GainSolution(
        rows=_rows(system, found),
        joints=solved,
        inverse=h,
        influence=influence[:, kept],
        payload=h[:, None] * (found.by_load[solved] @ stated),
        model=np.zeros((len(solved), 0)),
        load_rms=np.array([np.sqrt(np.mean(known[loaded & (system.joint == j)] ** 2)) for j in solved]),
        friction=h[:, None] * friction[solved],
        friction_influence=friction_influence[:, :, kept],
        unsolved={j: UNSEEN for j in np.flatnonzero(~found.seen).tolist()},
    )


def _friction(system: HomogeneousSystem, found: Unknowns) -> tuple[Array, Array]:
    """Total and Coulomb friction torque of each joint, shape (n, 2), and its derivative by the currents, (n, 2, r)."""
    friction, by_current = np.zeros((system.n, 2)), np.zeros((system.n, 2, len(system.k)))
    for j, own in enumerate(system.own):
        for k, name in enumerate(own.names):
            if name in ("Fv", "Fc"):
                size, at = float(np.sqrt(np.mean(own.F[:, k] ** 2))), system.friction_at(j) + k
                for which in (0, 1) if name == "Fc" else (0,):
                    friction[j, which] += size * found.x[at]
                    by_current[j, which] += size * found.by_current[at]
    return friction, by_current


def _rows(system: HomogeneousSystem, found: Unknowns) -> Rows:
    """Rows of the joints that have a gain, in current units.

    With a negative gain, residual and rows of `explained` change sign between torque and current.
    """
    kept = found.seen[system.joint]
    gain = found.x[system.joint[kept]]
    left = system.H[kept] @ found.x - system.k[kept]
    share = np.sum(found.explained**2, axis=1)
    return Rows(
        V=np.concatenate([each.V for each in system.columns])[kept],
        residual=left / (system.weight[kept] * gain),
        joint=system.joint[kept],
        motion=np.concatenate([each.motion for each in system.columns])[kept],
        position=np.concatenate([each.position for each in system.columns])[kept],
        row_period=system.problem.row_period,
        unknowns={j: float(share[system.joint == j].sum()) for j in np.flatnonzero(found.seen).tolist()},
        weight=np.abs(gain) * system.weight[kept],
        explained=found.explained[kept] * np.sign(gain)[:, None],
    )
