"""Results with given gains: a payload compared with its weighed mass, and the arm, whose torque is then predicted.

Results with a-priori and with identified gains show the effect of the former.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.arm_parameters.bare import BareArm, arm_in_SI
from ident.estimation.all_joints.columns import shared_arm
from ident.estimation.estimators.nls import AllJointsOptions
from ident.estimation.gain_options import GainOptions
from ident.estimation.joint_by_joint.pooled_system import PooledSystem
from ident.estimation.known_gains import KnownGains
from ident.estimation.problem import ObservedMotion, Problem
from ident.estimation.uncertainty import UNCERTAINTIES
from ident.model.structure import Structure
from ident.payload.payload import Payload
from ident.payload_identification.payload_estimate import payload_of
from ident.payload_identification.verification import Verification, verified
from ident.support.arrays import Array, Indices
from ident.support.errors import NotIdentifiable

UNKNOWN = Payload(mass=1.0, known="none")
"""An unknown payload; its mass is not used."""
PLAIN = AllJointsOptions(friction="viscous-coulomb")
"""Model for methods other than `nls`, whose gains include load-dependent friction."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ArmInUse:
    """An arm identified from bare motions with given gains.

    Attributes:
        gains: The gains.
        arm: The arm from the bare motions, with viscous and Coulomb friction.
    """

    gains: KnownGains
    arm: BareArm

    def base(self, structure: Structure) -> Array:
        """Base parameters of the arm, with friction of the first motion, zero if not identifiable, shape (b,)."""
        found = {each.name: each.value for each in self.arm.inertial}
        for j, gain in zip(self.gains.joints.tolist(), self.gains.value.tolist(), strict=True):
            for each in self.arm.friction[j]:
                found.setdefault(f"{each.name.partition(' ')[0]}{j + 1}", gain * each.value)
        return np.array([found.get(name, 0.0) for name in structure.base.names])

    def covariance(self, structure: Structure, options: GainOptions) -> Array:
        """Covariance of `base` from the residuals, with exact gains, shape (b, b).

        Args:
            structure: Identifiable structure of the arm.
            options: Method for the uncertainty.
        """
        final, names = self.arm.selected.final, structure.base.names
        fit, arm = final.fit, shared_arm(structure.base)
        influence = np.zeros((len(names), len(fit.rows.V)))
        influence[arm] = fit.theta_influence[: len(arm)]
        for j, gain in zip(self.gains.joints.tolist(), self.gains.value.tolist(), strict=True):
            own = zip(final.own[j].names, fit.phi_influence[j], strict=True)
            for name, row in reversed(list(own)):  # values of the first motion are kept
                influence[names.index(f"{name}{j + 1}")] = gain * row
        return UNCERTAINTIES[options.uncertainty](fit.rows, influence)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GainsOutcome(ArmInUse):
    """Arm and payload estimated with given gains.

    Attributes:
        weighed: Payload from all joints and from each alone, compared with its weighed mass; its centre and inertia.
    """

    weighed: Verification


def arm_in_use(problem: Problem, gains: KnownGains) -> ArmInUse:
    """Identify the arm with given gains, from the bare motions of a problem.

    Raises:
        NotIdentifiable: If no motion is bare.
        GainsError: If the gains are not of this arm.
    """
    bare = replace(problem, motions=tuple(motion for motion in problem.motions if motion.payload is None))
    if not bare.motions:
        raise NotIdentifiable("no motion is bare; record one without payload")
    return ArmInUse(gains=gains, arm=arm_in_SI(bare, PLAIN, gains))


def gains_outcome(problem: Problem, weight: Payload, gains: KnownGains, options: object) -> GainsOutcome:
    """Estimate payload and arm with given gains.

    Args:
        problem: Bare motions and those of one mounting, with an unknown payload.
        weight: The specified payload; its known shape is used for single joints.
        gains: Gains of all or some joints.
        options: Options of the method of the gains; for methods other than `nls`, `PLAIN` is used.

    Raises:
        NotIdentifiable: If no motion is bare or none is loaded, or the mass is not identifiable.
        GainsError: If the gains are not of this arm.
        PayloadError: If no parameter of the payload is known.
    """
    found = payload_of(problem, gains, options if isinstance(options, AllJointsOptions) else PLAIN)
    return GainsOutcome(gains=gains, weighed=verified(found, weight, gains), arm=arm_in_use(problem, gains).arm)


def outcome_of_other_gains(problem: Problem, gains: KnownGains, options: object) -> GainsOutcome:
    """Estimate the heaviest payload of motions used for identification, and the arm, with other gains.

    Args:
        problem: Bare and loaded motions.
        gains: Gains, such as data-sheet gains.
        options: As in `gains_outcome`.

    Raises:
        NotIdentifiable: If no motion is bare or none is loaded, or the mass is not identifiable.
        GainsError: If the gains are not of this arm.
        PayloadError: If no parameter of the payload is known.
    """
    problem.check_difference()
    weight = max(problem.payloads, key=lambda each: each.mass)
    loaded = [motion for motion in problem.motions if motion.payload is weight]
    return gains_outcome(with_unknown_weight(problem, loaded), weight, gains, options)


def with_unknown_weight(problem: Problem, loaded: Sequence[ObservedMotion]) -> Problem:
    """Return the bare motions of a problem, and loaded ones with an unknown payload."""
    bare = [motion for motion in problem.motions if motion.payload is None]
    unknown = [ObservedMotion(motion.observation, UNKNOWN) for motion in loaded]
    return replace(problem, motions=(*bare, *unknown))


def predicted_torque(system: PooledSystem, base: Array, payload: Payload) -> Array:
    """Return the torque of arm and payload on the rows of a loaded motion, including friction [N m], shape (r,).

    Args:
        system: Its rows.
        base: Base parameters of the arm, shape (b,).
        payload: Its payload, of which known parameters are used.
    """
    return system.W @ base + system.W_L @ payload.known_part().chi


def rel_errors(error: Array, measured: Array, joint: Indices) -> dict[int, float]:
    """Return the norm of an error over that of the measured values, by joint from 0.

    Args:
        error: Prediction error, shape (r,).
        measured: Measured values in the same unit, shape (r,).
        joint: Joint of each row, from 0, shape (r,).
    """
    rows = {int(j): joint == j for j in np.unique(joint)}
    return {j: float(np.linalg.norm(error[at]) / np.linalg.norm(measured[at])) for j, at in rows.items()}
