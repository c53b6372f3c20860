"""Gains that are fixed in the model of all joints, and the contribution of their uncertainty to other estimates.

A gain is fixed by a prior on log h with a very small standard deviation (`GivenGain`). To first order the sensitivity
of an estimate to this prior is its sensitivity to the gain, so the covariance of the gains replaces that of the prior.
"""

from collections.abc import Sequence

import numpy as np

from ident.estimation.all_joints.columns import JointColumns
from ident.estimation.all_joints.friction import own_columns
from ident.estimation.all_joints.reduction import reduced_joint
from ident.estimation.all_joints.solution import GIVEN_STD, GivenGain
from ident.estimation.all_joints.start import friction_z
from ident.estimation.known_gains import KnownGains
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


def gain_sensitivity(belief: Array, gains: KnownGains) -> Array:
    """Derivative of parameters by the logarithm of each fixed gain, shape (p, k).

    Args:
        belief: Their change per standard deviation of each prior, those of the n gains last, shape (p, beliefs).
        gains: The fixed gains, k of n.
    """
    return -belief[:, -len(gains.names) :][:, gains.joints] / GIVEN_STD  # log h = -log g


def own_beliefs(belief: Array, gains: KnownGains) -> Array:
    """Change of parameters per standard deviation of each prior except those of fixed gains, shape (p, beliefs - k)."""
    of_gains = np.zeros(belief.shape[1], dtype=bool)
    of_gains[belief.shape[1] - len(gains.names) + gains.joints] = True
    return belief[:, ~of_gains]


def gain_covariance(belief: Array, gains: KnownGains) -> Array:
    """Contribution of the fixed gains' covariance to that of parameters, shape (p, p)."""
    by_gain = gain_sensitivity(belief, gains)
    return by_gain @ gains.log_covariance @ by_gain.T
