"""Motions with a bare flange against each other: did friction, offset or what is left change between them?

Each joint's rows of the bare motions are solved alone, with the arm's own parameters for all of them, and friction and
offset anew from the second on. What is new is the drift, whatever the payload and the method are.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from scipy import linalg

from ident.column_space import NEW, column_space
from ident.consistency.difference import FALSE_ALARM, most_deviations
from ident.consistency.evidence import Evidence
from ident.consistency.finding import Finding
from ident.gain_system import joint_rows
from ident.problem import Problem
from ident.rows import Rows
from ident.uncertainty.larger import larger

NAME = "bare"
DRIFTS = {"Fv": "viscous friction", "Fc": "Coulomb friction", "off": "the offset"}
"""What may be new in a later bare motion, by the name of its parameter."""
LEAST = 0.002
"""Change of a current, as a share of the joint's rms, that is worth a word."""
LOUDER = 1.3
"""Ratio of what is left of two bare motions that is worth a word."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Drift:
    """What changed on a joint from the first bare motion to a later one.

    Attributes:
        joint: The joint, from 0.
        what: In words.
        motion: Place of the later motion in the problem.
        share: Change of the current over the joint's rms current, or of the residual's deviation over itself.
        z: The same in standard deviations.
        harmless: Whether the estimate lets it change.
        told: Whether it is large enough for a word.
    """

    joint: int
    what: str
    motion: int
    share: float
    z: float
    harmless: bool
    told: bool


def check_bare(evidence: Evidence) -> Finding | None:
    """Whether bare motions say the same of friction and offset; None where there is one, or none."""
    problem = evidence.problem
    bare = [k for k, motion in enumerate(problem.motions) if motion.payload is None]
    if len(bare) < 2:
        return None
    joints = range(problem.structure.arm.n)
    drifts = [each for joint in joints for each in bare_drifts(problem, joint, bare, drift=evidence.drift)]
    if not drifts:
        return None
    limit = most_deviations(len(drifts))
    failed = [each for each in drifts if each.told and abs(each.z) > limit]
    worst = max(failed or drifts, key=lambda each: abs(each.z))
    return Finding(
        check=NAME,
        joint=worst.joint,
        statistic=abs(worst.z),
        threshold=limit,
        measure="standard deviations",
        sentence=_sentence(bare[0], failed) if failed else None,
    )


def _sentence(first: int, failed: Sequence[Drift]) -> str:
    said = "; ".join(
        f"joint {each.joint + 1}: {each.what} by {100.0 * each.share:+.2g} % of its {_unit(each)} "
        f"in motion {each.motion + 1}"
        for each in failed
    )
    harm = (
        "the fit lets friction differ between motions"
        if all(each.harmless for each in failed)
        else "the fit takes it as constant, and the deviations do not contain it; warm the drives up before recording"
    )
    return f"bare motions differ from motion {first + 1} ({FALSE_ALARM:.1%} by accident): {said}; {harm}"


def _unit(each: Drift) -> str:
    return "deviation" if each.what == RESIDUAL else "rms current"


RESIDUAL = "what the model leaves changed"


def bare_drifts(problem: Problem, joint: int, bare: Sequence[int], *, drift: bool) -> list[Drift]:
    """What changed on a joint, from 0, from the first bare motion to each later one.

    Args:
        problem: Motions and payloads.
        joint: The joint.
        bare: Places of the bare motions, two or more.
        drift: Whether the estimate lets friction differ between motions.
    """
    rows = joint_rows(problem, joint)
    own = np.isin(rows.motion, bare)
    W, V, motion = rows.W[own], rows.V[own], rows.motion[own]
    new = [
        (name, later, W[:, rows.names.index(f"{name}{joint + 1}")] * (motion == later))
        for later in bare[1:]
        for name in DRIFTS
        if f"{name}{joint + 1}" in rows.names
    ]
    common = column_space(W)
    if not new:
        return []
    columns = np.column_stack([column for _, _, column in new])
    size = np.sqrt(np.sum(columns**2, axis=0) / np.array([max(1, np.sum(motion == later)) for _, later, _ in new]))
    fresh = columns - common @ (common.T @ columns)
    Q, R = linalg.qr(fresh, mode="economic")
    freedom = len(V) - common.shape[1] - len(new)
    if freedom < 1 or (np.abs(np.diag(R)) < NEW * np.linalg.norm(columns, axis=0)).any():
        return []
    influence = linalg.solve_triangular(R, Q.T)
    value, residual = influence @ V, V - common @ (common.T @ V)
    residual = residual - Q @ (Q.T @ residual)
    fitted = Rows(
        V=V, residual=residual, joint=np.full(len(V), joint), motion=motion, position=rows.position[own],
        row_period=problem.row_period, unknowns={joint: len(V) - freedom}, weight=np.ones(len(V)),
        explained=np.zeros((len(V), 0)),
    )  # fmt: skip
    std = np.sqrt(np.diag(larger(fitted, influence, problem.options.serial_s)))
    rms = fitted.rms_current(joint)
    found = [
        Drift(
            joint=joint,
            what=f"{DRIFTS[name]} changed",
            motion=later,
            share=float(value[k] * size[k]) / rms,
            z=float(value[k] / std[k]),
            harmless=drift and name != "off",
            told=abs(float(value[k] * size[k])) > LEAST * rms,
        )
        for k, (name, later, _) in enumerate(new)
    ]
    return found + [_louder(fitted, joint, bare[0], later, freedom / len(V)) for later in bare[1:]]


def _louder(fitted: Rows, joint: int, first: int, later: int, free: float) -> Drift:
    """Whether more or less is left of a later motion; F of both mean squares, as deviations of a normal variable."""
    squares, freedom = list[float](), list[float]()
    for motion in (first, later):
        left = fitted.residual[fitted.motion == motion]
        squares.append(float(left @ left) / len(left))
        freedom.append(0.5 * free * len(left))  # neighbours hang together
    ratio = squares[1] / max(squares[0], 1e-300)
    tail = min(scipy.stats.f.sf(ratio, freedom[1], freedom[0]), scipy.stats.f.cdf(ratio, freedom[1], freedom[0]))
    return Drift(
        joint=joint,
        what=RESIDUAL,
        motion=later,
        share=float(np.sqrt(ratio)) - 1.0,
        z=float(scipy.stats.norm.isf(max(float(tail), 1e-300))),
        harmless=False,
        told=max(ratio, 1.0 / max(ratio, 1e-300)) > LOUDER**2,
    )
