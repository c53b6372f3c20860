"""The rule that refuses a gain: a deviation to expect beyond the one that was allowed."""

from collections.abc import Mapping
from dataclasses import replace

from ident.estimate import GainEstimate, IdentifiedGain, RefusedGain


def refusal(predicted_rel_std: float, load_rms: float, max_rel_std: float) -> str | None:
    """Why a gain is refused, None if it is not.

    Args:
        predicted_rel_std: Relative standard deviation to expect.
        load_rms: Root mean square of the payload's torque on the joint [N m].
        max_rel_std: Largest one that is allowed.
    """
    if predicted_rel_std <= max_rel_std:
        return None
    return (
        f"predicted standard deviation {_percent(predicted_rel_std)} of the gain exceeds {_percent(max_rel_std)}; "
        f"the payload puts {load_rms:.3g} N m rms on this joint"
    )


def with_refusals(estimate: GainEstimate, reasons: Mapping[int, str]) -> GainEstimate:
    """The estimate with some more joints refused.

    Args:
        estimate: Gains of an arm.
        reasons: Why, by joint from 0; a joint that is refused already keeps its reason.
    """
    joints = tuple(
        RefusedGain(joint=joint.joint, reason=reasons[j], predicted_rel_std=joint.predicted_rel_std)
        if j in reasons and isinstance(joint, IdentifiedGain)
        else joint
        for j, joint in enumerate(estimate.joints)
    )
    return replace(estimate, joints=joints)


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"
