"""Each joint's gain from its own rows alone against that of all joints together: do links fit each other's joints?

Links that several joints feel tie their gains together. A joint that is wrong about them, by its sensor, the
kinematics or its friction, pulls at the others' gains; alone it says something else.
"""

from collections.abc import Sequence

import numpy as np

from ident.consistency.difference import DIFFERENT, difference_std, judged_difference
from ident.consistency.evidence import Evidence
from ident.consistency.finding import Finding
from ident.consistency.part import part_of

NAME = "joints"
TORN_Z, TORN = 8.0, 1.5
"""Deviations of that difference, and percent of a gain, from which no gain is to be believed.

Sound recordings reach 4.1, those with one joint's currents off by a fifth or a zero wrong in one log 8 to 24.
"""


def check_joints(evidence: Evidence) -> Finding | None:
    """Whether each joint alone gives the gain that all give; None for methods that solve each alone."""
    fit, solution = evidence.fit, evidence.estimate.solution
    rows = solution.rows
    alone = [not own[rows.joint != joint].any() for joint, own in zip(solution.joints, solution.influence, strict=True)]
    if fit is None or all(alone):
        return None
    granted = np.linalg.norm(solution.model, axis=1)
    change, z = dict[int, float](), dict[int, float]()
    of_joint = np.arange(len(fit.gram)) // 2
    own_gain = {joint: [evidence.identified[joint]] if joint in evidence.identified else [] for joint in rows.unknowns}
    parts = {joint: part_of(fit, of_joint == joint, places) for joint, places in own_gain.items()}
    residual = sum((each.residual for each in parts.values()), start=np.zeros(len(rows.V)))
    for joint, k in evidence.identified.items():
        part = parts[joint].changes.get(k)
        own = 0.0 if part is None else difference_std(evidence, part.influence, residual)
        if part is not None and own > DIFFERENT * evidence.std(k):
            size = abs(float(solution.inverse[k]))
            change[joint] = -100.0 * part.value / float(solution.inverse[k])  # of g = 1/x
            z[joint] = abs(part.value) / size / float(np.hypot(own / size, granted[k]))
    words = ("its own currents alone give", "than all joints together")
    reason = "suspect its friction, its zero, lengths of the model, or the payload's centre and inertia"
    return judged_difference(NAME, z, change, words, reason, claimed={joint: evidence.rel_std(joint) for joint in z})


def torn(findings: Sequence[Finding]) -> str | None:
    """Why no gain of joints that contradict each other so much is to be believed; None where they do not."""
    for each in findings:
        if each.check == NAME and each.change is not None and each.statistic > TORN_Z and abs(each.change) > TORN:
            return (
                f"joints contradict each other: those of joint {each.joint + 1} alone give a gain "
                f"{abs(each.change):.2g} % off that of all, by {each.statistic:.2g} standard deviations"
            )
    return None
