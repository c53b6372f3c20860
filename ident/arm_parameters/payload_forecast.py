"""Forecast of a loaded motion: the estimate from bare motions and the same motions with a simulated payload.

With approximately known gains g, the same motion with the payload would need the currents

    V' = V + W_L chi_L / g,

so the rows of the bare motions plus this term represent the loaded ones, including residuals. The estimate from both is
that of real motions, except for load-dependent friction.
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
    """Forecast of a gain.

    Attributes:
        joint: The joint, from 0.
        rel_std: Expected relative standard deviation, None if the gain would be refused or there is no forecast.
        reason: The reason, None if the gain is expected.
    """

    joint: int
    rel_std: float | None
    reason: str | None


def forecast_gains(
    problem: Problem, options: AllJointsOptions, payload: Payload, in_si: BareArm, gains: KnownGains, ratios: GainRatios
) -> tuple[ExpectedGain, ...]:
    """Return the expected accuracy of every gain if bare motions were repeated with a payload.

    Args:
        problem: Motions with a bare flange.
        options: Model of the arm.
        payload: The planned payload; all stated parameters affect the currents, `known` ones are used.
        in_si: Result of the motions with known gains.
        gains: The known gains.
        ratios: Ratios of gains from the motions.

    Raises:
        NotIdentifiable: If no parameter of the payload is known, or it puts no torque on any joint.
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
    """Return a bare motion's rows with the added torque of a payload.

    Args:
        observation: Rows of a motion with a bare flange.
        payload: The planned payload.
        gain: Gain of every joint [N m / drive unit], shape (n,).
    """
    chi = payload.known_part().chi
    joints = tuple(
        replace(each, V=each.V + each.W_L @ chi / g) for each, g in zip(observation.joints, gain.tolist(), strict=True)
    )
    return replace(observation, joints=joints)
