"""Torques of the fitted arm at full rate, and the columns that follow from them."""

from dataclasses import dataclass

import numpy as np
import scipy

from ident.all_joints.columns import SharedParameters
from ident.all_joints.displacement import States, displaced_torques
from ident.arrays import Array, Indices
from ident.inverse_dynamics import drive_torques, inverse_dynamics
from ident.problem import Motion, Problem
from ident.structure import Structure

TORQUE_RATE = 8.0
"""Rate at which torques are evaluated, in cut-offs of the positions; splines lie between."""


@dataclass(frozen=True, slots=True, eq=False)
class Torques:
    """Torques of an arm along a motion.

    Attributes:
        rigid: Torque of everything but friction and offset at full rate [N m], shape (N, n).
        softened: Its change on each joint per unit of each joint's compliance [N m / (rad / (N m))], shape (N, n, n),
            joint before compliance.
    """

    rigid: Array
    softened: Array


def torques(problem: Problem, motion: Motion, shared: SharedParameters, theta: Array, *, compliance: bool) -> Torques:
    """Torques of the fitted arm along a motion.

    A compliant joint's link is behind its motor, where the encoder sits, by the torque that it transmits times the
    compliance C; so are its velocity and acceleration. The rotor is not, where its inertia is told from its link's.

    Args:
        problem: Motions and payloads.
        motion: One of them, from a recording.
        shared: Which parameters joints share.
        theta: Their values, shape (p,).
        compliance: Whether `softened` is wanted; else it is empty.
    """
    behind, structure = motion.observation.full_rate, problem.structure
    assert behind is not None, "an observation of a recording has its full rate"
    chi = np.zeros(structure.base.regrouping.shape[1])
    chi[structure.base.columns[shared.arm]] = theta[: len(shared.arm)]
    for mounted, values in zip(problem.payloads, shared.payload_values(theta), strict=True):
        if motion.payload is mounted:
            chi[structure.payload_columns] += values
    stride = max(1, int(1.0 / (TORQUE_RATE * behind.cutoff_hz * behind.period)))
    t = np.arange(len(behind.q)) * behind.period
    at = np.append(np.arange(0, len(t) - 1, stride), len(t) - 1)
    states = States(behind.q[at], behind.dq[at], behind.ddq[at])
    torque = inverse_dynamics(structure.arm, chi, states.q, states.dq, states.ddq)
    rigid = scipy.interpolate.CubicSpline(t[at], torque)(t)
    if not compliance:
        return Torques(rigid, np.zeros((0, structure.arm.n, structure.arm.n)))
    rotors = np.zeros_like(chi)
    rotors[_rotors(structure)] = chi[_rotors(structure)]
    transmitted = scipy.interpolate.CubicSpline(
        t[at], torque - drive_torques(structure.arm, rotors, states.dq, states.ddq)
    )
    behind_motor = States(*(-transmitted(t[at], order) for order in range(3)))
    softened = displaced_torques(structure.arm, chi - rotors, states, behind_motor)
    return Torques(rigid, scipy.interpolate.CubicSpline(t[at], softened)(t))


def _rotors(structure: Structure) -> Indices:
    """Standard parameters that are inertias of rotors, those left out that hold inertia of links as well."""
    base = structure.base
    alone = np.count_nonzero(base.regrouping, axis=1) == 1
    return base.columns[alone & np.array([name.startswith("Ia") for name in base.names])]
