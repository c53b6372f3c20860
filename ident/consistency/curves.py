"""What is left of a joint's current against its position and its speed: does a smooth curve explain some of it?

The curve's columns are cleared of all that the fit explains, `P' = P - Q Q' P`, so that its coefficients are those that
it would have beside the model. Under the model their normal equations `S = P'^T e` are zero but for noise; errors that
last make S larger by the ratio of its sums over stretches of time to what unrelated residuals give.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.polynomial import legendre
from scipy import linalg

from ident.arrays import Array, readonly
from ident.consistency.difference import FALSE_ALARM
from ident.consistency.evidence import Evidence
from ident.consistency.finding import Finding
from ident.consistency.stretches import stretches

DEGREE = 6
"""Of the polynomials in the position, and of those in the speed in either direction."""
NEW = 1e-4
"""Part of a column, in square, that the fit must leave for it to be tried."""
LARGE = 0.15
"""Share of a residual's square that is worth a word whatever it does to the gain."""
MATTERS = 0.5
"""Change of a gain, in deviations of it, that is worth a word.

Friction beside reversals leaves 5 % of the residual on the RX-90 for a curve, beyond any doubt, and moves no gain by a
fifth of its deviation.
"""


@dataclass(frozen=True, slots=True)
class Curve:
    """What a smooth curve explains of a joint's residual.

    Attributes:
        share: Of its square.
        chi_square: Size of its coefficients in squared deviations.
        freedom: Their number.
        moved: Relative change of the gain of the joint if it is added to the model.
    """

    share: float
    chi_square: float
    freedom: int
    moved: float


def check_position(evidence: Evidence) -> Finding | None:
    """Whether what is left depends on the joint's position."""
    return _found(evidence, "position", lambda q, dq: _polynomials(_scaled(q), DEGREE))


def check_speed(evidence: Evidence) -> Finding | None:
    """Whether what is left depends on the joint's speed."""

    def columns(q: Array, dq: Array) -> Array:
        fast = np.abs(dq)
        even = np.column_stack((np.ones_like(fast), _polynomials(_scaled(fast), DEGREE // 2)))
        return np.hstack((even[:, 1:], np.sign(dq)[:, None] * even[:, 1:]))

    return _found(evidence, "speed", columns)


def _found(evidence: Evidence, name: str, columns: Callable[[Array, Array], Array]) -> Finding | None:
    curves = {joint: curve for joint in evidence.identified if (curve := residual_curve(evidence, joint, columns))}
    if not curves:
        return None
    chance = {joint: float(scipy.stats.chi2.sf(each.chi_square, each.freedom)) for joint, each in curves.items()}
    limit = FALSE_ALARM / len(curves)  # Bonferroni
    failed = {
        joint: each
        for joint, each in curves.items()
        if chance[joint] < limit and (each.share > LARGE or abs(each.moved) > MATTERS * evidence.rel_std(joint))
    }
    worst = min(failed or chance, key=lambda joint: chance[joint])
    return Finding(
        check=name,
        joint=worst,
        statistic=curves[worst].chi_square,
        threshold=float(scipy.stats.chi2.isf(limit, curves[worst].freedom)),
        measure="squared deviations",
        sentence=_sentence(name, failed) if failed else None,
    )


def _sentence(name: str, failed: Mapping[int, Curve]) -> str:
    said = "; ".join(
        f"joint {joint + 1}: a smooth curve explains {100.0 * each.share:.2g} % of its square and would move the gain "
        f"by {100.0 * abs(each.moved):.2g} %"
        for joint, each in failed.items()
    )
    suspects = {
        "position": "gravity that the model lacks (a spring, a cable), the kinematics, or friction that depends on it",
        "speed": "a friction law of another shape",
    }
    return f"what the model leaves depends on the joint's own {name}: {said}; suspect {suspects[name]}"


def residual_curve(evidence: Evidence, joint: int, columns: Callable[[Array, Array], Array]) -> Curve | None:
    """What a curve explains of what is left of a joint's current; None where the fit knows every such curve already.

    Args:
        evidence: The estimate.
        joint: The joint, from 0.
        columns: The curve's, of positions and speeds of shape (r,), shape (r, c).
    """
    solution = evidence.estimate.solution
    rows, states = solution.rows, evidence.states(joint)
    if states is None:
        return None
    own = rows.of(joint)
    weight, residual, Q = rows.weight[own], rows.weight[own] * rows.residual[own], rows.explained[own]
    P = weight[:, None] * columns(*states)
    length = np.linalg.norm(P, axis=0)
    P = P[:, length > 0.0] / length[length > 0.0]
    known = Q.T @ P
    size, directions = linalg.eigh(P.T @ P - known.T @ known)
    seen = size > NEW
    if not seen.any():
        return None
    P, known = P @ (directions[:, seen] / np.sqrt(size[seen])), known @ (directions[:, seen] / np.sqrt(size[seen]))
    S = P.T @ residual - known.T @ evidence.pull
    variance = float((weight[0] * rows.sigma(joint)) ** 2)
    sums = stretches((P - Q @ known) * residual[:, None], rows.motion[own], rows.position[own])
    lasting = max(1.0, float(np.sum(sums**2)) / (len(S) * variance))
    change = -(solution.influence[evidence.identified[joint], own] / weight) @ P @ S  # of 1/g, less what it explains
    return Curve(
        share=float(S @ S) / float(residual @ residual),
        chi_square=float(S @ S) / (variance * lasting),
        freedom=len(S),
        moved=-float(change) / float(solution.inverse[evidence.identified[joint]]),
    )


def _scaled(x: Array) -> Array:
    """From -1 to 1."""
    low, high = float(x.min()), float(x.max())
    return (2.0 * x - low - high) / max(high - low, 1e-300)


def _polynomials(x: Array, degree: int) -> Array:
    """Legendre's, of degree 1 on, shape (r, degree)."""
    return readonly(legendre.legvander(x, degree)[:, 1:])
