"""Estimators by name: each a function `(problem, options) -> estimate` with an options class of its own."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from ident.estimation.estimate import GainEstimate
from ident.estimation.estimators import iv, ls_2011, nls, ols, sequential_2011, tls_2014
from ident.estimation.problem import Problem
from ident.support.errors import OptionError
from ident.support.naming import nearest

Options = TypeVar("Options")


@dataclass(frozen=True, slots=True)
class Estimator:
    """A way to find gains.

    Attributes:
        options: Class of its own options, a frozen dataclass with a default for every field.
        estimate: The estimate of a problem with options of that class.
    """

    options: type[object]
    estimate: Callable[[Problem, object], GainEstimate]


def plug_in(estimate: Callable[[Problem, Options], GainEstimate], options: type[Options]) -> Estimator:
    """An estimator from a function and the class of its options."""

    def checked(problem: Problem, chosen: object) -> GainEstimate:
        if not isinstance(chosen, options):
            raise OptionError(f"options are {type(chosen).__name__}; this estimator accepts {options.__name__}")
        return estimate(problem, chosen)

    return Estimator(options, checked)


ESTIMATORS: dict[str, Estimator] = {
    iv.NAME: plug_in(iv.instrumental_gains, iv.InstrumentOptions),
    ls_2011.NAME: plug_in(ls_2011.joint_by_joint_gains, ls_2011.JointByJointOptions),
    nls.NAME: plug_in(nls.all_joints_gains, nls.AllJointsOptions),
    ols.NAME: plug_in(ols.homogeneous_gains, ols.HomogeneousOptions),
    sequential_2011.NAME: plug_in(sequential_2011.sequential_gains, sequential_2011.SequentialOptions),
    tls_2014.NAME: plug_in(tls_2014.total_gains, tls_2014.HomogeneousOptions),
}
"""What each is.

`ls-2011`: Gautier and Briot's joint by joint (eq. 27); `sequential-2011`: their sequence from the mass (III.B);
`nls`: all joints at once; `iv`: joint by joint with instruments; `ols`, `tls-2014`: in homogeneous form, to compare.
"""

DEFAULT = nls.NAME
"""What is used where none is named: least bias and deviation, and intervals that hold (`docs/methods.md`)."""


def estimator(name: str) -> Estimator:
    """The estimator of that name.

    Raises:
        OptionError: If there is none.
    """
    if name not in ESTIMATORS:
        raise OptionError(f"unknown method {name!r}{nearest(name, ESTIMATORS)}; known: {', '.join(ESTIMATORS)}")
    return ESTIMATORS[name]
