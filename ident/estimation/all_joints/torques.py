"""Torques of the fitted arm at full rate, and the columns that follow from them."""

from dataclasses import dataclass

import numpy as np

from ident.estimation.all_joints.columns import SharedParameters
from ident.estimation.all_joints.displacement import States, displaced_torques
from ident.estimation.problem import ObservedMotion, Problem
from ident.model.arm import Arm
from ident.model.inverse_dynamics import drive_torques, inverse_dynamics
from ident.model.parameters import STANDARD
from ident.model.structure import Structure
from ident.numerics.splines import spline
from ident.support.arrays import Array, Indices

TORQUE_RATE = 8.0
"""Rate at which torques are evaluated, in cut-offs of the positions; splines lie between."""
ROTOR_SHARE = 0.5
"""Share of a rotor in a joint's inertia where the two cannot be told apart, assumed: gears match rotor and load."""
STATES = 16
"""Positions along a motion that inertia is a mean over."""


@dataclass(frozen=True, slots=True, eq=False)
class Torques:
    """Torques of an arm along a motion.

    Attributes:
        rigid: Torque of everything but friction and offset at full rate [N m], shape (N, n).
        softened: Its change on each joint per unit of each joint's compliance [N m / (rad / (N m))], shape (N, n, n),
            joint before compliance.
        inertia: Mean squares of the inertia matrix of what moves with the links, shape (n, n); empty without
            `softened`.
    """

    rigid: Array
    softened: Array
    inertia: Array


def torques(
    problem: Problem, motion: ObservedMotion, shared: SharedParameters, theta: Array, *, compliance: bool
) -> Torques:
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
    structure = problem.structure
    chi = fitted_parameters(problem, motion, shared, theta)
    t, at, states = sampled_states(motion)
    torque = inverse_dynamics(structure.arm, chi, states.q, states.dq, states.ddq)
    rigid = spline(t[at], torque)(t)
    if not compliance:
        return Torques(rigid, np.zeros((0, structure.arm.n, structure.arm.n)), np.zeros((0, 0)))
    links = chi - _of_rotors(structure, chi)
    inertia = np.mean(inertia_matrices(structure.arm, links, states.q) ** 2, axis=0)
    return Torques(rigid, _softened(structure.arm, motion, links, chi - links, torque), inertia)


def softened_by(
    problem: Problem, motion: ObservedMotion, shared: SharedParameters, theta: Array, torque: Array
) -> Array:
    """Change of each joint's torque per unit of each joint's compliance, where what drives give is known.

    Args:
        problem: Motions and payloads.
        motion: One of them, from a recording.
        shared: Which parameters joints share.
        theta: Their values, shape (p,).
        torque: What drives give beside friction, at full rate [N m], shape (N, n).

    Returns:
        [N m / (rad / (N m))], shape (N, n, n), joint before compliance.
    """
    chi = fitted_parameters(problem, motion, shared, theta)
    rotors = _of_rotors(problem.structure, chi)
    return _softened(problem.structure.arm, motion, chi - rotors, rotors, torque[sampled_states(motion)[1]])


def _softened(arm: Arm, motion: ObservedMotion, links: Array, rotors: Array, torque: Array) -> Array:
    """Change of torques at full rate, shape (N, n, n), from parameters of links and of rotors, and sampled torques."""
    t, at, states = sampled_states(motion)
    transmitted = spline(t[at], torque - drive_torques(arm, rotors, states.dq, states.ddq))
    behind_motor = States(*(-transmitted(t[at], order) for order in range(3)))
    return spline(t[at], displaced_torques(arm, links, states, behind_motor))(t)


def fitted_parameters(problem: Problem, motion: ObservedMotion, shared: SharedParameters, theta: Array) -> Array:
    """Standard parameters of the fitted arm with what a motion carries, own friction and offsets left out.

    Args:
        problem: Motions and payloads.
        motion: One of them.
        shared: Which parameters joints share.
        theta: Their values, shape (p,).

    Returns:
        Names as in `parameters.labels`, shape (14 n + 3 c,).
    """
    structure = problem.structure
    chi = np.zeros(structure.base.regrouping.shape[1])
    chi[structure.base.columns[shared.arm]] = theta[: len(shared.arm)]
    for mounted, values in zip(problem.payloads, shared.payload_values(theta), strict=True):
        if motion.payload is mounted:
            chi[structure.payload_columns] += values
    return chi


def sampled_states(motion: ObservedMotion) -> tuple[Array, Indices, States]:
    """Times of a motion at full rate [s], shape (N,); those at which torques are evaluated, and the states there."""
    behind = motion.observation.full_rate
    assert behind is not None, "an observation of a recording has its full rate"
    stride = max(1, int(1.0 / (TORQUE_RATE * behind.cutoff_hz * behind.period)))
    t = behind.period * np.arange(len(behind.q), dtype=np.float64)
    at = np.append(np.arange(0, len(t) - 1, stride), len(t) - 1)
    return t, at, States(behind.q[at], behind.dq[at], behind.ddq[at])


def inertia_matrices(arm: Arm, chi: Array, q: Array) -> Array:
    """Inertia matrices at some positions along a motion.

    Args:
        arm: The arm, n joints.
        chi: Standard parameters; names as in `parameters.labels`.
        q: Positions of a motion, shape (N, n).

    Returns:
        [kg m^2, kg m or kg], shape (STATES, n, n).
    """
    q = q[np.linspace(0, len(q) - 1, STATES).astype(np.intp)]
    ddq = np.tile(np.vstack((np.zeros(arm.n), np.eye(arm.n))), (STATES, 1))
    states = np.repeat(q, arm.n + 1, axis=0)
    torque = inverse_dynamics(arm, chi, states, np.zeros_like(states), ddq).reshape(STATES, arm.n + 1, arm.n)
    return (torque[:, 1:] - torque[:, :1]).swapaxes(1, 2)


def rotor_inertia(problem: Problem, shared: SharedParameters, theta: Array, *, least: float = 0.0) -> Array:
    """Inertia of each rotor on the joint's side [kg m^2] or [kg], as found or, not told from links, as assumed, (n,).

    Args:
        problem: Motions from recordings.
        shared: Which parameters joints share.
        theta: Their values, shape (p,).
        least: Share of a rotor in its joint's inertia below which one that is found counts as an error of the fit.
    """
    structure, behind = problem.structure, problem.motions[0].observation.full_rate
    assert behind is not None, "asked of recordings only"
    chi = np.zeros(structure.base.regrouping.shape[1])
    chi[structure.base.columns[shared.arm]] = theta[: len(shared.arm)]
    whole = np.mean(np.einsum("sjj->sj", inertia_matrices(structure.arm, chi, behind.q)), axis=0)
    places = len(STANDARD) * np.arange(structure.arm.n) + STANDARD.index("Ia")
    told = np.isin(places, _rotors(structure))
    return np.where(told, np.maximum(chi[places], least * whole), ROTOR_SHARE * whole)


def _of_rotors(structure: Structure, chi: Array) -> Array:
    """Standard parameters that are inertias of rotors alone; all others, those that hold inertia of links too, zero."""
    at = _rotors(structure)
    rotors = np.zeros_like(chi)
    rotors[at] = chi[at]
    return rotors


def _rotors(structure: Structure) -> Indices:
    """Standard parameters that are inertias of rotors, those left out that hold inertia of links as well."""
    base = structure.base
    alone = np.count_nonzero(base.regrouping, axis=1) == 1
    return base.columns[alone & np.array([name.startswith("Ia") for name in base.names])]
