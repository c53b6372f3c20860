"""The payload's inertial parameters with given drive gains (paper, section III.A, eq. 23 to 25).

    g V = [W_a 0    0   ] [chi   ]
          [W_b W_ul W_kl] [chi_ul]        all joints stacked, each joint's rows weighted by its own residual (eq. 22)
                          [chi_kl]

Identified gains are uncertain. The solution is linear in them, so their contribution to the covariance is exact: the
derivative of chi with respect to g_j is the solution with left side V on joint j's rows and zero elsewhere.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ident.estimation.joint_by_joint.pooled_system import PooledSystem
from ident.model.parameters import INERTIAL
from ident.numerics.least_squares import least_squares, row_weights
from ident.support.arrays import Array
from ident.support.errors import NotIdentifiable, PayloadError

ESSENTIAL_REL_STD = 0.1
"""Relative standard deviation below which a parameter is essential, as usual with IDIM-LS."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PayloadParameter:
    """One inertial parameter of the payload at the origin of the last frame.

    Attributes:
        name: One of `INERTIAL`.
        value: Estimate, or the given value [kg m^2, kg m or kg].
        residual_std: Standard deviation from the residual (eq. 20), 0 if given.
        gain_std: Standard deviation from the uncertainty of the gains, 0 if given.
        known: Whether the value was given.
    """

    name: str
    value: float
    residual_std: float
    gain_std: float
    known: bool

    @property
    def std(self) -> float:
        """Total standard deviation from residual and gains."""
        return float(np.hypot(self.residual_std, self.gain_std))

    @property
    def rel_std(self) -> float:
        """Relative standard deviation from the residual (eq. 21, as a share), inf for an estimate of zero."""
        return self.residual_std / abs(self.value) if self.value else float("inf")

    @property
    def essential(self) -> bool:
        """Whether it was identified with a relative standard deviation below `ESSENTIAL_REL_STD`."""
        return not self.known and self.rel_std < ESSENTIAL_REL_STD


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PayloadEstimate:
    """A payload identified with given gains.

    Attributes:
        parameters: The ten parameters, in the order of `INERTIAL`.
        covariance: Total covariance of all ten from residual and gains, zero for given ones, shape (10, 10).
        gain: The given gains [N m / drive unit], shape (n,).
        method: "ols" or "wls".
        unknowns: Number of estimated arm and payload parameters.
        error_norm: Norm of the residual of the solved system, which is weighted for "wls" (table 4 of the paper).
        rel_error_norm: `error_norm` over the norm of its left side.
        sigma: Standard deviation of the residual (eq. 19).
        system: Its rows.
        torque: Torques of the fitted model on those rows [N m], shape (r,).
    """

    parameters: tuple[PayloadParameter, ...]
    covariance: Array
    gain: Array
    method: str
    unknowns: int
    error_norm: float
    rel_error_norm: float
    sigma: float
    system: PooledSystem
    torque: Array

    def __getitem__(self, name: str) -> PayloadParameter:
        """The parameter of that name."""
        return self.parameters[INERTIAL.index(name)]


def payload_parameters(
    system: PooledSystem,
    gain: Array,
    *,
    gain_std: Array,
    known: Mapping[str, float],
    weighted: bool,
    rank_tol: float = 1e-7,
) -> PayloadEstimate:
    """Identify arm and payload together with given gains (paper, eq. 25).

    Args:
        system: Rows of unloaded and loaded motions of an arm with n joints.
        gain: Given drive gains [N m / drive unit], shape (n,).
        gain_std: Their standard deviations, zero for gains taken as exact, shape (n,). Gains are assumed independent of
            the rows; for gains identified from the same rows the result is conservative.
        known: Given payload parameters by name; the others are identified.
        weighted: Whether each joint's rows are weighted by its own residual (eq. 22).
        rank_tol: Smallest relative singular value for full rank.

    Returns:
        All ten payload parameters and the quality of the fit.

    Raises:
        PayloadError: If gains have the wrong length or are not finite, or the name of a known parameter is wrong.
        NotIdentifiable: If no row has a payload.
        NotExcited: If the motions do not determine every unknown.
    """
    n = int(system.joint.max()) + 1
    gain, gain_std = np.asarray(gain, dtype=np.float64), np.asarray(gain_std, dtype=np.float64)
    for label, values in (("gain", gain), ("gain_std", gain_std)):
        if values.shape != (n,) or not np.isfinite(values).all():
            raise PayloadError(
                f"{label}: {values.size} values {values.tolist()}; expected {n} finite numbers, one per joint"
            )
    for name in known:
        if name not in INERTIAL:
            raise PayloadError(f"payload parameter {name!r} is not one of {', '.join(INERTIAL)}")
    if not system.loaded.any():
        raise NotIdentifiable("no loaded motion; without one the payload cannot be identified")
    given = np.array([name in known for name in INERTIAL])
    chi = np.array([known.get(name, 0.0) for name in INERTIAL])
    torque = gain[system.joint] * system.V
    W = np.hstack((system.W, system.W_L[:, ~given]))
    Y = torque - system.W_L @ chi
    weight = row_weights(W, Y, system.joint) if weighted else np.ones(len(Y))
    fit = least_squares(W * weight[:, None], Y * weight, rank_tol=rank_tol)
    b = system.W.shape[1]
    chi[~given] = fit.x[b:]
    of_joint = np.eye(n)[system.joint] * (weight * system.V)[:, None]  # derivative of the left side by each gain
    spread = (fit.cofactor @ (W * weight[:, None]).T @ of_joint)[b:] * gain_std  # (unknown payload parameters, n)
    std, gain_spread = np.zeros(10), np.zeros(10)
    std[~given], gain_spread[~given] = fit.std[b:], np.linalg.norm(spread, axis=1)
    covariance = np.zeros((10, 10))
    covariance[np.ix_(~given, ~given)] = fit.covariance[b:, b:] + spread @ spread.T
    error_norm = float(np.linalg.norm(fit.residual))
    return PayloadEstimate(
        parameters=tuple(
            PayloadParameter(
                name=name,
                value=float(chi[k]),
                residual_std=float(std[k]),
                gain_std=float(gain_spread[k]),
                known=bool(given[k]),
            )
            for k, name in enumerate(INERTIAL)
        ),
        covariance=covariance,
        gain=gain,
        method="wls" if weighted else "ols",
        unknowns=W.shape[1],
        error_norm=error_norm,
        rel_error_norm=error_norm / float(np.linalg.norm(torque * weight)),
        sigma=fit.sigma,
        system=system,
        torque=system.W @ fit.x[:b] + system.W_L @ chi,
    )
