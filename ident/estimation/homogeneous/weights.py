"""How rows of different joints count: functions `(problem, columns) -> weight of each joint [1/(N m)]`, by name."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ident.estimation.all_joints.columns import JointColumns
from ident.estimation.all_joints.friction import own_columns
from ident.estimation.all_joints.reduction import reduced_joint
from ident.estimation.all_joints.start import alone, start_of
from ident.estimation.problem import Problem
from ident.support.arrays import Array
from ident.support.options import NAMES, unknown_name


def equal(problem: Problem, columns: Sequence[JointColumns]) -> Array:
    """A newton metre counts the same on every joint, shape (n,)."""
    return np.ones(len(columns))


def by_joint(problem: Problem, columns: Sequence[JointColumns]) -> Array:
    """One over the deviation of each joint's residual in torque units, shape (n,).

    It is that of the joint's own free least squares in current units, times a gain in current units (eq. 27). From the
    residual of the homogeneous form itself a gain of zero would weigh its joint without limit.
    """
    own = [own_columns(each, {}, per_motion=False) for each in columns]
    joints = [reduced_joint(each, F) for each, F in zip(columns, own, strict=True)]
    sigma = np.array([each.sigma for each in joints])
    return np.abs(start_of(alone(problem), joints, own, {})) / sigma


WEIGHTS: dict[str, Callable[[Problem, Sequence[JointColumns]], Array]] = {"equal": equal, "joint": by_joint}


@dataclass(frozen=True, slots=True, kw_only=True)
class HomogeneousOptions:
    """Options of the methods in homogeneous form.

    Attributes:
        weights: How rows of different joints count.
    """

    weights: str = field(default="joint", metadata={NAMES: WEIGHTS})

    def __post_init__(self) -> None:
        """Check the name.

        Raises:
            OptionError: If there is none such.
        """
        if self.weights not in WEIGHTS:
            raise unknown_name("weights", self.weights, WEIGHTS)
