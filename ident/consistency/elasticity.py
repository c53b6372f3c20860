"""Elastic joints: would they bend the gains, and could these data tell?

Compliance acts with the square of the motion's frequency over that of the rotors on their transmissions. It is assumed
where nobody measured it (`all_joints.stiffness`).
"""

from ident.all_joints.stiffness import RESONANCE_HZ
from ident.consistency.evidence import Evidence
from ident.consistency.finding import Finding
from ident.consistency.hidden import Hidden, hidden_effect
from ident.consistency.soft_currents import soft_currents

NAME = "elasticity"


def check_elasticity(evidence: Evidence) -> Finding | None:
    """Whether elastic joints could move a gain unseen; None where the model has them."""
    added = soft_currents(evidence)
    if added is None or not evidence.identified:
        return None
    effect = hidden_effect(evidence, added)
    ratio = {joint: effect.possible * abs(moved) / evidence.rel_std(joint) for joint, moved in effect.moved.items()}
    worst = max(ratio, key=lambda joint: ratio[joint])
    failed = [joint for joint in ratio if effect.suspected and ratio[joint] > effect.most]
    return Finding(
        check=NAME,
        joint=worst,
        statistic=ratio[worst],
        threshold=effect.most,
        measure="deviations of the gain",
        sentence=_sentence(effect, failed) if failed else None,
    )


def _sentence(effect: Hidden, joints: list[int]) -> str:
    shares = {joint: 100.0 * effect.moved[joint] for joint in joints}
    read = ", ".join(
        f"joint {joint + 1} reads {abs(each):.2g} % {'high' if each > 0.0 else 'low'}" for joint, each in shares.items()
    )
    if effect.shown:
        told = f"what is left shows {100.0 * effect.seen:.0f} % of such an effect: let the joints yield (compliance)"
    else:
        told = f"these data cannot tell (they allow {100.0 * effect.possible:.0f} % of it): move slower, or measure it"
    return (
        f"with rotors that swing on their transmissions at {RESONANCE_HZ:.0f} Hz (assumed) {read}, if the model has no "
        f"compliance; {told}. The deviations do not contain it"
    )
