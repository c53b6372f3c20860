"""The model that logs are doubted against: every joint alone, nothing believed of payloads, friction of each log its own.

Joint j's currents are explained by its own base parameters, which all logs share; friction and offset of each log; ten
parameters of a payload in every log of another mounting than the first; and friction laws that real drives follow. It
knows no gain and no payload's description, so that nothing said of those can be mistaken for a fault of the logs.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.arrays import Array, Indices
from ident.diagnosis.comparison import (
    BLOCKS,
    FreeFit,
    HeldOut,
    Score,
    free_fit,
    held_out,
    numbered_blocks,
)
from ident.gain_system import JointRows, joint_rows
from ident.problem import Problem


@dataclass(frozen=True, slots=True, eq=False)
class FreeModel:
    """Free fits of all joints, ready for held-out predictions.

    Attributes:
        problem: The logs, observed; two mountings are two payload objects, whatever they say.
        rows: Of each joint.
        joints: Each joint's fit; None where it has fewer rows than unknowns.
        score: How well each joint's currents are predicted.
    """

    problem: Problem
    rows: tuple[JointRows, ...]
    joints: tuple[HeldOut | None, ...]
    score: Score

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.rows)

    @property
    def logs(self) -> int:
        """Number of logs."""
        return len(self.problem.motions)

    @property
    def sigma(self) -> Array:
        """Standard deviation of each joint's held-out residuals [drive units], shape (n,)."""
        return np.sqrt(self.score.variance)


def free_model(problem: Problem) -> FreeModel:
    """Fit every joint of a problem freely."""
    n, logs = problem.structure.arm.n, len(problem.motions)
    rows = tuple(joint_rows(problem, joint) for joint in range(n))
    lengths = [
        1 + max((int(each.position[-1]) for each in motion.observation.joints if len(each.position)), default=0)
        for motion in problem.motions
    ]
    joints = tuple(_fitted(problem, each, lengths) for each in rows)
    squares, many = np.zeros((n, BLOCKS * logs)), np.zeros(n)
    for j, each in enumerate(joints):
        if each is not None:
            squares[j] = np.sum(each.predicted(each.fit.residual[:, None]) ** 2, axis=(1, 2))
            many[j] = len(each.fit.V)
    return FreeModel(problem, rows, joints, Score(squares, many))


def _fitted(problem: Problem, rows: JointRows, lengths: Sequence[int]) -> HeldOut | None:
    W = free_columns(problem, rows)
    if len(rows.V) <= W.shape[1]:
        return None
    block = numbered_blocks(rows.motion, rows.position, lengths)
    first = free_fit(W, rows.V, block, BLOCKS * len(lengths))
    drag = _load_friction(rows, first)
    return held_out(first if drag is None else free_fit(np.column_stack((W, drag)), rows.V, block, first.blocks))


def free_columns(problem: Problem, rows: JointRows) -> Array:
    """Columns that explain a joint's currents, shape (r, p)."""
    own = [rows.names.index(name) for name in _own(rows) if name in rows.names]
    later = [rows.W[:, own] * (rows.motion == log)[:, None] for log in range(1, len(problem.motions))]
    first = problem.motions[0].payload
    payloads = [W_L for W_L, payload in zip(rows.W_L, problem.payloads, strict=True) if payload is not first]
    return np.column_stack((rows.W, *later, *payloads, *_friction_laws(rows)))


def _own(rows: JointRows) -> tuple[str, ...]:
    return tuple(f"{name}{rows.joint + 1}" for name in ("Fv", "Fc", "off"))


def _friction_laws(rows: JointRows) -> list[Array]:
    """Friction that grows less than the speed, and that differs between directions."""
    speed = _column(rows, "Fv")
    if speed is None:
        return []
    share = np.where(rows.weight > 0.0, rows.weight, 1.0)
    return [np.cbrt(speed / share) * share, np.abs(speed)]


def _load_friction(rows: JointRows, fit: FreeFit) -> Array | None:
    """Friction in proportion to the motor's torque, which the model itself gives."""
    direction = _column(rows, "Fc")
    return None if direction is None else np.abs(rows.V - fit.residual) * direction


def _column(rows: JointRows, name: str) -> Array | None:
    label = f"{name}{rows.joint + 1}"
    return rows.W[:, rows.names.index(label)] if label in rows.names else None


@dataclass(frozen=True, slots=True, eq=False)
class Added:
    """What further columns, one coefficient each for all joints, add to the held-out predictions.

    Attributes:
        u: Gain of each block, shape (blocks,).
        value: Coefficients, shape (m,).
        covariance: Of them, for residuals that are autocorrelated within blocks, shape (m, m).
    """

    u: Array
    value: Array
    covariance: Array


def added(model: FreeModel, columns: Sequence[Array | None]) -> Added | None:
    """Add columns to the model of all joints.

    Args:
        model: The free fits.
        columns: Of each joint, shape (r, m), None where they are zero.

    Returns:
        None if the model knows all that the columns say.
    """
    felt = [
        (each, columns[j] / model.sigma[j], j)
        for j, each in enumerate(model.joints)
        if each is not None and columns[j] is not None and model.sigma[j] > 0.0
    ]
    if not felt:
        return None
    m = felt[0][1].shape[1]
    size = np.sqrt(sum(np.sum(c**2, axis=0) for _, c, _ in felt))
    if not (size > 0.0).all():
        return None
    parts = [(each, each.fit.without(c / size), each.fit.residual / model.sigma[j], j) for each, c, j in felt]
    S = sum((left.T @ left for _, left, _, _ in parts), np.zeros((m, m)))
    values, directions = np.linalg.eigh(S)
    if values[0] < UNSEEN:
        return None
    turn = directions / np.sqrt(values)
    b = sum((turn.T @ (left.T @ e) for _, left, e, _ in parts), np.zeros(m))
    blocks = len(model.score.squares[0])
    G, r, held = np.zeros((blocks, m, m)), np.zeros((blocks, m)), list[tuple[Array, Array]]()
    scores = np.zeros((blocks, m))
    for each, left, e, _ in parts:
        q = left @ turn
        rest = e - q @ b
        both = each.predicted(np.column_stack((rest, q)))
        padded = each.padded(np.column_stack((rest, q)))
        G += padded[..., 1:].swapaxes(1, 2) @ both[..., 1:]
        r += np.einsum("bmk,bm->bk", padded[..., 1:], both[..., 0])
        scores += np.einsum("bmk,bm->bk", padded[..., 1:], padded[..., 0])
        held.append((both[..., 0], both[..., 1:]))
    t = np.linalg.solve(np.eye(m) - G, r[..., None])[..., 0]
    u = np.zeros(blocks)
    for (_, _, _, j), (rest, q) in zip(parts, held, strict=True):
        squares = np.sum((rest + np.einsum("bmk,bk->bm", q, t)) ** 2, axis=1)
        u += 0.5 * (model.score.squares[j] / model.sigma[j] ** 2 - squares)
    own = np.eye(m) + scores.T @ scores
    spread = turn / size[:, None]
    return Added(u=u, value=spread @ b, covariance=spread @ own @ spread.T)


UNSEEN = 1e-7
"""Square of a unit column that the model must leave for it to be compared."""


def regrouped(score: Score, order: Indices, unit: Array) -> Score:
    """A score of logs whose currents were read in another order and unit, by the columns and in the units of the logs.

    Args:
        score: Of the logs as they were read.
        order: Column of the current of each joint, shape (n,).
        unit: What each joint's currents were divided by in each block, shape (n, blocks).
    """
    back = np.argsort(order)
    return replace(score, squares=(score.squares * unit**2)[back], rows=score.rows[back])
