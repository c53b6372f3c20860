"""What a loaded motion would add: the estimate of bare motions and of themselves, repeated with a payload.

With the gains g about known, the same motion with the payload mounted would need the currents

    V' = V + W_L chi_L / g,

so that the rows of the bare motions, with this on top, stand for the loaded ones, residuals included. What the
estimator says of both is what it would say of real ones, but for friction that grows with the load.
"""

from dataclasses import dataclass, replace

from ident.arm_parameters.bare import BareArm, GainRatios
from ident.estimation.estimate import IdentifiedGain
from ident.estimation.estimators.nls import AllJointsOptions, all_joints_gains
from ident.estimation.known_gains import KnownGains
from ident.estimation.problem import ObservedMotion, Problem
from ident.observation.observation import Observation
from ident.payload.payload import Payload
from ident.support.arrays import Array
from ident.support.errors import NotIdentifiable

UNKNOWN = "its gain is neither given nor identifiable relative to a given one, so the payload's torque is unknown"


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpectedGain:
    """What a loaded motion would say of a gain.

    Attributes:
        joint: The joint, from 0.
        rel_std: Relative standard deviation to expect, None where the gain would be refused or nobody can tell.
        reason: Why, None where it would be given.
    """

    joint: int
    rel_std: float | None
    reason: str | None


def forecast_gains(
    problem: Problem, options: AllJointsOptions, payload: Payload, in_si: BareArm, gains: KnownGains, ratios: GainRatios
) -> tuple[ExpectedGain, ...]:
    """What to expect of every gain if bare motions were repeated with a payload.

    Args:
        problem: Motions with a bare flange.
        options: Model of the arm.
        payload: That would be mounted; what is drawn of it moves the currents, what is `known` is used.
        in_si: What the motions say with gains that are known.
        gains: Those gains.
        ratios: What the motions say of gains beside each other.

    Raises:
        NotIdentifiable: If nothing of the payload is known, or it puts no torque on any joint.
    """
    if payload.known == "none":
        raise NotIdentifiable(
            "no parameter of the payload to be mounted is known, so it determines no gain; give its mass"
        )
    gain = 1.0 / in_si.selected.final.fit.found.h
    loaded = tuple(
        ObservedMotion(with_payload_torque(each.observation, payload, gain), payload) for each in problem.motions
    )
    estimate = all_joints_gains(replace(problem, motions=(*problem.motions, *loaded)), options)
    beside = bool(ratios.given[gains.joints].any())
    found = list[ExpectedGain]()
    for j, each in enumerate(estimate.joints):
        if j not in gains.joints and not (beside and ratios.given[j]):
            found.append(ExpectedGain(joint=j, rel_std=None, reason=UNKNOWN))
        elif isinstance(each, IdentifiedGain):
            found.append(ExpectedGain(joint=j, rel_std=abs(each.std / each.value), reason=None))
        else:
            found.append(ExpectedGain(joint=j, rel_std=None, reason=each.reason))
    return tuple(found)


def with_payload_torque(observation: Observation, payload: Payload, gain: Array) -> Observation:
    """A bare motion's rows with the torque of a payload on top.

    Args:
        observation: Of a motion with a bare flange.
        payload: That would be mounted.
        gain: Of every joint [N m / drive unit], shape (n,).
    """
    chi = payload.known_part().chi
    joints = tuple(
        replace(each, V=each.V + each.W_L @ chi / g) for each, g in zip(observation.joints, gain.tolist(), strict=True)
    )
    return replace(observation, joints=joints)
