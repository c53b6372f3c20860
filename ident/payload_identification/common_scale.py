"""Whether the joints agree with each other on how far the scale is off: then no single gain is to blame.

A wrong weight on the scale, as one with which all gains were found, makes the mass of every joint wrong by one share;
a gain that is off makes that of its joint so. With x_j = log(m_j / m) of the mass that joint j alone finds, the most
joints that one x explains speak for all, unless one of them alone makes it. Where there is no scale, the mass of all
joints stands in its place: a gain that is off makes that of its joint differ from it.
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
"""Joints that have to agree."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Departure:
    """A joint that departs from the others.

    Attributes:
        joint: The joint, from 0.
        rel_error: Its mass over that of the others, less one.
        rel_std: Its standard deviation.
    """

    joint: int
    rel_error: float
    rel_std: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CommonError:
    """A mass on which joints agree, and which the scale does not say.

    Attributes:
        joints: Those that agree, from 0.
        rel_error: (found - stated) / stated.
        rel_std: Its standard deviation, that of the scale included.
        apart: Joints that depart from them beyond their intervals.
    """

    joints: tuple[int, ...]
    rel_error: float
    rel_std: float
    apart: tuple[Departure, ...]


def common_error(found: Verification) -> CommonError | None:
    """What joints have in common beyond the deviation of it; None where they agree with the scale or not at all."""
    if found.passed:
        return None
    masses = {each.joint: each.mass for each in found.joints if each.joint is not None and _sure(each.mass)}
    names, weighed = list(masses), [each for each in masses.values() if each is not None]
    value, std = np.array([each.value for each in weighed]), np.array([each.std for each in weighed])
    x, C = np.log(value / found.payload.mass), np.diag((std / value) ** 2)
    sharing = sharing_joints(x, C).tolist() if len(x) >= LEAST else []
    if len(sharing) < LEAST:
        return None
    # errors that all gains have alike, as of the weight that they were found with, do not average out
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
    """Whether it has a logarithm with a deviation."""
    return mass is not None and mass.value > 0.0 and mass.std > 0.0


def check_mass(body: FoundBody) -> None:
    """Refuse a mass that is below zero beyond doubt.

    Raises:
        NegativeMass: If it is.
    """
    mass = body.of("mass")
    error = None if mass is None else negative_mass(mass)
    if error is not None:
        raise error


def negative_mass(mass: Quantity) -> NegativeMass | None:
    """What is wrong with a mass that is below zero beyond doubt, None with another one."""
    if mass.value >= -SURE * mass.std:
        return None
    return NegativeMass(
        f"the mass found is negative: {mass.value:.3g} kg, 2 sigma {2.0 * mass.std:.2g} kg; bare and "
        "loaded recordings are probably swapped, or the signs of gains and currents differ"
    )


def joint_agreement(found: FoundPayload, body: FoundBody, gains: KnownGains) -> tuple[Weighed, ...]:
    """The mass from each joint alone beside that from all, as against a scale; empty where no mass is sure.

    The centre of mass that was found, with its deviations, serves each joint, the inertia is left free. Deviations of
    one joint and of all together count as independent, which says "differs" less often than `LEVEL`.

    Args:
        found: The payload found with these gains.
        body: Of it.
        gains: The gains.
    """
    payload = _as_stated(body)
    return () if payload is None else verified(found, payload, gains).joints


def _as_stated(body: FoundBody) -> Payload | None:
    """What was found, as if it were stated."""
    mass, centre = body.of("mass"), [each for each in map(body.of, CENTRE) if each is not None]
    if mass is None or not SURE * mass.std < mass.value or not LIGHTEST <= mass.value <= HEAVIEST:
        return None
    stated = Payload(mass=mass.value, mass_std=mass.std, known="mass")
    if len(centre) < len(CENTRE) or max(abs(each.value) + each.std for each in centre) > FARTHEST:
        return stated
    (x, y, z), (sx, sy, sz) = np.array([(each.value, each.std) for each in centre]).T.tolist()
    return replace(stated, com=(x, y, z), com_std=(sx, sy, sz), known="com")
