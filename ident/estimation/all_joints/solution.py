"""From a problem to a solution: columns, reduction, start, search, and repetition with the estimated torques."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.estimation.all_joints.columns import JointColumns, SharedParameters, joint_columns, shared_parameters
from ident.estimation.all_joints.fit import AllJointsFit, fitted
from ident.estimation.all_joints.friction import OwnColumns, Term, own_columns
from ident.estimation.all_joints.reduction import base_of, reduced_joint
from ident.estimation.all_joints.search import Prior, search
from ident.estimation.all_joints.start import alone, start_of
from ident.estimation.estimate import GainSolution
from ident.estimation.problem import Problem
from ident.support.arrays import Array
from ident.support.errors import NotIdentifiable

Terms = Sequence[Mapping[str, Term]]
"""Further friction terms of each joint by name."""


GIVEN_STD = 1e-9
"""Prior standard deviation of the logarithm of a given gain: negligible."""


@dataclass(frozen=True, slots=True)
class GivenGain:
    """A known gain, which sets the scale of the others.

    Attributes:
        joint: Its joint, from 0.
        value: Joint torque per unit of current reference [N m / drive unit].
    """

    joint: int
    value: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Setting:
    """Common inputs of all fits of a problem.

    Attributes:
        problem: Motions and payloads.
        shared: The parameters that joints share.
        columns: Rows of every joint.
        alone: 1/g of the joints that determine it alone, zero for the others, shape (n,).
        per_motion: Whether viscous and Coulomb friction differ between motions.
        prior_std: Prior standard deviation of log|h| about the initial value.
        given: Known gains.
        shared_std: Prior standard deviation of each shared coefficient about zero, infinite without a prior, shape
            (p,).
    """

    problem: Problem
    shared: SharedParameters
    columns: tuple[JointColumns, ...]
    alone: Array
    per_motion: bool
    prior_std: float
    given: tuple[GivenGain, ...] = ()
    shared_std: Array

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.columns)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fitted:
    """A fit and its inputs.

    Attributes:
        columns: Rows of every joint; compliances of elastic joints are among the shared columns.
        own: Own columns of every joint.
        prior: Prior of log|h|.
        fit: The result.
    """

    columns: tuple[JointColumns, ...]
    own: tuple[OwnColumns, ...]
    prior: Prior
    fit: AllJointsFit


def setting(problem: Problem, *, per_motion: bool, prior_std: float, given: Sequence[GivenGain] = ()) -> Setting:
    """Prepare the fits of a problem.

    Raises:
        NotIdentifiable: If neither a known payload parameter nor a given gain sets the scale of the gains.
    """
    shared = shared_parameters(problem)
    if not shared.known.any() and not given:
        raise NotIdentifiable(
            "no motion carries a payload of known mass, so only ratios of gains are identifiable; mount "
            "one, or give one gain (options gain_joint and gain_value)"
        )
    columns = prepared(joint_columns(problem, shared), per_motion=per_motion)
    return Setting(
        problem=problem,
        shared=shared,
        columns=columns,
        alone=alone(problem),
        shared_std=np.full(columns[0].shared.shape[1], np.inf),
        per_motion=per_motion,
        prior_std=prior_std,
        given=tuple(given),
    )


def prepared(columns: Sequence[JointColumns], *, per_motion: bool) -> tuple[JointColumns, ...]:
    """Return the rows of every joint, factorised for fits with further columns."""
    own = [own_columns(each, {}, per_motion=per_motion) for each in columns]
    return tuple(replace(each, base=base_of(each, F)) for each, F in zip(columns, own, strict=True))


def widened(columns: Sequence[JointColumns], more: Sequence[Array]) -> tuple[JointColumns, ...]:
    """Return the rows of every joint with further shared columns, n arrays of shape (r_j, m)."""
    return tuple(replace(each, shared=np.hstack((each.shared, new))) for each, new in zip(columns, more, strict=True))


def fit_with(ready: Setting, terms: Terms, softened: Sequence[Array], before: Fitted | None) -> Fitted:
    """Fit the model with further terms.

    Args:
        ready: The problem.
        terms: Friction terms of each joint.
        softened: Change of each joint's torque per unit of each joint's compliance, empty for rigid joints.
        before: An earlier fit with initial values, or None.

    Raises:
        NotIdentifiable: If a joint has fewer rows than unknowns, or the search does not converge.
    """
    columns = widened(ready.columns, softened) if softened else ready.columns
    own = tuple(
        own_columns(each, dict(more), per_motion=ready.per_motion) for each, more in zip(columns, terms, strict=True)
    )
    joints = [reduced_joint(each, F) for each, F in zip(columns, own, strict=True)]
    given = {each.joint: 1.0 / each.value for each in ready.given}
    h = start_of(ready.alone, joints, own, given) if before is None else before.fit.found.h
    std = np.full(ready.n, ready.prior_std)
    std[list(given)] = GIVEN_STD

    shared_std = np.full(columns[0].shared.shape[1], np.inf)
    shared_std[: len(ready.shared_std)] = ready.shared_std

    def around(h: Array) -> Prior:
        return Prior(mean=np.log(np.abs(h)), std=std, shared=shared_std)

    first = search(joints, h, around(h))  # then the prior about them does not bias identifiable gains
    prior = around(first.h)
    found = search(joints, first.h, prior)
    fit = fitted(columns, joints, found, prior, ready.problem.row_period)
    return Fitted(columns=columns, own=own, prior=prior, fit=fit)


def fit_again(before: Fitted, currents: Sequence[Array]) -> Fitted:
    """Fit the same model to other currents, from the earlier solution.

    Args:
        before: The model and the initial values.
        currents: Currents of every joint's rows [drive units], n arrays of shape (r_j,).

    Raises:
        NotIdentifiable: If the search does not converge.
    """
    columns = tuple(replace(each, V=V) for each, V in zip(before.columns, currents, strict=True))
    joints = [reduced_joint(each, F) for each, F in zip(columns, before.own, strict=True)]
    found = search(joints, before.fit.found.h, before.prior)
    fit = fitted(columns, joints, found, before.prior, before.fit.row_period)
    return replace(before, columns=columns, fit=fit)


def solution(ready: Setting, final: Fitted, model: Array, softened: Sequence[Array] = ()) -> GainSolution:
    """Return the gains of a fit.

    Args:
        ready: The problem.
        final: The fit.
        model: Relative change of each gain per standard deviation of each model assumption, shape (n, m); the priors of
            the fit are added.
        softened: Change of the torque of each joint's rows at the largest compliance of real drives, n arrays of shape
            (r_j,); empty if not needed.
    """
    fit = final.fit
    n, h, rows = ready.n, fit.found.h, fit.rows
    friction, influence = np.zeros((n, 2)), np.zeros((n, 2, len(rows.V)))
    for j, (own, phi) in enumerate(zip(final.own, fit.phi, strict=True)):
        size = np.zeros((2, len(phi)))  # of both kinds of friction together, and of Coulomb friction
        for k, name in enumerate(own.names):
            if name in ("Fv", "Fc"):
                column = own.F[:, k]
                rms = float(np.sqrt(np.mean(column[column != 0.0] ** 2)))
                size[: 2 if name == "Fc" else 1, k] = rms / own.names.count(name)
        friction[j], influence[j] = size @ phi, fit.own_influence(j, size)
    payload = np.concatenate([each.payload for each in ready.columns], axis=1)  # (mountings, r, 10)
    spread = [W_L @ F for W_L, F in zip(payload, ready.shared.spread, strict=True)]
    stated = h[rows.joint][:, None] * np.hstack([np.zeros((len(rows.V), 0)), *spread])
    loaded = np.concatenate([each.payload.any(axis=(0, 2)) for each in ready.columns])
    known = np.concatenate([each.known for each in ready.columns])
    return GainSolution(
        rows=replace(rows, V=np.concatenate([each.V for each in ready.columns])),
        joints=np.arange(n),
        inverse=h,
        influence=h[:, None] * fit.log_influence,
        payload=fit.log_influence @ stated,
        model=np.hstack((fit.log_belief, model)),
        load_rms=np.array([_rms(known[loaded & (rows.joint == j)]) for j in range(n)]),
        friction=friction,
        friction_influence=influence,
        unsolved={},
        softened=np.concatenate([each * part for each, part in zip(h, softened, strict=True)]) if softened else None,
    )


def _rms(x: Array) -> float:
    """Root mean square, zero for an empty array."""
    return float(np.sqrt(np.mean(x**2))) if len(x) else 0.0
