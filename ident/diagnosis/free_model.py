"""The model that logs are doubted against: each joint alone, payloads unknown, friction of each log its own.

Joint j's currents are explained by its own base parameters, which all logs share; friction and offset of each log; ten
parameters of a payload in every log of another mounting than the first; and friction laws that real drives follow. It
knows no gain and no payload's description, so that nothing said of those can be mistaken for a fault of the logs.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.diagnosis.comparison import BLOCKS, Fits, FreeFit, HeldOut, fits_of, free_fit, held_out, numbered_blocks
from ident.estimation.joint_by_joint.gain_system import JointRows, joint_rows
from ident.estimation.problem import Problem
from ident.support.arrays import Array

COUPLED = ("Fvm", "Fcm")
"""Friction of motors that turn with two joints."""


@dataclass(frozen=True, slots=True, eq=False)
class FreeModel:
    """Free fits of all joints, ready for held-out predictions.

    Attributes:
        problem: The logs, observed; two mountings are two payload objects, whatever they say.
        rows: Of each joint.
        fits: Each joint's fit; None where it has fewer rows than unknowns.
    """

    problem: Problem
    rows: tuple[JointRows, ...]
    fits: Fits


def free_model(problem: Problem, further: Sequence[Array | None] = ()) -> FreeModel:
    """Fit every joint of a problem freely.

    Args:
        problem: The logs, observed.
        further: Columns of each joint that the model has besides, n arrays of shape (r_j, m); none if empty.
    """
    n = problem.structure.arm.n
    rows = tuple(joint_rows(problem, joint) for joint in range(n))
    lengths = row_counts(problem)
    more = further or (None,) * n
    fits = fits_of([_fitted(problem, *each, lengths) for each in zip(rows, more, strict=True)])
    return FreeModel(problem, rows, fits)


def row_counts(problem: Problem) -> list[int]:
    """Rows of each log, those that joints leave out counted."""
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
    """Columns that explain a joint's currents, shape (r, p)."""
    own = [k for k, name in enumerate(rows.names) if name in _own(rows) or name.rstrip("0123456789") in COUPLED]
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
