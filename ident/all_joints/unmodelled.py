"""What stiff joints with plain friction may lack: columns of load friction and compliance, from a fit without them."""

from dataclasses import dataclass

import numpy as np

from ident.all_joints.solution import fit_with, setting
from ident.all_joints.stiffness import assumed_compliance
from ident.all_joints.terms import LOAD_FORMS, STRONGEST, TermColumns, torque_terms
from ident.arrays import Array
from ident.errors import NotConverged, NotIdentifiable, TooFewRows
from ident.problem import Problem

PRIOR_STD = 1.0
"""As `nls` has it where nothing is said."""
SOFTEST = 3.0
"""Compliance, over the assumed one, that a joint is let have: rotors at 14 Hz instead of 25."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Unmodelled:
    """Terms that a fit of plain joints lacks.

    Attributes:
        terms: Their columns, joint by joint.
        compliance: Of each joint as drives may have it [rad / (N m)] or [m / N], shape (n,).
    """

    terms: TermColumns
    compliance: Array

    def currents(self, joint: int, inverse: float) -> Array:
        """The most that each term may add to a joint's currents [drive units], shape (r, k).

        Friction takes up to `STRONGEST` of a torque, and a joint yields up to `SOFTEST` times what is assumed.

        Args:
            joint: The joint, from 0.
            inverse: Its 1/g.
        """
        braking = [STRONGEST * self.terms.own[joint][form] for form in LOAD_FORMS]
        return np.column_stack((*braking, self.terms.softened[joint] * (SOFTEST * inverse * self.compliance)))


def unmodelled(problem: Problem) -> Unmodelled | None:
    """The terms that a fit of stiff joints with plain friction lacks; None where there is no such fit of recordings."""
    if any(motion.observation.full_rate is None for motion in problem.motions):
        return None
    try:
        ready = setting(problem, per_motion=True, prior_std=PRIOR_STD)
        plain = fit_with(ready, [{} for _ in range(ready.n)], (), None)
    except (NotIdentifiable, NotConverged, TooFewRows):
        return None
    return Unmodelled(
        terms=torque_terms(problem, ready.shared, plain.own, plain.fit, compliance=True),
        compliance=assumed_compliance(problem, ready.shared, plain.fit.found.theta),
    )
