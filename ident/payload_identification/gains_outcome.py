"""What motions give with gains in use: a weight beside its scale, and the arm, whose torque they then predict.

Found once with gains that are believed and once with gains that were identified, it says what believing them costs.
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
"""A payload of which nothing is known; its mass is not used."""
PLAIN = AllJointsOptions(friction="viscous-coulomb")
"""Model of methods other than `nls`: their gains hold whatever friction grows with the load."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ArmInUse:
    """An arm as its bare motions show it with gains in use.

    Attributes:
        gains: The gains.
        arm: The arm from the bare motions, with viscous and Coulomb friction.
    """

    gains: KnownGains
    arm: BareArm

    def base(self, structure: Structure) -> Array:
        """The arm's base parameters, friction that of the first motion, zero where they do not show, shape (b,)."""
        found = {each.name: each.value for each in self.arm.inertial}
        for j, gain in zip(self.gains.joints.tolist(), self.gains.value.tolist(), strict=True):
            for each in self.arm.friction[j]:
                found.setdefault(f"{each.name.partition(' ')[0]}{j + 1}", gain * each.value)
        return np.array([found.get(name, 0.0) for name in structure.base.names])

    def covariance(self, structure: Structure, options: GainOptions) -> Array:
        """Covariance of `base` from the residuals, the gains taken as exact, shape (b, b).

        Args:
            structure: Of the arm.
            options: How uncertainty is found.
        """
        final, names = self.arm.selected.final, structure.base.names
        fit, arm = final.fit, shared_arm(structure.base)
        influence = np.zeros((len(names), len(fit.rows.V)))
        influence[arm] = fit.theta_influence[: len(arm)]
        for j, gain in zip(self.gains.joints.tolist(), self.gains.value.tolist(), strict=True):
            own = zip(final.own[j].names, fit.phi_influence[j], strict=True)
            for name, row in reversed(list(own)):  # the first motion has the last word
                influence[names.index(f"{name}{j + 1}")] = gain * row
        return UNCERTAINTIES[options.uncertainty](fit.rows, influence, options.serial_s)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GainsOutcome(ArmInUse):
    """What motions give with gains in use: the arm, and a weight.

    Attributes:
        weighed: The weight from all joints and from each alone, beside its scale; its centre and inertia.
    """

    weighed: Verification


def arm_in_use(problem: Problem, gains: KnownGains) -> ArmInUse:
    """Find the arm with gains in use, from the bare motions of a problem.

    Raises:
        NotIdentifiable: If no motion is bare.
        GainsError: If the gains are not of this arm.
    """
    bare = replace(problem, motions=tuple(motion for motion in problem.motions if motion.payload is None))
    if not bare.motions:
        raise NotIdentifiable("no motion is bare; record one without payload")
    return ArmInUse(gains=gains, arm=arm_in_SI(bare, PLAIN, gains))


def gains_outcome(problem: Problem, weight: Payload, gains: KnownGains, options: object) -> GainsOutcome:
    """Find weight and arm with gains in use.

    Args:
        problem: Bare motions and those of one mounting, of whose payload nothing is known.
        weight: As weighed; what is known of its shape serves each joint alone.
        gains: Of the arm's joints, of all or some.
        options: Of the method that found or would find gains; of another one than `nls`, `PLAIN` takes their place.

    Raises:
        NotIdentifiable: If no motion is bare or none is loaded, or the mass does not show.
        GainsError: If the gains are not of this arm.
        PayloadError: If nothing of the weight is known.
    """
    found = payload_of(problem, gains, options if isinstance(options, AllJointsOptions) else PLAIN)
    return GainsOutcome(gains=gains, weighed=verified(found, weight, gains), arm=arm_in_use(problem, gains).arm)


def outcome_of_other_gains(problem: Problem, gains: KnownGains, options: object) -> GainsOutcome:
    """Find the heaviest weight of motions that gains were found from, and the arm, with other gains.

    Args:
        problem: Bare and loaded motions.
        gains: As of a data sheet.
        options: As for `gains_outcome`.

    Raises:
        NotIdentifiable: If no motion is bare or none is loaded, or the mass does not show.
        GainsError: If the gains are not of this arm.
        PayloadError: If nothing of the weight is known.
    """
    problem.check_difference()
    weight = max(problem.payloads, key=lambda each: each.mass)
    loaded = [motion for motion in problem.motions if motion.payload is weight]
    return gains_outcome(with_unknown_weight(problem, loaded), weight, gains, options)


def with_unknown_weight(problem: Problem, loaded: Sequence[ObservedMotion]) -> Problem:
    """The bare motions of a problem, and loaded ones of whose weight nothing is known.

    Args:
        problem: Bare and loaded motions.
        loaded: Of one mounting.
    """
    bare = [motion for motion in problem.motions if motion.payload is None]
    unknown = [ObservedMotion(motion.observation, UNKNOWN) for motion in loaded]
    return replace(problem, motions=(*bare, *unknown))


def predicted_torque(system: PooledSystem, base: Array, payload: Payload) -> Array:
    """Torque that arm and payload take on the rows of a loaded motion, friction included [N m], shape (r,).

    Args:
        system: Its rows.
        base: Base parameters of the arm, shape (b,).
        payload: That it carries; what is known of it is used.
    """
    return system.W @ base + system.W_L @ payload.known_part().chi


def rel_errors(error: Array, measured: Array, joint: Indices) -> dict[int, float]:
    """Norm of an error over that of what was measured, by joint from 0.

    Args:
        error: Of a prediction, shape (r,).
        measured: What it predicts, in the same unit, shape (r,).
        joint: Joint of each row, from 0, shape (r,).
    """
    rows = {int(j): joint == j for j in np.unique(joint)}
    return {j: float(np.linalg.norm(error[at]) / np.linalg.norm(measured[at])) for j, at in rows.items()}
