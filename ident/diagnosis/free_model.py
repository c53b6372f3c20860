"""The model for checks of logs: each joint alone, with unknown payloads and separate friction for each log.

The unknowns of joint j are its base parameters, common to all logs; friction and offset of each log; ten payload
parameters of every mounting but the first; and friction laws of real drives. It uses no gain and no specified payload,
so an error of these cannot be mistaken for a fault of the logs.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.diagnosis.evidence import BLOCKS, Fits, FreeFit, HeldOut, fits_of, free_fit, held_out, numbered_blocks
from ident.estimation.joint_by_joint import JointRows, joint_rows
from ident.estimation.problem import Problem
from ident.support.arrays import Array

COUPLED = ("Fvm", "Fcm")
"""Friction of motors that turn with two joints."""


@dataclass(frozen=True, slots=True, eq=False)
class FreeModel:
    """Free fits of all joints, prepared for held-out predictions.

    Attributes:
        problem: The observed logs; two mountings are two payload objects, even if equal.
        rows: Rows of each joint.
        fits: Each joint's fit; None where it has fewer rows than unknowns.
    """

    problem: Problem
    rows: tuple[JointRows, ...]
    fits: Fits


def free_model(problem: Problem, further: Sequence[Array | None] = ()) -> FreeModel:
    """Fit every joint of a problem freely.

    Args:
        problem: The observed logs.
        further: Further columns of each joint, n arrays of shape (r_j, m), or empty.
    """
    n = problem.structure.arm.n
    rows = tuple(joint_rows(problem, joint) for joint in range(n))
    lengths = row_counts(problem)
    more = further or (None,) * n
    fits = fits_of([_fitted(problem, *each, lengths) for each in zip(rows, more, strict=True)])
    return FreeModel(problem, rows, fits)


def row_counts(problem: Problem) -> list[int]:
    """Number of rows of each log, including those that joints omit."""
    return [
        1 + max((int(each.position[-1]) for each in motion.observation.joints if len(each.position)), default=0)
        for motion in problem.motions
    ]


def _fitted(problem: Problem, rows: JointRows, further: Array | None, lengths: Sequence[int]) -> HeldOut | None:
    W = free_columns(problem, rows)
    if further is not None:
        W = np.column_stack((W, further))
    if len(rows.V) <= W.shape[1]:
        return None
    block = numbered_blocks(rows.motion, rows.position, lengths)
    first = free_fit(W, rows.V, block, BLOCKS * len(lengths))
    drag = _load_friction(rows, first)
    return held_out(first if drag is None else free_fit(np.column_stack((W, drag)), rows.V, block, first.blocks))


def free_columns(problem: Problem, rows: JointRows) -> Array:
    """Columns of the model of a joint's currents, shape (r, p)."""
    own = [k for k, name in enumerate(rows.names) if name in _own(rows) or name.rstrip("0123456789") in COUPLED]
    later = [rows.W[:, own] * (rows.motion == log)[:, None] for log in range(1, len(problem.motions))]
    first = problem.motions[0].payload
    payloads = [W_L for W_L, payload in zip(rows.W_L, problem.payloads, strict=True) if payload is not first]
    return np.column_stack((rows.W, *later, *payloads, *_friction_laws(rows)))


def _own(rows: JointRows) -> tuple[str, ...]:
    return tuple(f"{name}{rows.joint + 1}" for name in ("Fv", "Fc", "off"))


def _friction_laws(rows: JointRows) -> list[Array]:
    """Friction that grows less than linearly with speed, and friction that differs between directions."""
    speed = _column(rows, "Fv")
    if speed is None:
        return []
    share = np.where(rows.weight > 0.0, rows.weight, 1.0)
    return [np.cbrt(speed / share) * share, np.abs(speed)]


def _load_friction(rows: JointRows, fit: FreeFit) -> Array | None:
    """Friction proportional to the motor torque, which is that of the fitted model."""
    direction = _column(rows, "Fc")
    return None if direction is None else np.abs(rows.V - fit.residual) * direction


def _column(rows: JointRows, name: str) -> Array | None:
    label = f"{name}{rows.joint + 1}"
    return rows.W[:, rows.names.index(label)] if label in rows.names else None
