"""Gains that are fixed in the model of all joints, and what their uncertainty adds to that of other parameters.

A gain is fixed by a prior on log h with a very small standard deviation (`GivenGain`). To first order the sensitivity
of a parameter to this prior is its sensitivity to the gain, so the covariance of the gains replaces that of the prior:

    C = C_residual + S cov(log g) S^T + B B^T,    S = -d parameter / d log h,

where B has the change per standard deviation of every other prior, and the weighted difference of each alternative
model.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.estimation.all_joints.columns import JointColumns
from ident.estimation.all_joints.friction import own_columns
from ident.estimation.all_joints.reduction import reduced_joint
from ident.estimation.all_joints.solution import GIVEN_STD, GivenGain
from ident.estimation.all_joints.start import friction_z
from ident.estimation.gain_options import GainOptions
from ident.estimation.known_gains import KnownGains
from ident.estimation.rows import Rows
from ident.estimation.uncertainty import UNCERTAINTIES
from ident.support.arrays import Array


def held(gains: KnownGains) -> list[GivenGain]:
    """Return the gains as fixed gains."""
    return [GivenGain(int(j), float(g)) for j, g in zip(gains.joints, gains.value, strict=True)]


def braked_gain(columns: Sequence[JointColumns], *, per_motion: bool) -> GivenGain:
    """Return a gain of magnitude 1 for the joint with the most significant friction, signed so that friction brakes.

    Args:
        columns: Rows of each of the n joints.
        per_motion: Whether friction differs between motions.
    """
    z = list[float]()
    for each in columns:
        own = own_columns(each, {}, per_motion=per_motion)
        z.append(friction_z(reduced_joint(each, own), own.names))
    surest = int(np.argmax(np.abs(z)))
    return GivenGain(surest, -1.0 if z[surest] < 0.0 else 1.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shares:
    """Covariance of p parameters: from residuals, from the gains, and from the model's assumptions, each (p, p)."""

    residual: Array
    gains: Array
    model: Array

    @property
    def total(self) -> Array:
        """Their sum, shape (p, p)."""
        return self.residual + self.gains + self.model

    def of(self, J: Array) -> "Shares":
        """Covariance of J times the parameters, J of shape (k, p)."""
        return Shares(residual=J @ self.residual @ J.T, gains=J @ self.gains @ J.T, model=J @ self.model @ J.T)


def shares(
    rows: Rows, options: GainOptions, gains: KnownGains | None, *, influence: Array, belief: Array, rivals: Array
) -> Shares:
    """Return the covariance of p parameters of a fit.

    Args:
        rows: Rows of the fit.
        options: Method for the uncertainty from residuals.
        gains: Fixed gains, k of n; None if only the scale of one is given.
        influence: Derivative of the parameters by the current of each row, shape (p, r).
        belief: Their change per standard deviation of each prior, those of the n gains last, shape (p, beliefs).
        rivals: Their change with each alternative model, shape (p, rivals).
    """
    residual = UNCERTAINTIES[options.uncertainty](rows, influence)
    of_gains = np.zeros_like(residual)
    if gains is not None:
        at = belief.shape[1] - len(gains.names) + gains.joints
        S = -belief[:, at] / GIVEN_STD
        belief, of_gains = np.delete(belief, at, axis=1), S @ gains.log_covariance @ S.T
    B = np.hstack((belief, rivals))
    return Shares(residual=residual, gains=of_gains, model=B @ B.T)


def deviations(covariance: Array) -> Array:
    """Return standard deviations; negative variances due to rounding are 0."""
    return np.sqrt(np.maximum(np.diag(covariance), 0.0))
