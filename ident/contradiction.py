"""Data that contradict themselves: no gain of theirs is to be believed, however small its deviation."""

from collections.abc import Iterable

import numpy as np

from ident.errors import Contradiction
from ident.estimate import GainEstimate
from ident.joint_fit import JointFit, joint_fit
from ident.payload_shape import shape_mismatch
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

    Joints that are refused anyway do not count: of a torque as small as theirs, a millimetre of the payload's centre
    is a large share.

    Raises:
        Contradiction: Naming the joints, and the one that is surest.
    """
    known = [payload.known_part() for payload in problem.payloads]
    certain: dict[int, float] = {}
    shares: dict[int, float] = {}
    for joint in np.flatnonzero(estimate.identifiable).tolist():
        fit = joint_fit(problem, joint, known)
        mismatch = shape_mismatch(problem, fit) if isinstance(fit, JointFit) else None
        if mismatch is not None and mismatch.share > SHARE and mismatch.F > SURE_F:
            certain[joint], shares[joint] = mismatch.F, mismatch.share
    if certain:
        worst = max(certain, key=lambda joint: certain[joint])
        raise Contradiction(
            f"joint {_listed(certain)}: the payload's torque has another shape than described, surest on joint "
            f"{worst + 1} ({100.0 * shares[worst]:.3g} % of it); {SUSPECTS}"
        )


def _listed(joints: Iterable[int]) -> str:
    return ", ".join(str(int(joint) + 1) for joint in joints)
