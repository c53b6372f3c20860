"""Terms that follow from speed and from the torques of an earlier fit: friction laws, compliance."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.all_joints.columns import SharedParameters
from ident.all_joints.fit import AllJointsFit
from ident.all_joints.friction import OwnColumns
from ident.all_joints.torques import Torques, torques
from ident.arrays import Array
from ident.full_rate import FullRate
from ident.problem import Problem

LOAD_FORMS = ("load-motor", "load")
"""Friction in proportion to the torque that a motor gives, or to the one that links and payload ask for."""


@dataclass(frozen=True, slots=True, eq=False)
class TermColumns:
    """Columns of every joint by name.

    Attributes:
        own: Friction terms, n dicts of columns of shape (r_j,). Those of `LOAD_FORMS` have coefficients without unit.
        softened: Change of torque per unit of each joint's compliance, n arrays of shape (r_j, n), empty if not asked.
    """

    own: tuple[dict[str, Array], ...]
    softened: tuple[Array, ...]


def speed_terms(problem: Problem) -> TermColumns:
    """The cube root of the speed, for viscous friction that grows less than the speed."""
    parts = [
        [
            behind.decimated(np.cbrt(behind.dq[:, j]), j)[motion.observation.joints[j].position]
            for motion in problem.motions
            if (behind := motion.observation.full_rate) is not None
        ]
        for j in range(problem.structure.arm.n)
    ]
    return TermColumns(tuple({"cbrt": np.concatenate(each)} for each in parts), ())


def torque_terms(
    problem: Problem, shared: SharedParameters, own: Sequence[OwnColumns], fit: AllJointsFit, *, compliance: bool
) -> TermColumns:
    """Friction in proportion to torque, both forms, and what compliance does to the torques.

    Args:
        problem: Motions from recordings.
        shared: Which parameters joints share.
        own: Own columns of the earlier fit.
        fit: The earlier fit.
        compliance: Whether to take the derivative by the compliance of each joint.
    """
    n = problem.structure.arm.n
    columns: list[dict[str, list[Array]]] = [{name: [] for name in LOAD_FORMS} for _ in range(n)]
    softened: list[list[Array]] = [[] for _ in range(n)]
    for number, motion in enumerate(problem.motions):
        behind = motion.observation.full_rate
        assert behind is not None, "asked of recordings only"
        found = torques(problem, motion, shared, fit.found.theta, compliance=compliance)
        for j in range(n):
            kept = motion.observation.joints[j].position
            turns = np.sign(behind.dq[:, j])
            needed = fit.found.h[j] * found.rigid[:, j]
            given = needed + _braking(behind, own[j], fit.phi[j], j, number)
            for name, current in zip(LOAD_FORMS, (given, needed), strict=True):
                columns[j][name].append(behind.decimated(np.abs(current) * turns, j)[kept])
            if compliance:
                softened[j].append(_softened(behind, found, j)[kept])
    return TermColumns(
        tuple({name: np.concatenate(parts) for name, parts in each.items()} for each in columns),
        tuple(np.vstack(each) for each in softened) if compliance else (),
    )


def _braking(behind: FullRate, own: OwnColumns, phi: Array, joint: int, motion: int) -> Array:
    """Current against viscous and Coulomb friction at full rate, shape (N,)."""
    dq = behind.dq[:, joint]
    signals = {"Fv": dq, "Fc": np.sign(dq), "cbrt": np.cbrt(dq)}
    total = np.zeros_like(dq)
    for name, which, value in zip(own.names, own.motion, phi, strict=True):
        if name in signals and which in (-1, motion):
            total += value * signals[name]
    return total


def _softened(behind: FullRate, found: Torques, joint: int) -> Array:
    """Decimated change of a joint's torque per compliance of each joint, shape (rows, n)."""
    return np.column_stack([behind.decimated(column, joint) for column in found.softened[:, joint].T])
