"""Test whether the joints agree on a common error of the mass, which no single gain explains.

A wrong weighed mass, here or in the identification of the gains, gives all joints the same relative error of the mass;
a wrong gain affects only its own joint. With x_j = log(m_j / m) of the mass from joint j alone, the largest group of
joints with a common x is selected, unless a single one of them causes it. Without a weighed mass, the mass from all
joints replaces it: a wrong gain makes the mass of its joint differ from it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.estimation.gain_comparison import CommonScale, common_scale, sharing_joints
from ident.estimation.known_gains import KnownGains
from ident.payload.payload import FARTHEST, HEAVIEST, LIGHTEST, Payload
from ident.payload_identification.payload_body import CENTRE, SURE, FoundBody, Quantity
from ident.payload_identification.payload_estimate import FoundPayload
from ident.payload_identification.verification import Verification, Weighed, verified
from ident.support.arrays import Array
from ident.support.errors import NegativeMass

LEAST = 2
"""Least number of agreeing joints."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Departure:
    """A joint that differs from the others.

    Attributes:
        joint: The joint, from 0.
        rel_error: Ratio of its mass to that of the others, minus one.
        rel_std: Standard deviation of `rel_error`.
    """

    joint: int
    rel_error: float
    rel_std: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CommonError:
    """A common error of the mass of several joints.

    Attributes:
        joints: Agreeing joints, from 0.
        rel_error: (estimated - specified) / specified.
        rel_std: Standard deviation of `rel_error`, including that of the scale.
        apart: Joints that differ significantly from them.
    """

    joints: tuple[int, ...]
    rel_error: float
    rel_std: float
    apart: tuple[Departure, ...]


def common_error(found: Verification) -> CommonError | None:
    """Return a significant common error of the joints; None if they agree with the scale or have no common error."""
    if found.passed:
        return None
    masses = {each.joint: each.mass for each in found.joints if each.joint is not None and _sure(each.mass)}
    names, weighed = list(masses), [each for each in masses.values() if each is not None]
    value, std = np.array([each.value for each in weighed]), np.array([each.std for each in weighed])
    x, C = np.log(value / found.payload.mass), np.diag((std / value) ** 2)
    sharing = sharing_joints(x, C).tolist() if len(x) >= LEAST else []
    if len(sharing) < LEAST:
        return None
    # common errors of all gains, as from the payload's mass, do not average out
    alike = min(each.gain_std / each.value for each in weighed), found.payload.mass_std / found.payload.mass

    def of(kept: Sequence[int]) -> CommonScale:
        return common_scale(x[kept], C[np.ix_(kept, kept)])

    def std_of(common: CommonScale) -> float:
        return float(np.linalg.norm((common.std, *alike)))

    others = [of([k for k in sharing if k != each]) for each in range(len(x))]
    common = of(sharing)
    if not all(abs(each.value) > found.limit * std_of(each) for each in (common, *(others[k] for k in sharing))):
        return None
    return CommonError(
        joints=tuple(names[k] for k in sharing),
        rel_error=float(np.expm1(common.value)),
        rel_std=float(np.exp(common.value)) * std_of(common),
        apart=_departures(names, x, np.sqrt(np.diag(C)), others, found.limit),
    )


def _departures(
    names: Sequence[int], x: Array, std: Array, others: Sequence[CommonScale], limit: float
) -> tuple[Departure, ...]:
    away = x - np.array([each.value for each in others])
    spread = np.hypot(std, [each.std for each in others])
    return tuple(
        Departure(joint=joint, rel_error=float(np.expm1(off)), rel_std=float(np.exp(off)) * float(wide))
        for joint, off, wide in zip(names, away, spread, strict=True)
        if abs(off) > limit * wide
    )


def _sure(mass: Quantity | None) -> bool:
    """Return whether it has a logarithm with a standard deviation."""
    return mass is not None and mass.value > 0.0 and mass.std > 0.0


def check_mass(body: FoundBody) -> None:
    """Refuse a significantly negative mass.

    Raises:
        NegativeMass: If it is.
    """
    mass = body.of("mass")
    error = None if mass is None else negative_mass(mass)
    if error is not None:
        raise error


def negative_mass(mass: Quantity) -> NegativeMass | None:
    """Return the message for a significantly negative mass, None for another one."""
    if mass.value >= -SURE * mass.std:
        return None
    return NegativeMass(
        f"the estimated mass is negative: {mass.value:.3g} kg, 2 sigma {2.0 * mass.std:.2g} kg; bare and "
        "loaded recordings are probably swapped, or the signs of gains and currents differ"
    )


def joint_agreement(found: FoundPayload, body: FoundBody, gains: KnownGains) -> tuple[Weighed, ...]:
    """Return the mass from each joint alone compared with that from all; empty if the latter is not significant.

    Each joint uses the estimated centre of mass with its standard deviations; the inertia is free. Errors of one joint
    and of all together are assumed independent, which makes false alarms rarer than `LEVEL`.

    Args:
        found: The payload estimated with these gains.
        body: Body of the payload.
        gains: The gains.
    """
    payload = _as_stated(body)
    return () if payload is None else verified(found, payload, gains).joints


def _as_stated(body: FoundBody) -> Payload | None:
    """Return the estimate as a specified payload."""
    mass, centre = body.of("mass"), [each for each in map(body.of, CENTRE) if each is not None]
    if mass is None or not SURE * mass.std < mass.value or not LIGHTEST <= mass.value <= HEAVIEST:
        return None
    stated = Payload(mass=mass.value, mass_std=mass.std, known="mass")
    if len(centre) < len(CENTRE) or max(abs(each.value) + each.std for each in centre) > FARTHEST:
        return stated
    (x, y, z), (sx, sy, sz) = np.array([(each.value, each.std) for each in centre]).T.tolist()
    return replace(stated, com=(x, y, z), com_std=(sx, sy, sz), known="com")
