"""Verification of gains: the mass of another payload that was not used for identification, estimated from currents."""

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from ident.estimation.known_gains import KnownGains
from ident.payload.payload import Payload
from ident.payload_identification.mass_by_joint import NoMass, masses_alone
from ident.payload_identification.payload_body import FoundBody, Quantity, body_of
from ident.payload_identification.payload_estimate import FoundPayload
from ident.support.errors import PayloadError

LEVEL = 0.05
"""False-alarm rate of all verdicts together, for correct gains and standard deviations."""
WEAK = 0.1
"""Relative standard deviation of the mass above which the result is inconclusive."""
AGREES, DIFFERS, SAYS_NOTHING = "agrees", "differs", "says nothing"


@dataclass(frozen=True, slots=True, kw_only=True)
class Weighed:
    """A mass from currents compared with the stated one.

    Attributes:
        joint: The joint, from 0; None for all together.
        mass: Estimated mass [kg], None if not identifiable.
        rel_error: (found - stated) / stated, which equals the relative error of the gains; None without a mass.
        rel_std: Standard deviation of `rel_error`, including that of the scale; None without a mass.
        verdict: `AGREES`, `DIFFERS` or `SAYS_NOTHING`.
        reason: Why it is inconclusive.
    """

    joint: int | None
    mass: Quantity | None
    rel_error: float | None
    rel_std: float | None
    verdict: str
    reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Verification:
    """Result of a verification.

    Attributes:
        payload: The weighed payload.
        together: Mass from all joints.
        joints: Mass from each joint alone.
        body: Estimated mass, centre and inertia.
        limit: Standard deviations above which a mass differs, for a total false-alarm rate of `LEVEL`.
        remarks: Remarks on automatic choices.
    """

    payload: Payload
    together: Weighed
    joints: tuple[Weighed, ...]
    body: FoundBody
    limit: float
    remarks: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether the masses agree and are conclusive."""
        return self.together.verdict == AGREES and not any(each.verdict == DIFFERS for each in self.joints)


def verified(found: FoundPayload, payload: Payload, gains: KnownGains) -> Verification:
    """Compare a payload estimated with gains with its weighed mass.

    The gains are assumed independent of this recording; correlation through a common bare recording is neglected.

    Args:
        found: The payload estimated with these gains.
        payload: The weighed payload, whose known shape is used for single joints.
        gains: The gains.

    Raises:
        PayloadError: If the payload's mass is not known.
        NotIdentifiable: If the mass is not identifiable.
    """
    if payload.known == "none":
        raise PayloadError("payload: known = 'none', but a verification needs its mass; weigh it, known = 'mass'")
    found.at("M")
    body = body_of(found)
    alone = masses_alone(found, payload, gains)
    limit = -NormalDist().inv_cdf(0.5 * LEVEL / (1 + sum(isinstance(each, Quantity) for each in alone)))
    return Verification(
        payload=payload,
        together=_weighed(None, body.of("mass"), payload, limit),
        joints=tuple(
            Weighed(joint=j, mass=None, rel_error=None, rel_std=None, verdict=SAYS_NOTHING, reason=each.reason)
            if isinstance(each, NoMass)
            else _weighed(j, each, payload, limit)
            for j, each in enumerate(alone)
        ),
        body=body,
        limit=limit,
        remarks=found.selected.remarks,
    )


def _weighed(joint: int | None, mass: Quantity | None, payload: Payload, limit: float) -> Weighed:
    assert mass is not None, "asked where the mass shows"
    error = mass.value / payload.mass - 1.0
    std = float(np.hypot(mass.std, payload.mass_std)) / payload.mass
    differs, weak = abs(error) > limit * std, joint is None and std > WEAK
    return Weighed(
        joint=joint,
        mass=mass,
        rel_error=error,
        rel_std=std,
        verdict=DIFFERS if differs else SAYS_NOTHING if weak else AGREES,
        reason=f"its standard deviation is {100.0 * std:.0f} %, above {100.0 * WEAK:g} %"
        if weak and not differs
        else None,
    )
