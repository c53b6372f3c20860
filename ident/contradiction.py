"""Data that contradict themselves: no gain of theirs is to be believed, however small its deviation."""

from collections.abc import Iterable, Mapping

import numpy as np

from ident.all_joints.unmodelled import unmodelled
from ident.errors import Contradiction
from ident.estimate import GainEstimate
from ident.joint_fit import JointFit, joint_fit
from ident.payload_shape import ShapeMismatch, shape_mismatch
from ident.problem import Problem
from ident.signs import FRICTION_Z, joint_signs

SURE_LOAD_Z = 10.0
"""Standard deviations of 1/g from zero above which the sign of the load is trusted; every identified gain has them."""
SHARE = 0.025
"""Part of a payload's torque that may have another shape than described."""
SURE_F = 50.0
"""F above which that part is no accident.

With every model error that `scenarios/catalog/nominal.toml` lists drawn at once it stays below 25; with the position of
one joint negated or off by a quarter turn, neighbours exchanged or a base on the ceiling, some joint of a UR-like arm
has 90 and more (`docs/derivations.md`).
"""
HELPS = 0.25
"""Part of the square of a mismatch from which what explains it, though not enough, is named beside the suspects."""
SUSPECTS = (
    "suspect the sign or the zero of q or v of a joint, the order of the columns, the robot model, the orientation of "
    "the base, or the payload's centre of mass"
)


def check_signs(estimate: GainEstimate) -> None:
    """Refuse an estimate if some joint's gain has one sign by the load and the other by friction.

    Raises:
        Contradiction: Naming the joints.
    """
    signs = joint_signs(estimate)
    sure = (np.abs(signs.load_z) > SURE_LOAD_Z) & (np.abs(signs.friction_z) > FRICTION_Z)
    against = estimate.solution.joints[sure & (signs.load_z * signs.friction_z < 0.0)]
    if len(against):
        raise Contradiction(
            f"joint {_listed(against)}: by the payload the gain has one sign, by friction the other; {SUSPECTS}"
        )


def check_shape(problem: Problem, estimate: GainEstimate) -> None:
    """Refuse data in which the load has another shape on some joint than the payload's description implies.

    What friction that grows with load and joints that yield may be of it does not count. Neither do joints that are
    refused anyway: of a torque as small as theirs, a millimetre of the payload's centre is a large share.

    Raises:
        Contradiction: Naming the joints, and the one that is surest.
    """
    known = [payload.known_part() for payload in problem.payloads]
    fits = [joint_fit(problem, joint, known) for joint in np.flatnonzero(estimate.identifiable).tolist()]
    alone = {each.system.rows.joint: each for each in fits if isinstance(each, JointFit)}
    at_first = _sure({joint: shape_mismatch(problem, fit) for joint, fit in alone.items()})
    lacking = unmodelled(problem) if at_first else None
    found = at_first
    if lacking is not None:
        beside = {joint: lacking.currents(joint, alone[joint].inverse) for joint in at_first}
        found = _sure({joint: shape_mismatch(problem, alone[joint], most) for joint, most in beside.items()})
    if found:
        raise Contradiction(_words(at_first, found))


def _words(at_first: Mapping[int, ShapeMismatch], found: Mapping[int, ShapeMismatch]) -> str:
    """What to say of mismatches, before and after other causes have had their share."""
    worst = max(found, key=lambda joint: found[joint].F)
    helped = 1.0 - (found[worst].share / at_first[worst].share) ** 2
    words = (
        f"joint {_listed(found)}: the payload's torque has another shape than described, surest on joint {worst + 1} "
        f"({100.0 * found[worst].share:.3g} % of it); {SUSPECTS}"
    )
    if helped < HELPS:
        return words
    return (
        f"{words}; or else joints that yield: with load friction they explain {100.0 * helped:.0f} % of the square of "
        "what was seen"
    )


def _sure(mismatches: Mapping[int, ShapeMismatch | None]) -> dict[int, ShapeMismatch]:
    """Mismatches that are no accident and too much, by joint."""
    return {
        joint: each for joint, each in mismatches.items() if each is not None and each.share > SHARE and each.F > SURE_F
    }


def _listed(joints: Iterable[int]) -> str:
    return ", ".join(str(int(joint) + 1) for joint in joints)
