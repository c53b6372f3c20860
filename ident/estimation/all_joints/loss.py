"""What a residual counts: its square, or what Student's distribution makes of it.

Residuals e of a joint, u = e / s, that follow Student's distribution with f degrees of freedom ask of the unknowns,
whose Jacobian is J, that sum J psi(u) = 0. The currents

    V* = V - e + s psi(u) / mean(psi'(u))        psi(u) = (f + 1) u / (f + u^2)

fitted by least squares have the same solution, and what least squares says about its covariance is the sandwich
s^2 sum(psi^2) / (r - p) / mean(psi')^2 (J^T J)^-1 (Huber and Ronchetti 2009, sections 7.6 and 7.8). So whatever reads a
fit by least squares, left-out stretches of time included, reads this one.
"""

from collections.abc import Callable, Sequence

import numpy as np

from ident.estimation.all_joints.columns import JointColumns
from ident.estimation.all_joints.reduction import ROUNDING
from ident.estimation.all_joints.solution import Fitted, fit_again
from ident.support.arrays import Array
from ident.support.errors import NotConverged

FREEDOM = 4.0
"""Degrees of freedom of Student's distribution: heavy tails that cost little where there are none."""
GAUSSIAN = 1.4826
"""Standard deviation over median of the absolute value, of a normal distribution."""
SETTLED = 1e-9
"""Largest change of the logarithm of a gain from one fit to the next at which currents are what they should be."""
MOST_FITS = 100
Tame = Callable[[Array, Array], Array]
"""`(e, V) -> e*`: a joint's residuals as least squares should see them, shape (r,)."""


def student(e: Array, V: Array) -> Array:
    """Residuals by Student's distribution, their deviation s from the median of their size.

    Args:
        e: Residuals of one joint [drive units], shape (r,).
        V: Its currents [drive units], shape (r,).
    """
    least = ROUNDING * float(np.sqrt(np.mean(V**2)))
    s = max(GAUSSIAN * float(np.median(np.abs(e))), least)
    u2 = (e / s) ** 2
    slope = (FREEDOM + 1.0) * (FREEDOM - u2) / (FREEDOM + u2) ** 2
    return (FREEDOM + 1.0) * e / (FREEDOM + u2) / float(slope.mean())


LOSSES: dict[str, Tame | None] = {"squares": None, "student": student}
"""What makes residuals what least squares should see; None where it should see them as they are."""


def settled(first: Fitted, given: Sequence[JointColumns], tame: Tame) -> Fitted:
    """Fit a model until residuals and what least squares should see of them belong together.

    Args:
        first: The model, and where to begin.
        given: Every joint's rows with their currents as they are.
        tame: What least squares should see of the residuals.

    Returns:
        A fit of the currents V* that least squares should see, with their residuals.

    Raises:
        NotConverged: If there is no end.
    """
    fitted = first
    for _ in range(MOST_FITS):
        left = [(each.V, _residual(fitted, each)) for each in given]
        before, fitted = fitted, fit_again(fitted, [V - e + tame(e, V) for V, e in left])
        if np.abs(np.log(fitted.fit.found.h / before.fit.found.h)).max() < SETTLED:
            return fitted
    raise NotConverged(
        f"with Student's loss the gains do not converge in {MOST_FITS} fits: too many outliers; check the "
        "currents, or set loss = squares"
    )


def drawn_in(fitted: Fitted, given: Sequence[JointColumns]) -> float:
    """Share of the rows whose residual least squares saw less than half of; arguments as `settled`."""
    e = np.concatenate([_residual(fitted, each) for each in given])
    return float(np.mean(np.abs(fitted.fit.rows.residual) < 0.5 * np.abs(e)))


def _residual(fitted: Fitted, given: JointColumns) -> Array:
    """What a fit leaves of a joint's currents, whatever currents it was made of, shape (r,)."""
    rows = fitted.fit.rows
    own = rows.of(given.joint)
    return given.V - rows.V[own] + rows.residual[own]
