"""Each joint's gain from its own rows alone against that of all joints together: do links fit each other's joints?

Links that several joints feel tie their gains together. A joint that is wrong about them, by its sensor, the
kinematics or its friction, pulls at the others' gains; alone it says something else.
"""

import numpy as np

from ident.consistency.difference import DIFFERENT, FALSE_ALARM, difference_std, most_deviations
from ident.consistency.evidence import Evidence
from ident.consistency.finding import Finding
from ident.consistency.part import part_changes

NAME = "joints"


def check_joints(evidence: Evidence) -> Finding | None:
    """Whether each joint alone gives the gain that all give; None for methods that solve each alone."""
    fit, solution = evidence.fit, evidence.estimate.solution
    rows = solution.rows
    alone = [not own[rows.joint != joint].any() for joint, own in zip(solution.joints, solution.influence, strict=True)]
    if fit is None or all(alone):
        return None
    granted = np.linalg.norm(solution.model, axis=1)
    change, z = dict[int, float](), dict[int, float]()
    for joint, k in evidence.identified.items():
        part = part_changes(fit, np.arange(len(fit.gram)) // 2 == joint, [k]).get(k)
        own = 0.0 if part is None else difference_std(evidence, part.influence, rows.residual)
        if part is not None and own > DIFFERENT * evidence.std(k):
            size = abs(float(solution.inverse[k]))
            change[joint] = -100.0 * part.value / float(solution.inverse[k])  # of g = 1/x
            z[joint] = abs(part.value) / size / float(np.hypot(own / size, granted[k]))
    if not z:
        return None
    worst, limit = max(z, key=lambda joint: z[joint]), most_deviations(len(z))
    return Finding(
        check=NAME,
        joint=worst,
        statistic=z[worst],
        threshold=limit,
        measure="standard deviations",
        sentence=None
        if z[worst] <= limit
        else f"joint {worst + 1}: its own currents alone give a gain {abs(change[worst]):.2g} % "
        f"{'larger' if change[worst] > 0.0 else 'smaller'} than all joints together, by {z[worst]:.2g} standard "
        f"deviations of that difference ({limit:.2g} on any of {len(z)} joints are an accident once in "
        f"{1.0 / FALSE_ALARM:.0f} times); suspect its friction, its zero, lengths of the model, or the payload's "
        "centre and inertia",
    )
