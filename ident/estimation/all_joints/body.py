"""Physical consistency of the estimated payload, and the gains if it is imposed."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ident.estimation.all_joints.pseudo_inertia import Bodies, nearest_possible
from ident.estimation.all_joints.solution import Fitted, Setting
from ident.model.parameters import INERTIAL
from ident.payload.payload import standard_parameters
from ident.support.arrays import Array, Indices
from ident.support.errors import NotIdentifiable

GYRATION = 0.1
"""Initial radius of gyration [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Moved:
    """Effect of a constraint on the payload.

    Attributes:
        log: Change of each log|h|, shape (n,).
        remarks: A description of the change.
    """

    log: Array
    remarks: tuple[str, ...] = ()


def free(ready: Setting, final: Fitted) -> Moved:
    """Impose no constraint."""
    return Moved(np.zeros(ready.n))


def possible(ready: Setting, final: Fitted) -> Moved:
    """Return the gains for the physically consistent payload parameters nearest to the estimates.

    Nearest in the metric of the fit's information matrix; the gains are the conditional means. Consistent estimates are
    not changed.

    Raises:
        NotIdentifiable: If an unknown parameter of the payload is not identifiable.
    """
    bodies, unknown = _bodies(ready)
    if not len(unknown):
        return Moved(np.zeros(ready.n))
    _check_shown(ready, final, unknown)
    found = final.fit.found.theta[unknown]
    if bodies.least(found) >= 0.0:
        return Moved(np.zeros(ready.n))
    fit, sigma = final.fit, 1.0 / final.fit.rows.weight
    of_gains = np.hstack((fit.log_influence * sigma, fit.log_belief))
    of_payload = np.hstack((fit.theta_influence[unknown] * sigma, fit.theta_belief[unknown]))
    covariance = of_payload @ of_payload.T
    scale = np.sqrt(np.diag(covariance))
    inverse = np.linalg.inv(covariance / np.outer(scale, scale)) / np.outer(scale, scale)
    nearest = nearest_possible(bodies, found, inverse, _ordinary(ready))
    moved = of_gains @ of_payload.T @ inverse @ (nearest - found)
    most = int(np.argmax(np.abs(moved)))
    words = (
        "the best-fitting payload parameters are not physically consistent; the nearest consistent ones "
        f"change the gain of joint {most + 1} by {100.0 * abs(moved[most]):.2g} %, the others by less"
    )
    return Moved(moved, (words,))


BODIES: dict[str, Callable[[Setting, Fitted], Moved]] = {"free": free, "possible": possible}
"""Constraints on a payload's unknown parameters: none, or physical consistency."""


def _bodies(ready: Setting) -> tuple[Bodies, Indices]:
    """Return the bodies, and the indices of their unknowns among the shared parameters."""
    shared = ready.shared
    body = np.repeat(np.arange(len(shared.free)), [len(each) for each in shared.free])
    place = np.concatenate([np.zeros(0, dtype=np.intp), *shared.free])
    return Bodies(known=shared.known, body=body, place=place), len(shared.arm) + np.arange(len(place))


def _check_shown(ready: Setting, final: Fitted, unknown: Indices) -> None:
    each_known = [payload.known_part().mask for payload in ready.problem.payloads]
    whole = all(
        len(found) + int(known.sum()) == len(INERTIAL)
        for found, known in zip(ready.shared.free, each_known, strict=True)
    )
    if not whole or not final.fit.theta_influence[unknown].any(axis=1).all():
        raise NotIdentifiable(
            "not every unknown payload parameter is identifiable, so physical consistency cannot be "
            "imposed; set payload_body = free"
        )


def _ordinary(ready: Setting) -> Array:
    """Unknowns of spheres with the specified masses and a typical radius of gyration, shape (k,)."""
    values = list[Array]()
    for payload, unknown in zip(ready.problem.payloads, ready.shared.free, strict=True):
        known = payload.known_part()
        com = known.chi[6:9] / payload.mass if known.mask[6] else np.zeros(3)
        moment = 2.0 * payload.mass * GYRATION**2
        values.append(standard_parameters(payload.mass, com, (moment,) * 3 + (0.0,) * 3)[unknown])
    return np.concatenate(values)
