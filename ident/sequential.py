"""Drive gains in sequence, from the payload's mass alone (paper, section III.B).

    1. the gains of the joints that the mass loads (eq. 27 with M known),
    2. with them, the payload's first moments from those joints (eq. 25),
    3. with the moments, the gains of the other joints (eq. 27 with M, MX, MY, MZ known).

The paper warns that errors accumulate. Here they are carried along: every result is, to first order, linear in the
noise of the currents, so the moments' covariance follows from the influence of each row on gains and moments
together (`docs/derivations.md`), and goes into the standard deviations of step 3.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from ident.arrays import Array, Indices
from ident.base import independent_columns, random_regressor
from ident.gains import GainEstimate, GainOptions, JointGain, gain_system, joint_gain
from ident.least_squares import least_squares, row_weights
from ident.observation import Observation
from ident.parameters import INERTIAL
from ident.payload import KnownPayload, Payload
from ident.stacked import StackedSystem, stacked_system
from ident.structure import PROBE_SEED, Structure

MOMENTS = ("MX", "MY", "MZ")


@dataclass(frozen=True, slots=True, eq=False)
class FirstMoments:
    """First moments of the payload found with identified gains.

    Attributes:
        value: MX, MY, MZ at the origin of the last frame [kg m], shape (3,).
        covariance: Noise of the moments' own rows and of the gains, correlation included, shape (3, 3).
    """

    value: Array
    covariance: Array


def sequential_gains(
    unloaded: Observation, loaded: Observation, payload: Payload, options: GainOptions
) -> GainEstimate:
    """Estimate drive gains joint group by joint group; only the payload's mass is used (paper, section III.B).

    Args:
        unloaded: Linear system of the motion with a bare flange.
        loaded: Linear system of the motion with the payload, same structure.
        payload: Its mass and mass_std count, nothing else.
        options: When a gain counts as identifiable.

    Returns:
        A gain or a reason for each joint.
    """
    structure = loaded.structure
    mass = replace(payload, known="mass").known_part()
    joints = [
        joint_gain(j, a, b, structure, mass, options)
        for j, (a, b) in enumerate(zip(unloaded.joints, loaded.joints, strict=True))
    ]
    found = [j for j, joint in enumerate(joints) if joint.value is not None]
    if found:
        moments = first_moments(unloaded, loaded, joints, mass, options)
        known = _with_moments(mass, moments)
        for j in set(range(structure.arm.n)) - set(found):
            joints[j] = _later_gain(j, unloaded, loaded, known, payload, options)
    return GainEstimate("sequential-2011", tuple(joints))


def first_moments(
    unloaded: Observation, loaded: Observation, joints: list[JointGain], mass: KnownPayload, options: GainOptions
) -> FirstMoments:
    """Find the payload's first moments from the joints whose gains are known (paper, eq. 25).

    Args:
        unloaded: Linear system of the motion with a bare flange.
        loaded: Linear system of the motion with the payload.
        joints: Gains found from the mass, or None as value.
        mass: The mass, known.
        options: As for the gains.
    """
    structure = loaded.structure
    found = [j for j, joint in enumerate(joints) if joint.value is not None]
    system = _rows_of(stacked_system([unloaded], [loaded]), found)
    gain = np.array([joint.value or 0.0 for joint in joints])
    arm, body = _independent(structure, found, mass)
    W = np.hstack((system.W[:, arm], system.W_L[:, body]))
    Y = gain[system.joint] * system.V - system.W_L[:, mass.mask] @ mass.chi[mass.mask]
    weight = row_weights(W, Y, system.joint)
    fit = least_squares(W * weight[:, None], Y * weight, rank_tol=options.rank_tol)
    P = fit.cofactor @ (W * weight[:, None] ** 2).T  # solution = P @ Y, shape (unknowns, r)
    at = [len(arm) + list(body).index(INERTIAL.index(name)) for name in MOMENTS if INERTIAL.index(name) in body]
    covariance = np.zeros((len(P), len(P)))
    for j in found:
        rows = system.joint == j
        parts = gain_system(j, unloaded.joints[j], loaded.joints[j], structure, mass)
        if parts is None:
            continue
        W_j, V_j, _ = parts
        own = least_squares(W_j, V_j, rank_tol=options.rank_tol)
        influence = W_j @ own.cofactor[-1]  # d(1/g_j) per unit of each row's noise
        both = gain[j] * P[:, rows] - gain[j] ** 2 * np.outer(P[:, rows] @ system.V[rows], influence)
        covariance += own.sigma**2 * both @ both.T
    value, spread = np.zeros(3), np.zeros((3, 3))
    seen = [k for k, name in enumerate(MOMENTS) if INERTIAL.index(name) in body]
    value[seen], spread[np.ix_(seen, seen)] = fit.x[at], covariance[np.ix_(at, at)]
    return FirstMoments(value, spread)


def _rows_of(system: StackedSystem, joints: list[int]) -> StackedSystem:
    """The rows of some joints."""
    rows = np.isin(system.joint, joints)
    return StackedSystem(
        V=system.V[rows],
        W=system.W[rows],
        W_L=system.W_L[rows],
        joint=system.joint[rows],
        loaded=system.loaded[rows],
        t=system.t[rows],
    )


def _independent(structure: Structure, joints: list[int], mass: KnownPayload) -> tuple[Indices, Indices]:
    """Base columns and payload columns that are independent on the rows of some joints."""
    W = random_regressor(structure.arm, np.random.default_rng(PROBE_SEED))
    rows = np.vstack([W[:, j, structure.base.columns] for j in joints])
    probes = np.vstack([structure.payload_probes[j] for j in joints])
    arm = np.sort(independent_columns(rows, [np.arange(rows.shape[1])]))
    moments = np.array([INERTIAL.index(name) for name in MOMENTS])
    rest = np.array([k for k in range(10) if not mass.mask[k] and k not in moments])
    return arm, np.sort(independent_columns(probes, [moments, rest]))


def _with_moments(mass: KnownPayload, moments: FirstMoments) -> KnownPayload:
    """Mass and first moments as known; the spread is the moments' own."""
    at = [INERTIAL.index(name) for name in MOMENTS]
    chi, spread = mass.chi.copy(), np.zeros((10, 3))
    chi[at] = moments.value
    eigenvalues, vectors = linalg.eigh(moments.covariance)
    spread[at] = vectors * np.sqrt(np.maximum(eigenvalues, 0.0))
    return KnownPayload(names=("M", *MOMENTS), chi=chi, spread=spread)


def _later_gain(
    j: int, unloaded: Observation, loaded: Observation, known: KnownPayload, payload: Payload, options: GainOptions
) -> JointGain:
    """The gain of a joint from moments that are themselves estimates: their error joins that of the joint's rows."""
    gain = joint_gain(j, unloaded.joints[j], loaded.joints[j], loaded.structure, known, options)
    carried = gain.payload_rel_std
    weighed = payload.mass_std / payload.mass  # the moments, and so this gain, scale with the mass
    predicted = float(np.hypot(gain.predicted_rel_std, carried))
    if gain.value is None or gain.std is None:
        return replace(gain, payload_rel_std=weighed, predicted_rel_std=predicted)
    if predicted > options.max_rel_std:
        reason = (
            f"predicted standard deviation {100.0 * predicted:.3g} % of the gain, that of the first moments included, "
            f"exceeds {100.0 * options.max_rel_std:.3g} %"
        )
        return replace(gain, value=None, std=None, reason=reason, payload_rel_std=weighed, predicted_rel_std=predicted)
    std = float(np.hypot(gain.std, carried * gain.value))
    return replace(gain, std=std, payload_rel_std=weighed, predicted_rel_std=predicted)
