"""The currents that joints as soft as drives may be would add, whatever the method."""

import numpy as np

from ident.all_joints.solution import fit_with, setting
from ident.all_joints.stiffness import assumed_compliance
from ident.all_joints.terms import torque_terms
from ident.arrays import Array
from ident.consistency.evidence import Evidence
from ident.errors import NotConverged, NotIdentifiable, TooFewRows

PRIOR_STD = 1.0
"""As `nls` has it where nothing is said."""


def soft_currents(evidence: Evidence) -> Array | None:
    """Change of each row's current [drive units], shape (r,); None where no torques are found that it follows from.

    A method that has no torques of all joints has those of a fit of stiff joints with plain friction.
    """
    problem, solution = evidence.problem, evidence.estimate.solution
    if solution.softened is not None:
        return solution.softened
    if any(motion.observation.full_rate is None for motion in problem.motions):
        return None
    try:
        ready = setting(problem, per_motion=True, prior_std=PRIOR_STD)
        plain = fit_with(ready, [{} for _ in range(ready.n)], (), None)
    except (NotIdentifiable, NotConverged, TooFewRows):
        return None
    terms = torque_terms(problem, ready.shared, plain.own, plain.fit, compliance=True)
    theta = plain.fit.found.theta
    compliance = assumed_compliance(problem, ready.shared, theta)
    h = dict(zip(solution.joints.tolist(), solution.inverse.tolist(), strict=True))
    parts = [h.get(joint, 0.0) * (each @ compliance) for joint, each in enumerate(terms.softened)]
    return np.concatenate([parts[joint] for joint in solution.rows.unknowns])
