"""Gains against a scale: the mass of another payload, which identification has not seen, from its currents."""

from dataclasses import dataclass

import numpy as np

from ident.estimation.known_gains import KnownGains
from ident.numerics.normal import normal_quantile
from ident.payload.payload import Payload
from ident.payload_identification.mass_by_joint import NoMass, masses_alone
from ident.payload_identification.payload_body import FoundBody, Quantity, body_of
from ident.payload_identification.payload_estimate import FoundPayload
from ident.support.errors import PayloadError

LEVEL = 0.05
"""How often all masses together may be told wrong where the gains and their deviations are right."""
WEAK = 0.1
"""Relative deviation of the mass from which nothing is said of the gains."""
AGREES, DIFFERS, SAYS_NOTHING = "agrees", "differs", "says nothing"


@dataclass(frozen=True, slots=True, kw_only=True)
class Weighed:
    """A mass from currents beside the stated one.

    Attributes:
        joint: Joint that it is from, from 0; None for all together.
        mass: What was found [kg], None where the joint does not show it.
        rel_error: (found - stated) / stated: by this share the gains that made it are too large; None without a mass.
        rel_std: Its standard deviation, that of the scale included; None without a mass.
        verdict: `AGREES`, `DIFFERS` or `SAYS_NOTHING`.
        reason: Why it says nothing.
    """

    joint: int | None
    mass: Quantity | None
    rel_error: float | None
    rel_std: float | None
    verdict: str
    reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Verification:
    """What a scale says of drive gains.

    Attributes:
        payload: As weighed.
        together: From all joints.
        joints: From each joint alone.
        body: Mass, centre and inertia found.
        limit: Deviations beyond which a mass differs: all verdicts together err once in 1 / `LEVEL` times.
        remarks: What was chosen on the way, in words.
    """

    payload: Payload
    together: Weighed
    joints: tuple[Weighed, ...]
    body: FoundBody
    limit: float
    remarks: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether the masses agree, and say something."""
        return self.together.verdict == AGREES and not any(each.verdict == DIFFERS for each in self.joints)


def verified(found: FoundPayload, payload: Payload, gains: KnownGains) -> Verification:
    """Hold a payload found with gains against its scale.

    The gains count as found without this recording; a bare recording that both share makes their errors common, which
    is not counted.

    Args:
        found: The payload found with these gains.
        payload: As weighed; of its shape, what is known is used for each joint alone.
        gains: The gains.

    Raises:
        PayloadError: If the payload's mass is not known.
        NotIdentifiable: If the mass does not show.
    """
    if payload.known == "none":
        raise PayloadError("payload: known = 'none', but a verification needs its mass; weigh it, known = 'mass'")
    found.at("M")
    body = body_of(found)
    alone = masses_alone(found, payload, gains)
    limit = -normal_quantile(0.5 * LEVEL / (1 + sum(isinstance(each, Quantity) for each in alone)))
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
