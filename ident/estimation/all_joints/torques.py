"""Torques of the fitted arm at the full sampling rate, and the columns that follow from them."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ident.estimation.all_joints.columns import SharedParameters
from ident.estimation.problem import ObservedMotion, Problem
from ident.model.arm import Arm
from ident.model.displacement import Dynamics, States
from ident.model.parameters import STANDARD
from ident.model.regressor import drive_torques, inverse_dynamics
from ident.model.structure import Structure
from ident.numerics.splines import CubicSpline
from ident.observation.full_rate import FullRate
from ident.support.arrays import Array, Indices, Mask

ROTOR_SHARE = 0.5
"""Assumed share of a rotor in a joint's inertia if the data do not separate them: gears match rotor and load
inertia."""
STATES = 16
"""Number of positions along a motion over which inertia is averaged."""


@dataclass(frozen=True, eq=False)
class Torques:
    """Torques of an arm along a motion, without friction and offset.

    Attributes:
        motion: From a recording.
        chi: Standard parameters of the arm with its payload, shape (14 n + 3 c,); names as in `parameters.labels`.
        rotors: The same, with all but rotor inertias set to zero.
    """

    motion: ObservedMotion
    chi: Array
    rotors: Array

    @property
    def arm(self) -> Arm:
        """The arm."""
        return self.motion.observation.structure.arm

    @property
    def _behind(self) -> FullRate:
        return self.motion.observation.recorded

    @cached_property
    def sampled(self) -> Array:
        """Torques at the samples where they are evaluated [N m], shape (S, n)."""
        return self.motion.observation.link_motions.torques(self.chi)

    @cached_property
    def rigid(self) -> Array:
        """Torques of rigid joints at full rate [N m], shape (N, n)."""
        return self._at_full_rate(self.sampled)

    @cached_property
    def links(self) -> Dynamics:
        """Dynamics of the links, without rotors."""
        return Dynamics.of(self.motion.observation.kinematics, self.chi - self.rotors)

    @cached_property
    def inertia(self) -> Array:
        """Mean squares of the inertia matrix of the links, shape (n, n)."""
        return np.mean(inertia_matrices(self.arm, self.links.chi, self._behind.states.q) ** 2, axis=0)

    def softened(self, torque: Array | None = None) -> Array:
        """Change of torques by compliance.

        The position of an elastic joint's link lags that of its motor, where the encoder is, by the transmitted torque
        times the compliance C; likewise velocity and acceleration. The rotor is not affected, if its inertia is
        identified separately.

        Args:
            torque: Drive torque without friction, at full rate [N m], shape (N, n); None for that of rigid joints.

        Returns:
            Change for each joint per unit of each joint's compliance, at full rate [N m / (rad / (N m))], shape (N, n,
            n).
        """
        behind = self._behind
        given = self.sampled if torque is None else torque[behind.at]
        times, states = behind.t[behind.at], behind.states
        links = given - drive_torques(self.arm, self.rotors, states.dq, states.ddq)
        transmitted = CubicSpline.through(times, links)
        behind_motor = States(*(-transmitted(times, order) for order in range(3)))
        return self._at_full_rate(self.links.displaced(behind_motor))

    def misplaced(self) -> Array:
        """Change of torques per error of each joint's zero, then per tilt of the base about its x and y axes.

        Returns:
            At full rate [N m/rad; N m/m for prismatic joints], shape (N, n, n + 2).
        """
        states, arm = self._behind.states, self.arm
        still = np.zeros_like(states.q)
        turned = self.links.displaced(States(np.ones_like(states.q), still, still))
        # a rotation of the base rotates gravity the other way
        tilted = [
            inverse_dynamics(replace(arm, gravity=np.cross(arm.gravity, axis)), self.chi, states.q, still, still)
            for axis in np.eye(3)[:2]
        ]
        return self._at_full_rate(np.concatenate((-turned, np.stack(tilted, axis=2)), axis=2))

    def _at_full_rate(self, x: Array) -> Array:
        behind = self._behind
        return CubicSpline.through(behind.t[behind.at], x)(behind.t)


def torques(problem: Problem, motion: ObservedMotion, shared: SharedParameters, theta: Array) -> Torques:
    """Return the torques of the fitted arm along a motion."""
    chi = fitted_parameters(problem, motion, shared, theta)
    return Torques(motion, chi, _of_rotors(problem.structure, chi))


def fitted_parameters(problem: Problem, motion: ObservedMotion, shared: SharedParameters, theta: Array) -> Array:
    """Return the standard parameters of the fitted arm with the payload of a motion, without friction and offsets.

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


def inertia_matrices(arm: Arm, chi: Array, q: Array) -> Array:
    """Return the inertia matrices at some positions of a motion.

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
    """Return each rotor inertia, joint side [kg m^2] or [kg], estimated or, if confounded, assumed, shape (n,).

    Args:
        problem: Motions from recordings.
        shared: Which parameters joints share.
        theta: Their values, shape (p,).
        least: Smallest share of a rotor in its joint's inertia; a smaller estimate is an error of the fit.
    """
    structure, behind = problem.structure, problem.motions[0].observation.recorded
    chi = np.zeros(structure.base.regrouping.shape[1])
    chi[structure.base.columns[shared.arm]] = theta[: len(shared.arm)]
    whole = np.mean(np.einsum("sjj->sj", inertia_matrices(structure.arm, chi, behind.q)), axis=0)
    found = np.maximum(chi[_motors(structure)], least * whole)
    return np.where(told_rotors(structure), found, ROTOR_SHARE * whole)


def told_rotors(structure: Structure) -> Mask:
    """Mask of the joints whose rotor inertia is identifiable separately from that of links, shape (n,)."""
    return np.isin(_motors(structure), _rotors(structure))


def _motors(structure: Structure) -> Indices:
    """Indices of the inertias of the joints' own motors among the standard parameters, shape (n,)."""
    return np.asarray(len(STANDARD) * np.arange(structure.arm.n) + STANDARD.index("Ia"), np.intp)


def _of_rotors(structure: Structure, chi: Array) -> Array:
    """Return the standard parameters with all but separate rotor inertias set to zero."""
    at = _rotors(structure)
    rotors = np.zeros_like(chi)
    rotors[at] = chi[at]
    return rotors


def _rotors(structure: Structure) -> Indices:
    """Indices of the rotor inertias that are not regrouped with link inertias, among the standard parameters."""
    base = structure.base
    alone = np.count_nonzero(base.regrouping, axis=1) == 1
    return base.columns[alone & np.array([name.startswith("Ia") for name in base.names])]
