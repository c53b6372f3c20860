"""Errors of gains according to a weighed payload, or to the links of a model file.

A factor common to all gains cancels in predictions of a bare motion, where the identified arm scales with the gains,
but not with a weighed payload: the ratio of the payload's identified to its specified torque is the ratio of each gain
to the correct one. Friction is free in both.
"""

from collections.abc import Sequence

import numpy as np

from ident.diagnosis.link_masses import LinkWeight, weight_of_links
from ident.estimation.cross_validation import TIME_BLOCKS
from ident.estimation.joint_by_joint.pooled_system import PooledSystem, pooled_system
from ident.estimation.known_gains import KnownGains
from ident.estimation.problem import ObservedMotion
from ident.model.parameters import INERTIAL
from ident.model.structure import independent_columns
from ident.payload.payload import Payload
from ident.support.arrays import Array, Mask

ROTOR = ("Ia", "Iam")
"""Inertia that an arm has beside its links."""


def gain_errors(
    system: PooledSystem,
    names: Sequence[str],
    payload: Payload,
    gains: KnownGains,
    fitted: Mask,
    *,
    base: Array,
    covariance: Array,
) -> dict[int, tuple[float, float]]:
    """Return the relative error of each gain according to the payload, and its standard deviation, by joint from 0.

    Parameters of an arm that was identified with a gain scale with this gain, those of the payload do not. Hence b of

        g V - W chi = b W_L chi_L + Fv dq + Fc sign(dq) + off

    is the ratio of the gain to the correct one, with any viscous and Coulomb friction. Its standard deviation combines
    a jackknife over time blocks with those of arm, payload and gain.

    Args:
        system: A motion with the payload.
        names: Names of the base parameters, b strings.
        payload: The payload as specified.
        gains: The gains.
        fitted: Whether the arm was identified with each of them; the payload says nothing of others.
        base: Base parameters of the arm, shape (b,).
        covariance: Their covariance from the residuals, shape (b, b).
    """
    found = dict[int, tuple[float, float]]()
    known, links = payload.known_part(), _named(names, (*INERTIAL, *ROTOR))
    for j, g, std, own in zip(gains.joints.tolist(), gains.value, gains.std, fitted, strict=True):
        at = np.flatnonzero(system.joint == j)
        torque_of_it, W = system.W_L[at] @ known.chi, system.W[at]
        X = np.column_stack((torque_of_it, _beside(W, links)))
        if not own or len(independent_columns(X, [np.arange(X.shape[1])])) < X.shape[1]:
            continue
        torque = g * system.V[at] - W @ base  # whatever its friction, which is free here
        first = np.linalg.pinv(X)[0]
        parts = np.array_split(np.arange(len(at)), TIME_BLOCKS)
        without = [float((np.linalg.pinv(np.delete(X, k, 0)) @ np.delete(torque, k))[0]) for k in parts]
        spread = float(np.std(without)) * np.sqrt(TIME_BLOCKS - 1)
        arm = first @ W
        moved = arm @ covariance @ arm + np.sum((first @ system.W_L[at] @ known.spread) ** 2)
        found[j] = float(first @ torque) - 1.0, float(np.sqrt(spread**2 + moved + (std / g) ** 2))
    return found


def link_weights(motions: Sequence[ObservedMotion], gains: KnownGains, base: Array) -> tuple[LinkWeight, ...]:
    """Return the ratio of each joint's measured torque, by its gain, to that of the links in a model file.

    Args:
        motions: A bare motion, in parts.
        gains: The gains to test.
        base: Base parameters of the arm in the model file, shape (b,).
    """
    system = pooled_system(motions)
    links = _named(motions[0].observation.structure.base.names, INERTIAL)
    rows = ((j, g, system.joint == j) for j, g in zip(gains.joints.tolist(), gains.value, strict=True))
    found = (
        weight_of_links(j, system.W[at][:, links] @ base[links], g * system.V[at], _beside(system.W[at], links))
        for j, g, at in rows
    )
    return tuple(each for each in found if each is not None)


def _named(base: Sequence[str], names: Sequence[str]) -> Mask:
    """Return a mask of the base parameters with one of these names, joint numbers ignored, shape (b,)."""
    return np.array([name.rstrip("0123456789") in names for name in base])


def _beside(W: Array, links: Mask) -> Array:
    """Return the nonzero columns of a joint's rows (r, b) other than those of links: friction and offset."""
    return W[:, ~links & W.any(axis=0)]
