"""Friction in proportion to the load beside a gain: with one weight mounted the two may look the same.

A drive that loses c of its torque reads as if its gain were smaller by about c wherever the payload resists the motion.
Several different weights tell them apart; one often does not.
"""

from collections.abc import Mapping

import numpy as np

from ident.arrays import Array
from ident.consistency.evidence import Evidence
from ident.consistency.finding import Finding
from ident.consistency.hidden import SHOWN_MATTERS, hidden_effect

NAME = "load friction"
INSIDE = 0.7
"""Share of a deviation by what is not known of the coefficient that is worth a word: half of its square."""
USUAL = 0.06
"""Share of its torque that a geared drive loses at least, as published (6 to 15 %)."""


def check_single_load(evidence: Evidence) -> Finding | None:
    """Whether a gain hangs on load friction that one weight cannot show; None where weights differ or there is none."""
    masses = {payload.mass for payload in evidence.problem.payloads}
    if len(masses) != 1 or not evidence.identified:
        return None
    found = evidence.estimate.solution.load_friction
    if found is not None:
        unsure = {joint: float(abs(found.slope[k]) * found.std[k]) for joint, k in evidence.identified.items()}
        ratio = {joint: each / evidence.rel_std(joint) for joint, each in unsure.items()}
        slope = {joint: -float(found.slope[k]) for joint, k in evidence.identified.items()}
        suspected, most = set(ratio), INSIDE
        allowed = "the deviations contain what the friction of all joints lets expect"
    else:
        slope, ratio, suspected, most = dict[int, float](), dict[int, float](), set[int](), SHOWN_MATTERS
        for joint in evidence.identified:
            added = load_currents(evidence, joint)
            if added is not None:
                effect = hidden_effect(evidence, added)
                slope[joint] = effect.moved[joint] / USUAL
                ratio[joint] = effect.possible * abs(effect.moved[joint]) / evidence.rel_std(joint)
                if effect.suspected and ratio[joint] > effect.most:
                    suspected.add(joint)
        allowed = "the deviations do not contain it"
    if not ratio:
        return None
    worst = max(ratio, key=lambda joint: ratio[joint])
    failed = {joint: slope[joint] for joint in ratio if joint in suspected and ratio[joint] > most}
    return Finding(
        check=NAME,
        joint=worst,
        statistic=ratio[worst],
        threshold=most,
        measure="deviations of the gain",
        sentence=_sentence(failed, allowed) if failed else None,
    )


def _sentence(slopes: Mapping[int, float], allowed: str) -> str:
    moved = ", ".join(f"joint {joint + 1} by {each:+.2g} %" for joint, each in slopes.items())
    return (
        "one weight does not tell these gains from friction that grows with the load; each per cent of such friction "
        f"that the model lacks moves {moved}; {allowed}; a second, different weight tells them apart"
    )


def load_currents(evidence: Evidence, joint: int) -> Array | None:
    """Current of each row with a usual loss in proportion to the motor's torque on a joint [drive units], shape (r,).

    None where the arm has no Coulomb friction of its own on that joint, whose column has the signs.
    """
    problem, rows = evidence.problem, evidence.estimate.solution.rows
    names, added = problem.structure.base.names, np.zeros(len(rows.V))
    own = rows.of(joint)
    if f"Fc{joint + 1}" not in names:
        return None
    dry = names.index(f"Fc{joint + 1}")
    for run in rows.runs():
        if own.start <= run.start < own.stop:
            observed = problem.motions[int(rows.motion[run.start])].observation.joints[joint]
            column = np.flatnonzero(observed.columns == dry)
            at = np.searchsorted(observed.position, rows.position[run])
            forward = np.sign(observed.W[at][:, column].sum(axis=1))
            gain = np.sign(evidence.estimate.solution.inverse[evidence.identified[joint]])
            added[run] = USUAL * np.abs(rows.V[run]) * forward * gain
    return added
