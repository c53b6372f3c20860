"""Whether the joints, each alone, agree on the mass that was found from all of them.

A gain that is off by a share makes the mass of its joint so; all joints together hide it in a mass between.
"""

from dataclasses import replace

import numpy as np

from ident.estimation.known_gains import KnownGains
from ident.payload.payload import FARTHEST, HEAVIEST, LIGHTEST, Payload
from ident.payload_identification.payload_body import CENTRE, SURE, FoundBody
from ident.payload_identification.payload_estimate import FoundPayload
from ident.payload_identification.verification import Weighed, verified
from ident.support.errors import NegativeMass


def check_mass(body: FoundBody) -> None:
    """Refuse a body whose mass is below zero beyond doubt.

    Raises:
        NegativeMass: If it is.
    """
    mass = body.of("mass")
    if mass is not None and mass.value < -SURE * mass.std:
        raise NegativeMass(
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
