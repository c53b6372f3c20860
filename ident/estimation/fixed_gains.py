"""Gains that are held in the model of all joints, and what their uncertainty adds to whatever is found beside them.

A gain is held by a row of the prior on log h, of next to no deviation (`GivenGain`). What that row does to an estimate
is exact to first order what the gain does, so that the covariance of the gains takes the place of the row's.
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
    """The gains, to be held."""
    return [GivenGain(int(j), float(g)) for j, g in zip(gains.joints, gains.value, strict=True)]


def braked_gain(columns: Sequence[JointColumns], *, per_motion: bool) -> GivenGain:
    """A gain of size 1 for the joint whose friction shows surest, with the sign by which it brakes.

    Args:
        columns: Rows of every joint, n.
        per_motion: Whether friction differs between motions.
    """
    z = list[float]()
    for each in columns:
        own = own_columns(each, {}, per_motion=per_motion)
        z.append(friction_z(reduced_joint(each, own), own.names))
    surest = int(np.argmax(np.abs(z)))
    return GivenGain(surest, -1.0 if z[surest] < 0.0 else 1.0)


def gain_sensitivity(belief: Array, gains: KnownGains) -> Array:
    """Change of parameters per change of the logarithm of each gain that is held, shape (p, k).

    Args:
        belief: Their change per deviation of every belief, those on the n gains last, shape (p, beliefs).
        gains: Those that are held, k of n.
    """
    return -belief[:, -len(gains.names) :][:, gains.joints] / GIVEN_STD  # log h = -log g


def own_beliefs(belief: Array, gains: KnownGains) -> Array:
    """Change of parameters per deviation of every belief but those in gains that are held, shape (p, beliefs - k).

    Args:
        belief: As for `gain_sensitivity`.
        gains: Those that are held, k of n.
    """
    of_gains = np.zeros(belief.shape[1], dtype=bool)
    of_gains[belief.shape[1] - len(gains.names) + gains.joints] = True
    return belief[:, ~of_gains]


def gain_covariance(belief: Array, gains: KnownGains) -> Array:
    """Covariance of parameters from that of the gains that are held, shape (p, p).

    Args:
        belief: As for `gain_sensitivity`.
        gains: Those that are held.
    """
    by_gain = gain_sensitivity(belief, gains)
    return by_gain @ gains.log_covariance @ by_gain.T
