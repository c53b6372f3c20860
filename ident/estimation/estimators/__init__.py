"""Estimators by name: each is a function `(problem, options) -> estimate` and a class of its options."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from ident.estimation import joint_by_joint
from ident.estimation.estimate import GainEstimate
from ident.estimation.estimators import iv, nls, sequential_2011
from ident.estimation.problem import NoOptions, Problem
from ident.support.errors import OptionError
from ident.support.naming import nearest

Options = TypeVar("Options")


@dataclass(frozen=True, slots=True)
class Estimator:
    """A method that estimates gains."""

    options: type[object]  # class of its options, a frozen dataclass with a default for every field
    # function that estimates the gains of a problem with such options:
    estimate: Callable[[Problem, object], GainEstimate]


def plug_in(estimate: Callable[[Problem, Options], GainEstimate], options: type[Options]) -> Estimator:
    """An estimator from a function and the class of its options."""

    def checked(problem: Problem, chosen: object) -> GainEstimate:
        if not isinstance(chosen, options):
            raise OptionError(f"options are {type(chosen).__name__}; this estimator accepts {options.__name__}")
        return estimate(problem, chosen)

    return Estimator(options, checked)


ESTIMATORS: dict[str, Estimator] = {
    iv.NAME: plug_in(iv.instrumental_gains, NoOptions),
    joint_by_joint.NAME: plug_in(joint_by_joint.joint_by_joint_gains, NoOptions),
    nls.NAME: plug_in(nls.all_joints_gains, nls.AllJointsOptions),
    sequential_2011.NAME: plug_in(sequential_2011.sequential_gains, NoOptions),
}
"""`ls-2011`: Gautier and Briot's joint by joint (eq. 27); `sequential-2011`: their sequence from the mass (III.B);
`nls`: all joints at once; `iv`: joint by joint with instruments."""

DEFAULT = nls.NAME
"""The default: smallest bias and standard deviation, and correct coverage (`docs/methods.md`)."""


def estimator(name: str) -> Estimator:
    """The estimator of that name; raises `OptionError` if there is none."""
    if name not in ESTIMATORS:
        raise OptionError(f"unknown method {name!r}{nearest(str(name), ESTIMATORS)}; known: {', '.join(ESTIMATORS)}")
    return ESTIMATORS[name]


def gives_a_gain(options: object) -> bool:
    """Whether options of a method state a gain, which sets the scale of the others."""
    return isinstance(options, nls.AllJointsOptions) and options.gain_value is not None
