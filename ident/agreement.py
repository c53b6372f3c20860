"""Whether both motions are of one arm: what the arm itself asks for may not change from one to the other.

A joint's currents give the arm's own columns one parameter each for all motions (eq. 27). A second one for the motions
with a payload is offered to what is left, the payload's own columns free. What it explains is what the arm, its
friction and its drives did differently: a little if friction drifts, much if one log has another unit or sign. No
deviation contains it, so that a gain beyond `MOST` is refused, and what is seen from `SEEN` on is said.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.base import independent_columns
from ident.column_space import column_space
from ident.estimate import GainEstimate, IdentifiedGain, RefusedGain
from ident.gain_system import JointRows, joint_rows
from ident.problem import Problem

SURE_F = 50.0
"""F above which a difference is no accident."""
SEEN, MOST = 0.01, 0.05
"""Shares of a joint's current that may differ unsaid, and at all.

Friction that drifts by 6 % makes 0.8 to 2.8 % and errs the gains by up to 3 %; by 20 %, 2 to 9 %. Real pairs with weeks
between their motions reach 3.7 %.
"""


@dataclass(frozen=True, slots=True)
class Disagreement:
    """What a second set of the arm's own parameters explains on one joint.

    Attributes:
        joint: The joint, from 0.
        share: Norm of it over the norm of the joint's currents.
        F: Its mean square a column over that of what is left.
    """

    joint: int
    share: float
    F: float

    @property
    def sure(self) -> bool:
        """Whether it is more than noise, and enough to be said."""
        return self.F > SURE_F and self.share > SEEN


def disagreements(problem: Problem, estimate: GainEstimate, *, drift: bool = False) -> tuple[Disagreement, ...]:
    """Of the joints that have a gain, those on which the motions surely differ.

    Args:
        problem: Motions and payloads.
        estimate: What was found from them.
        drift: Whether viscous and Coulomb friction may differ between motions.
    """
    joints: list[int] = np.flatnonzero(estimate.identifiable).tolist()
    found = [disagreement(problem, joint_rows(problem, joint), drift=drift) for joint in joints]
    return tuple(each for each in found if each is not None and each.sure)


def disagreement(problem: Problem, rows: JointRows, *, drift: bool = False) -> Disagreement | None:
    """How much the arm's own parameters on a joint differ between motions with and without payload; None if unseen.

    Args:
        problem: Motions and payloads.
        rows: The joint's.
        drift: Whether viscous and Coulomb friction may differ.
    """
    probes = problem.structure.payload_probes[rows.joint]
    free = independent_columns(probes, [np.arange(probes.shape[1])])
    brakes = [
        k for k, name in enumerate(rows.names) if drift and name in (f"Fv{rows.joint + 1}", f"Fc{rows.joint + 1}")
    ]
    anew = [rows.W[:, brakes] * (rows.motion == motion)[:, None] for motion in range(1, len(problem.motions))]
    common = column_space(np.hstack((rows.W, *anew, *(W_L[:, free] for W_L in rows.W_L))))
    left = rows.V - common @ (common.T @ rows.V)
    own = column_space(rows.W * rows.loaded[:, None], common)
    rank, freedom = own.shape[1], len(left) - common.shape[1] - own.shape[1]
    if not rank or freedom < 1:
        return None
    explained = float(np.linalg.norm(own.T @ left))
    rest = float(np.linalg.norm(left - own @ (own.T @ left)))
    F = (explained**2 / rank) / (rest**2 / freedom) if rest > 0.0 else float("inf")
    return Disagreement(joint=rows.joint, share=explained / float(np.linalg.norm(rows.V)), F=F)


def agreed(estimate: GainEstimate, found: Sequence[Disagreement]) -> GainEstimate:
    """The estimate without the gains of joints whose motions differ too much, and of those that rest on their rows."""
    spoilt = [each for each in found if each.share > MOST]
    solution, joints = estimate.solution, list(estimate.joints)
    for k, joint in enumerate(solution.joints):
        for each in spoilt:
            gain = joints[joint]
            if isinstance(gain, IdentifiedGain) and solution.influence[k, solution.rows.of(each.joint)].any():
                rests = "" if each.joint == joint else f"it rests on joint {each.joint + 1}: "
                joints[joint] = RefusedGain(
                    joint=gain.joint, reason=f"{rests}{_words(each)}", predicted_rel_std=gain.predicted_rel_std
                )
    return replace(estimate, joints=tuple(joints))


def refused(estimate: GainEstimate, reason: str | None) -> GainEstimate:
    """The estimate with every gain refused; as it is where there is no reason to."""
    if reason is None:
        return estimate
    joints = tuple(
        RefusedGain(joint=each.joint, reason=reason, predicted_rel_std=each.predicted_rel_std)
        for each in estimate.joints
    )
    return replace(estimate, joints=joints)


def disagreement_notes(found: Sequence[Disagreement]) -> tuple[str, ...]:
    """A note on every joint whose motions differ, though not so much that its gain is refused."""
    return tuple(
        f"joint {each.joint + 1}: {_words(each)} The deviations do not contain it"
        for each in found
        if SEEN < each.share <= MOST
    )


def _words(each: Disagreement) -> str:
    return (
        f"the bare and the loaded motion disagree about the arm itself by {100.0 * each.share:.2g} % of the current; "
        "did friction change, or has one log another unit, sign or scale?"
    )
