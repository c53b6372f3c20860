"""A payload's centre of mass that lies elsewhere than stated: one shift for all joints would explain what is left.

The currents that a unit shift along each axis adds, `P = W_L dchi / dc` of all joints over their gains, are cleared of
all that the fit explains. What of the residual they explain together is the shift; what it would do to the gains is
the influence of the rows times the currents that it adds.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy

from ident.arrays import Array
from ident.consistency.difference import FALSE_ALARM
from ident.consistency.evidence import Evidence
from ident.consistency.finding import Finding
from ident.consistency.stretches import stretches
from ident.payload import Payload

NAME = "centre"
NEW = 1e-3
"""Part of a shift's currents that the fit must leave for the residual to show it."""
MATTERS = 1.0
"""Change of a gain by the shift, in deviations of that gain, that is worth a word."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shift:
    """Where a payload's centre of mass seems to lie.

    Attributes:
        value: From where it is stated to where it seems to be [m], shape (3,); none along what data do not show.
        std: Standard deviation, from the residuals [m], shape (3,).
        squares: Square of the shift in deviations, what is stated of the centre's among them.
        shown: Number of directions that data show.
        moved: Relative change of the gain of each joint with one, by joint, that the wrong centre makes.
    """

    value: Array
    std: Array
    squares: float
    shown: int
    moved: dict[int, float]


def check_centre(evidence: Evidence) -> Finding | None:
    """Whether some payload's centre seems to lie elsewhere; None where none is stated, or data do not show it."""
    payloads = evidence.problem.payloads
    shifts = {which: found for which in range(len(payloads)) if (found := centre_shift(evidence, which)) is not None}
    if not shifts or not evidence.identified:
        return None
    limits = {k: float(scipy.stats.chi2.isf(FALSE_ALARM / len(shifts), each.shown)) for k, each in shifts.items()}
    worst = max(shifts, key=lambda which: shifts[which].squares / limits[which])
    found, payload = shifts[worst], payloads[worst]
    ratio = {joint: abs(each) / evidence.rel_std(joint) for joint, each in found.moved.items()}
    joint = max(ratio, key=lambda joint: ratio[joint])
    matters = found.squares > limits[worst] and ratio[joint] > MATTERS
    return Finding(
        check=NAME,
        joint=joint,
        statistic=found.squares,
        threshold=limits[worst],
        measure="squared deviations of the shift",
        sentence=_sentence(payload, found, [each for each in ratio if ratio[each] > MATTERS]) if matters else None,
    )


def centre_shift(evidence: Evidence, which: int) -> Shift | None:
    """Where the centre of a payload, by its number, seems to lie; None if none is stated, or data do not show it."""
    payloads, solution = evidence.problem.payloads, evidence.estimate.solution
    if payloads[which].known not in ("all", "com") or evidence.fit is None:
        return None
    rows, Q = solution.rows, solution.rows.explained
    units = [per_metre(each) if k == which else np.zeros((10, 0)) for k, each in enumerate(payloads)]
    P = evidence.payload_currents(units)
    weighted = rows.weight[:, None] * P
    scale = rows.weight * evidence.sigma
    left, error = (weighted - Q @ (Q.T @ weighted)) / scale[:, None], rows.residual / evidence.sigma
    U, size, Vt = np.linalg.svd(left, full_matrices=False)
    shown = size > NEW * np.linalg.norm(P / evidence.sigma[:, None])
    if not shown.any():
        return None
    along = (U[:, shown] / size[shown]).T @ error  # coordinates in the directions that data show
    axes = Vt[shown].T
    terms = (U[:, shown] / size[shown]) * (error - left @ (axes @ along))[:, None]
    lasting = stretches(terms, rows.motion, rows.position)
    noise = np.diag(size[shown] ** -2.0) + lasting.T @ lasting  # of unrelated residuals, and of those that last
    stated = axes.T @ np.diag(np.square(payloads[which].com_std)) @ axes
    value = axes @ along
    moved = -(solution.influence @ (P @ value)) / solution.inverse  # of g = 1/x
    return Shift(
        value=value,
        std=np.sqrt(np.diag(axes @ noise @ axes.T)),
        squares=float(along @ np.linalg.solve(noise + stated, along)),
        shown=len(along),
        moved={joint: float(moved[k]) for joint, k in evidence.identified.items()},
    )


def per_metre(payload: Payload) -> Array:
    """Change of a payload's known standard parameters per metre of its centre along each axis, shape (10, 3)."""
    return replace(payload, com_std=(1.0, 1.0, 1.0)).known_part().spread[:, 1:4]


def _sentence(payload: Payload, found: Shift, joints: list[int]) -> str:
    """What the shift is, and what it does to the gains of joints, from 0."""
    millimetres = zip("xyz", 1e3 * found.value, 1e3 * found.std, strict=True)
    where = ", ".join(f"{axis} {value:+.2g} +- {std:.2g}" for axis, value, std in millimetres)
    gains = ", ".join(f"joint {joint + 1} by {100.0 * found.moved[joint]:+.2g} %" for joint in sorted(joints))
    return (
        f"the centre of mass of the payload of {payload.mass:g} kg seems to lie elsewhere than stated, by {where} mm "
        f"in the frame of the last link, which makes these gains wrong: {gains}; measure it, and mind axes and units. "
        "The deviations do not contain it"
    )
