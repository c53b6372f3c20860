"""The currents that joints as soft as drives may be would add, whatever the method."""

import numpy as np

from ident.all_joints.unmodelled import unmodelled
from ident.arrays import Array
from ident.consistency.evidence import Evidence


def soft_currents(evidence: Evidence) -> Array | None:
    """Change of each row's current [drive units], shape (r,); None where no torques are found that it follows from.

    A method that has no torques of all joints has those of a fit of stiff joints with plain friction.
    """
    problem, solution = evidence.problem, evidence.estimate.solution
    if solution.softened is not None:
        return solution.softened
    lacking = unmodelled(problem)
    if lacking is None:
        return None
    h = dict(zip(solution.joints.tolist(), solution.inverse.tolist(), strict=True))
    parts = [h.get(joint, 0.0) * (each @ lacking.compliance) for joint, each in enumerate(lacking.terms.softened)]
    return np.concatenate([parts[joint] for joint in solution.rows.unknowns])
