"""The model for checks of logs: each joint alone, with unknown payloads and separate friction for each log.

The unknowns of joint j are its base parameters, common to all logs; friction and offset of each log; ten payload
parameters of every mounting but the first; and friction laws of real drives. It uses no gain and no specified payload,
so an error of these cannot be mistaken for a fault of the logs.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.diagnosis.evidence import BLOCKS, Fits, HeldOut, fits_of, free_fit, held_out, numbered_blocks
from ident.estimation.problem import Problem
from ident.estimation.rows import OWN, Columns, joint_rows
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
    rows: tuple[Columns, ...]
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


def _fitted(problem: Problem, rows: Columns, further: Array | None, lengths: Sequence[int]) -> HeldOut | None:
    W = free_columns(problem, rows)
    if further is not None:
        W = np.column_stack((W, further))
    if len(rows.V) <= W.shape[1]:
        return None
    block = numbered_blocks(rows.motion, rows.position, lengths)
    first = free_fit(W, rows.V, block, BLOCKS * len(lengths))
    dry = rows.own("Fc")
    if not dry.any():
        return held_out(first)
    loaded = np.abs(rows.V - first.residual) * dry  # friction proportional to the motor torque of the fitted model
    return held_out(free_fit(np.column_stack((W, loaded)), rows.V, block, first.blocks))


def free_columns(problem: Problem, rows: Columns) -> Array:
    """Columns of the model of a joint's currents, shape (r, p)."""
    drifting = rows.of_parameter(*OWN, *COUPLED)
    later = [rows.W[:, drifting] * (rows.motion == log)[:, None] for log in range(1, len(problem.motions))]
    first = problem.motions[0].payload
    payloads = [W_L for W_L, payload in zip(rows.W_L, problem.payloads, strict=True) if payload is not first]
    laws, speed = list[Array](), rows.own("Fv")
    if speed.any():  # friction that grows less than linearly with speed, or differs between directions
        share = np.where(rows.weight > 0.0, rows.weight, 1.0)
        laws = [np.cbrt(speed / share) * share, np.abs(speed)]
    return np.column_stack((rows.W, *later, *payloads, *laws))
