"""Torques of the fitted arm at full rate, and the columns that follow from them."""

from dataclasses import dataclass

import numpy as np
import scipy

from ident.all_joints.columns import SharedParameters
from ident.arrays import Array, Indices
from ident.inverse_dynamics import inverse_dynamics
from ident.problem import Motion, Problem
from ident.structure import Structure

TORQUE_RATE = 8.0
"""Rate at which torques are evaluated, in cut-offs of the positions; splines lie between."""
SOFTENING = 1e-6
"""Compliance by which the derivative of torques is taken [rad / (N m)]: far below any real one."""


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
    states = behind.q[at], behind.dq[at], behind.ddq[at]
    rigid = scipy.interpolate.CubicSpline(t[at], inverse_dynamics(structure.arm, chi, *states))
    if not compliance:
        return Torques(rigid(t), np.zeros((0, structure.arm.n, structure.arm.n)))
    link = chi.copy()
    link[_rotors(structure)] = 0.0
    stiff = inverse_dynamics(structure.arm, link, *states)
    transmitted = scipy.interpolate.CubicSpline(t[at], stiff)
    change = np.stack([transmitted(t[at], order) for order in range(3)])  # (3, samples, n)
    softened = np.empty((len(at), structure.arm.n, structure.arm.n))
    for k in range(structure.arm.n):
        only = np.arange(structure.arm.n) == k
        moved = [x - SOFTENING * each * only for x, each in zip(states, change, strict=True)]
        softened[:, :, k] = (inverse_dynamics(structure.arm, link, *moved) - stiff) / SOFTENING
    return Torques(rigid(t), scipy.interpolate.CubicSpline(t[at], softened)(t))


def _rotors(structure: Structure) -> Indices:
    """Standard parameters that are inertias of rotors, those left out that hold inertia of links as well."""
    base = structure.base
    alone = np.count_nonzero(base.regrouping, axis=1) == 1
    return base.columns[alone & np.array([name.startswith("Ia") for name in base.names])]
