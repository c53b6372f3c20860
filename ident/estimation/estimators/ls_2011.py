"""Drive gains joint by joint, each from its own rows (paper, eq. 27).

If the kinematics make the column of 1/g zero, or its coefficient is too uncertain, the joint is refused, with the
reason and the predicted standard deviation.
"""

from dataclasses import dataclass

from ident.estimation.estimate import GainEstimate, judge_identifiability
from ident.estimation.joint_by_joint import joint_by_joint, joint_fit
from ident.estimation.problem import Problem

NAME = "ls-2011"


@dataclass(frozen=True, slots=True, kw_only=True)
class JointByJointOptions:
    """The method of eq. 27 has no options of its own."""


def joint_by_joint_gains(problem: Problem, options: JointByJointOptions) -> GainEstimate:
    """Estimate each joint's drive gain independently (paper, eq. 27).

    Args:
        problem: Motions and payloads; all known parameters of a payload are used.
        options: None yet.

    Returns:
        A gain or a reason for each joint.

    Raises:
        NotIdentifiable: If no motion is bare, or none is loaded.
    """
    problem.check_difference()
    known = [payload.known_part() for payload in problem.payloads]
    fits = [joint_fit(problem, joint, known) for joint in range(problem.structure.arm.n)]
    return judge_identifiability(NAME, problem, joint_by_joint(problem, fits, known))
