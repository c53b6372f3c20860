"""Loss of a residual: its square, or that of Student's distribution.

If the residuals e of a joint, u = e / s, follow Student's distribution with f degrees of freedom, the most likely
unknowns satisfy sum J psi(u) = 0, with J the Jacobian. The currents

    V* = V - e + s psi(u) / mean(psi'(u))        psi(u) = (f + 1) u / (f + u^2)

fitted by least squares have the same solution, and the least-squares covariance is the sandwich estimate s^2 sum(psi^2)
/ (r - p) / mean(psi')^2 (J^T J)^-1 (Huber and Ronchetti 2009, sections 7.6 and 7.8). So everything that uses a
least-squares fit, such as cross-validation, can use this one.
"""

from collections.abc import Callable, Sequence

import numpy as np

from ident.estimation.all_joints.columns import JointColumns
from ident.estimation.all_joints.reduction import ROUNDING
from ident.estimation.all_joints.solution import Fitted, fit_again
from ident.support.arrays import Array
from ident.support.errors import NotIdentifiable

FREEDOM = 4.0
"""Degrees of freedom of Student's distribution: heavy tails with little loss of efficiency for normal errors."""
GAUSSIAN = 1.4826
"""Ratio of standard deviation to median absolute value of a normal distribution."""
SETTLED = 1e-9
"""Largest change of the logarithm of a gain between fits at convergence."""
MOST_FITS = 100
Tame = Callable[[Array, Array], Array]
"""`(e, V) -> e*`: a joint's residuals, replaced such that least squares minimises the loss, shape (r,)."""


def student(e: Array, V: Array) -> Array:
    """Replace residuals by Student's distribution; its scale s is from the median of their magnitude.

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
"""Replacement of residuals by loss; None: residuals are used as they are."""


def settled(first: Fitted, given: Sequence[JointColumns], tame: Tame) -> Fitted:
    """Repeat the fit until the replaced currents are consistent with its residuals.

    Args:
        first: The model and the initial values.
        given: Rows of every joint with the original currents.
        tame: Replacement of the residuals.

    Returns:
        The fit of the currents V*, with their residuals.

    Raises:
        NotIdentifiable: If the iteration does not converge.
    """
    fitted = first
    for _ in range(MOST_FITS):
        left = [(each.V, _residual(fitted, each)) for each in given]
        before, fitted = fitted, fit_again(fitted, [V - e + tame(e, V) for V, e in left])
        if np.abs(np.log(fitted.fit.found.h / before.fit.found.h)).max() < SETTLED:
            return fitted
    raise NotIdentifiable(
        f"with Student's loss the gains do not converge in {MOST_FITS} fits: too many outliers; check the "
        "currents, or set loss = squares"
    )


def drawn_in(fitted: Fitted, given: Sequence[JointColumns]) -> float:
    """Share of the rows whose residual was reduced to less than half; arguments as `settled`."""
    e = np.concatenate([_residual(fitted, each) for each in given])
    return float(np.mean(np.abs(fitted.fit.rows.residual) < 0.5 * np.abs(e)))


def _residual(fitted: Fitted, given: JointColumns) -> Array:
    """Residuals of a joint's original currents, shape (r,)."""
    rows = fitted.fit.rows
    own = rows.of(given.joint)
    return given.V - rows.V[own] + rows.residual[own]
