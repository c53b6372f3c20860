"""The mass of a payload from each joint alone, which shows which gain is wrong.

The system has the joint's rows, its friction columns from the fit of all joints, and the column of the torque per
kilogram of the payload; all other columns are free. A relative error of the gain is the same relative error of the
mass.
"""

from dataclasses import dataclass

import numpy as np

from ident.estimation.all_joints.columns import JointColumns
from ident.estimation.all_joints.friction import OwnColumns
from ident.estimation.all_joints.solution import Fitted, Setting
from ident.estimation.known_gains import KnownGains
from ident.estimation.rows import Rows
from ident.estimation.uncertainty import UNCERTAINTIES
from ident.numerics.least_squares import factors
from ident.payload.payload import KnownPayload, Payload
from ident.payload_identification.payload_body import Quantity
from ident.payload_identification.payload_estimate import FoundPayload
from ident.support.arrays import Array

DEPENDENT = 1e-9
"""Relative norm of the independent part of a unit column below which it is dependent."""
NEW = 1e-6
"""Least independent part of the unit column of the mass."""
WEAK = 0.25
"""Relative standard deviation above which a joint's estimate of the mass is inconclusive."""


@dataclass(frozen=True, slots=True)
class NoMass:
    """A joint that does not identify the mass alone, with the reason."""

    reason: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Solved:
    """Mass from one joint, its derivative with respect to each row's current, and the rows."""

    mass: float
    influence: Array
    rows: Rows
    belief: float


def masses_alone(found: FoundPayload, payload: Payload, gains: KnownGains) -> tuple[Quantity | NoMass, ...]:
    """Return the mass from each joint alone [kg], one result per joint.

    Args:
        found: The payload estimated from all joints, with the model.
        payload: The specified payload, whose known shape is used.
        gains: The gains.
    """
    n = found.ready.n
    results: list[Quantity | NoMass] = [NoMass("its gain is not known")] * n
    for j, gain, variance in zip(gains.joints.tolist(), gains.value, np.diag(gains.log_covariance), strict=True):
        results[j] = _of_joint(found, payload, j, float(gain), float(np.sqrt(variance)))
    return tuple(results)


def _of_joint(found: FoundPayload, payload: Payload, j: int, gain: float, rel_std: float) -> Quantity | NoMass:
    known, problem = payload.known_part(), found.ready.problem
    solved = _solved(found.ready, found.selected.final, j, gain, known)
    if solved is None:
        return NoMass("the torque of the mass on this joint cannot be separated from that of the arm")
    options = problem.options
    variance = UNCERTAINTIES[options.uncertainty](solved.rows, solved.influence[None])
    shares = [solved.belief]
    for each in found.selected.rivals:
        one, other = (_solved(found.ready, fitted, j, gain, known) for fitted in (each.final, each.other))
        if one is not None and other is not None:
            shares.append(each.share * (other.mass - one.mass))
    spread = known.spread[:, 1:] if len(known.names) > 1 else np.zeros((10, 0))  # of the shape; the mass is estimated
    stated = found.ready.columns[j].payload[0] @ spread
    shares += (solved.influence @ stated / gain).tolist()
    quantity = Quantity(
        name="mass",
        unit="kg",
        value=solved.mass,
        residual_std=float(np.sqrt(variance[0, 0])),
        gain_std=rel_std * abs(solved.mass),
        model_std=float(np.linalg.norm(shares)),
    )
    if quantity.std > WEAK * payload.mass:
        return NoMass(f"its estimate of the mass has a standard deviation of {quantity.std:.2g} kg")
    return quantity


def _solved(ready: Setting, fitted: Fitted, j: int, gain: float, known: KnownPayload) -> _Solved | None:
    """Solve the least squares of one joint's rows; the column of the mass is last."""
    columns, own = fitted.columns[j], fitted.own[j]
    W_L = columns.payload[0]
    mass = known.chi[9]
    kilogram = W_L[:, known.mask] @ known.chi[known.mask] / (mass * gain)
    others = _others(ready, columns, own, known)
    believed = own.believed
    beliefs = np.zeros((int(believed.sum()), others.shape[1]))
    beliefs[np.arange(len(beliefs)), np.flatnonzero(believed)] = 1.0 / own.std[believed]
    weight = fitted.fit.rows.weight[fitted.fit.rows.of(j)]
    W = np.vstack((others * weight[:, None], beliefs))
    column = np.concatenate((kilogram * weight, np.zeros(len(beliefs))))
    Y = np.concatenate((columns.V * weight, (own.mean / own.std)[believed]))
    basis = factors(W, rank_tol=DEPENDENT).Q
    left = column - basis @ (basis.T @ column)
    if np.linalg.norm(left) <= NEW * np.linalg.norm(column):
        return None
    pseudo = left / float(left @ column)
    found, size = float(pseudo @ Y), len(columns.V)
    explained = np.column_stack((basis, left / np.linalg.norm(left)))
    rest = Y - explained @ (explained.T @ Y)
    rows = Rows(
        V=columns.V,
        residual=rest[:size] / weight,
        joint=np.full(size, j, dtype=np.intp),
        motion=columns.motion,
        position=columns.position,
        row_period=ready.problem.row_period,
        unknowns={j: float(np.sum(explained[:size] ** 2))},
        weight=weight,
        explained=explained[:size],
    )
    return _Solved(mass=found, influence=pseudo[:size] * weight, rows=rows, belief=float(np.linalg.norm(pseudo[size:])))


def _others(ready: Setting, columns: JointColumns, own: OwnColumns, known: KnownPayload) -> Array:
    """Return a joint's columns except that of the mass: own, the arm's, the payload's unknown ones, compliance.

    Shared columns are the arm's, then the unknown ones of the payload, then compliance.
    """
    arm = len(ready.shared.arm)
    yielding = columns.shared[:, arm + len(ready.shared.free[0]) :]
    return np.hstack((own.F, columns.shared[:, :arm], columns.payload[0][:, ~known.mask], yielding))
