"""The model of all joints, linearised at the estimate: influence of each row's current on each unknown."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy import linalg

from ident.estimation.all_joints.columns import JointColumns
from ident.estimation.all_joints.reduction import ReducedJoint
from ident.estimation.all_joints.search import Found, Prior
from ident.estimation.rows import Rows
from ident.numerics.least_squares import factors
from ident.support.arrays import Array

RANK_TOL = 1e-10
"""Relative norm of the new part of a unit column below which its unknown is not identifiable."""


@dataclass(frozen=True, kw_only=True, eq=False)
class AllJointsFit:
    """The fitted model. Sensitivities of its unknowns log|h|, theta and phi are computed on demand.

    Attributes:
        found: Estimated gains and shared parameters.
        phi: Values of each joint's own columns [drive units], n arrays of shape (f_j,).
        columns: Rows of each of the n joints.
        joints: The same, reduced.
        left: Residuals in each joint's reduced rows, n arrays.
        prior: Prior of gains and shared parameters.
        row_period: Time from one row to the next [s].
    """

    found: Found
    phi: tuple[Array, ...]
    columns: tuple[JointColumns, ...]
    joints: tuple[ReducedJoint, ...]
    left: tuple[Array, ...]
    prior: Prior
    row_period: float

    @cached_property
    def rows(self) -> Rows:
        """Rows of all joints with their residuals."""
        lengths, explained = [len(each.V) for each in self.columns], self._linear[1]
        whole = np.zeros((sum(lengths), explained.shape[1]))
        hat = np.split(whole, np.cumsum(lengths)[:-1])
        for own, each, part in zip(hat, self.joints, self._parts, strict=True):
            felt = explained[part].any(axis=0)
            own[:, felt] = each.on_rows(explained[part, felt])
        return Rows(
            V=np.concatenate([each.V for each in self.columns]),
            residual=np.concatenate(
                [each.sigma * each.on_rows(left) for each, left in zip(self.joints, self.left, strict=True)]
            ),
            joint=np.repeat(np.arange(len(lengths)), lengths),
            motion=np.concatenate([each.motion for each in self.columns]),
            position=np.concatenate([each.position for each in self.columns]),
            row_period=self.row_period,
            unknowns={j: float(np.sum(own**2)) for j, own in enumerate(hat)},
            explained=whole,
            weight=np.repeat([1.0 / each.sigma for each in self.joints], lengths),
        )

    @cached_property
    def log_influence(self) -> Array:
        """Derivative of each log|h| by each row's current, shape (n, r)."""
        return self._by_rows(self._linear[0][self._places[0]])

    @cached_property
    def theta_influence(self) -> Array:
        """Derivative of each shared parameter by each row's current, zero if not identifiable, shape (p, r)."""
        return self._by_rows(self._linear[0][self._places[1]])

    @cached_property
    def phi_influence(self) -> tuple[Array, ...]:
        """Derivative of each joint's own parameters by each row's current, n arrays of shape (f_j, r)."""
        return tuple(self.own_influence(j, np.eye(len(phi))) for j, phi in enumerate(self.phi))

    def own_influence(self, joint: int, weights: Array) -> Array:
        """Derivative of weighted sums of a joint's own parameters by each row's current.

        Args:
            joint: The joint, from 0.
            weights: Of each of its own parameters, shape (k, f_j).

        Returns:
            Shape (k, r).
        """
        return self._by_rows(weights @ self._linear[0][self._places[2 + joint]])

    @cached_property
    def log_belief(self) -> Array:
        """Change of each log|h| per standard deviation of each prior, shape (n, beliefs).

        The priors are those of own parameters, of log|h| and of shared parameters, in this order.
        """
        return self._by_beliefs(self._places[0])

    @cached_property
    def theta_belief(self) -> Array:
        """The same for each shared parameter, shape (p, beliefs)."""
        return self._by_beliefs(self._places[1])

    @cached_property
    def phi_belief(self) -> tuple[Array, ...]:
        """The same for each joint's own parameters, n arrays of shape (f_j, beliefs)."""
        return tuple(self._by_beliefs(part) for part in self._places[2:])

    @property
    def _parts(self) -> list[slice]:
        """Rows of the Jacobian of each joint."""
        return [slice(*each) for each in pairwise(np.cumsum([0, *(len(each.V) for each in self.joints)]).tolist())]

    @property
    def _places(self) -> list[slice]:
        """Indices of log|h|, theta and each joint's phi among the unknowns."""
        n, p = len(self.joints), len(self.found.theta)
        return [slice(*each) for each in pairwise(np.cumsum([0, n, p, *map(len, self.phi)]).tolist())]

    @cached_property
    def _linear(self) -> tuple[Array, Array]:
        """Pseudo-inverse of the Jacobian of reduced rows and priors, and an orthonormal basis of its columns.

        Own columns are triangular in the first rows of their joint and zero in all others. The other rows give the
        solution for gains and shared parameters; the first rows then give phi.
        """
        parts, (_, _, *own) = self._parts, self._places
        n, first, last = len(parts), own[0].start, parts[-1].stop
        J = np.zeros((last + n + len(self.prior.rows), first))
        inner = np.ones(len(J), np.bool_)
        for j, (each, rows, phi) in enumerate(zip(self.joints, parts, self.phi, strict=True)):
            h = self.found.h[j]
            J[rows, j] = h * (each.A @ self.found.theta + each.k)
            J[rows, n:] = h * each.A
            inner[rows.start : rows.start + len(phi)] = False
        J[last + np.arange(n), np.arange(n)] = 1.0 / self.prior.std
        J[last + n :, n:] = self.prior.rows
        solved = factors(J[inner], rank_tol=RANK_TOL)
        pseudo, Q = np.zeros((own[-1].stop, len(J))), np.zeros((len(J), own[-1].stop - first + solved.Q.shape[1]))
        pseudo[np.ix_(solved.columns, inner)] = linalg.solve_triangular(solved.R, solved.Q.T, check_finite=False)
        for each, rows, phi in zip(self.joints, parts, own, strict=True):
            f = phi.stop - phi.start
            top = slice(rows.start, rows.start + f)
            given = -J[top] @ pseudo[:first]
            given[:, top] += np.eye(f)
            pseudo[phi] = linalg.solve_triangular(each.F[:f], given, check_finite=False)
            Q[top, phi.start - first : phi.stop - first] = np.eye(f)
        Q[inner, own[-1].stop - first :] = solved.Q
        return pseudo, Q

    def _by_rows(self, spread: Array) -> Array:
        each = zip(self.joints, self._parts, strict=True)
        return np.hstack([joint.on_rows(spread[:, part].T).T / joint.sigma for joint, part in each])

    def _by_beliefs(self, unknowns: slice) -> Array:
        spread, parts = self._linear[0][unknowns], self._parts
        own = [spread[:, part] @ joint.beliefs.T for joint, part in zip(self.joints, parts, strict=True)]
        return np.hstack([*own, spread[:, parts[-1].stop :]])


def fitted(
    columns: Sequence[JointColumns], joints: Sequence[ReducedJoint], found: Found, prior: Prior, row_period: float
) -> AllJointsFit:
    """Return the model at the end of the search."""
    phi, lefts = list[Array](), list[Array]()
    for each, h in zip(joints, found.h, strict=True):
        f = each.F.shape[1]
        left = each.V - h * (each.A @ found.theta + each.k)
        phi.append(linalg.solve_triangular(each.F[:f], left[:f], check_finite=False))
        lefts.append(left - each.F @ phi[-1])
    return AllJointsFit(
        found=found,
        phi=tuple(phi),
        columns=tuple(columns),
        joints=tuple(joints),
        left=tuple(lefts),
        prior=prior,
        row_period=row_period,
    )
