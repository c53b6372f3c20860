"""Gains tested with a weighed payload that was not used for their identification: mass from currents against scale.

All joints together give the mass (`payload`). Each joint shows its own gain: recordings and weighed payload also give
gains, and a relative error of a gain is the same relative error of the mass,

    m_j = m g_j / g'_j        m  weighed mass, g_j  gain in question, g'_j  gain from the weighed payload

so that faults of the recordings, refusals and intervals are those of an identification from them.

A wrong weighed mass, here or in the identification of the gains, gives all joints the same relative error; a wrong gain
affects only its own joint. With x_j = log(m_j / m), the largest group of joints with a common x is selected, unless a
single one of them causes it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import Any

import numpy as np

from ident.estimation.estimate import GainEstimate, RefusedGain
from ident.estimation.estimators.nls import AllJointsOptions
from ident.estimation.gain_comparison import common_scale, sharing_joints
from ident.estimation.known_gains import KnownGains
from ident.estimation.problem import ObservedMotion, Problem
from ident.parameters.arm import PLAIN, BareArm, Quantity, arm_in_use
from ident.parameters.payload import CENTRE, SURE, UNITS, FoundBody, FoundPayload, payload_of
from ident.payload.payload import HEAVIEST, INERTIA_KEYS, LIGHTEST, Payload
from ident.support.errors import NotIdentifiable, PayloadError

LEVEL = 0.05
"""False-alarm rate of all verdicts together, for correct gains and standard deviations."""
WEAK, WEAK_ALONE = 0.1, 0.25
"""Relative standard deviations of the mass, from all joints and from one, above which it is inconclusive."""
LEAST = 2
"""Least number of joints with a common error."""
AGREES, DIFFERS, SAYS_NOTHING = "agrees", "differs", "says nothing"
UNKNOWN, ANY_MASS = (Payload(mass=1.0, known=known) for known in ("none", "mass"))
"""An unknown payload, whose mass is not used, and one of which any mass gives the same ratios of gains."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Weighed:
    """A mass from currents compared with the stated one; without a mass its numbers are None."""

    std: float | None = None  # standard deviation of `mass`, without that of the scale [kg]
    residual_std: float | None = None  # contribution of the residuals to `std` [kg]
    gain_std: float | None = None  # contribution of the gains' standard deviations to `std` [kg]
    model_std: float | None = None  # contribution of the model's assumptions to `std` [kg]
    joint: int | None  # the joint, from 0; None for all joints together
    mass: float | None = None  # estimated mass [kg]
    rel_error: float | None = None  # relative error of the mass, which is that of the gains
    rel_std: float | None = None  # standard deviation of `rel_error`, including that of the scale; relative
    verdict: str = SAYS_NOTHING  # "agrees", "differs" or, if inconclusive, "says nothing"
    reason: str | None = None  # why it is inconclusive


@dataclass(frozen=True, slots=True, kw_only=True)
class Verification:
    """A weighed payload, its mass from all joints and from each alone, and the estimated body."""

    payload: Payload
    together: Weighed
    joints: tuple[Weighed, ...]
    body: FoundBody
    limit: float  # standard deviations above which a mass differs, for a total false-alarm rate of `LEVEL`
    remarks: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether the masses agree and are conclusive."""
        return self.together.verdict == AGREES and not any(each.verdict == DIFFERS for each in self.joints)


def verified(found: FoundPayload, payload: Payload, gains: KnownGains, estimate: GainEstimate | str) -> Verification:
    """Compare a payload estimated with gains in question with its weighed mass.

    `estimate` has the gains from the same recordings with the weighed payload, or says why there are none. The gains
    are assumed independent of this recording; correlation through a common bare recording is neglected. Raises
    `PayloadError` if the payload's mass is not known, `NotIdentifiable` if it is not identifiable.
    """
    if payload.known == "none":
        raise PayloadError("payload: known = 'none', but a verification needs its mass; weigh it, known = 'mass'")
    if "M" in found.refused:
        raise NotIdentifiable(f"the payload's M: {found.refused['M']}")
    alone = masses_of_joints(payload, gains, estimate)
    limit = -NormalDist().inv_cdf(0.5 * LEVEL / (1 + sum(isinstance(each, Quantity) for each in alone)))

    def weighed(joint: int | None, mass: Quantity | str | None) -> Weighed:
        if not isinstance(mass, Quantity):
            return Weighed(joint=joint, reason=mass)
        error, std = mass.value / payload.mass - 1.0, float(np.hypot(mass.std, payload.mass_std)) / payload.mass
        verdict, reason = DIFFERS if abs(error) > limit * std else AGREES, None
        if verdict == AGREES and joint is None and std > WEAK:
            verdict = SAYS_NOTHING
            reason = f"its standard deviation is {100.0 * std:.0f} %, above {100.0 * WEAK:g} %"
        return Weighed(
            joint=joint, mass=mass.value, rel_error=error, rel_std=std, verdict=verdict, reason=reason,
            std=mass.std, residual_std=mass.residual_std, gain_std=mass.gain_std, model_std=mass.model_std,
        )  # fmt: skip

    return Verification(
        payload=payload,
        together=weighed(None, found.body.of("mass")),
        joints=tuple(weighed(j, each) for j, each in enumerate(alone)),
        body=found.body,
        limit=limit,
        remarks=found.selected.remarks,
    )


def as_stated(body: FoundBody) -> Payload | None:
    """Return the mass of an estimated body as a weighed payload; None if it is not significant or not plausible."""
    mass = body.of("mass")
    if mass is None or not SURE * mass.std < mass.value or not LIGHTEST <= mass.value <= HEAVIEST:
        return None
    return Payload(mass=mass.value, mass_std=mass.std, known="mass")


def as_load(body: FoundBody, *, most: float) -> tuple[Payload | None, str | None]:
    """Return an estimated body as a payload with `known = "all"`, or "com" and why its inertia is left out.

    None and why if mass or centre has no value, is not plausible, or has a relative standard deviation above `most`;
    those of centre and inertia are norms of all components, relative to the norm of the values.
    """
    stated, why = dict[str, Any](), None
    for part, names in (("mass", ("mass",)), ("com", CENTRE), ("inertia", INERTIA_KEYS)):
        known = [each for each in body.quantities if each.name in names]
        x, std = tuple(each.value for each in known), tuple(each.std for each in known)
        size, spread, unit = np.linalg.norm(x), np.linalg.norm(std), UNITS[names[0]]
        if missing := [body.refused[name] for name in names if name in body.refused]:
            why = f"{part}: {missing[0]}"
        elif spread > most * size:
            said = f"{size:.3g} {unit} has a standard deviation of {spread:.2g} {unit}"
            why = f"{part}: {said}, more than {100.0 * most:g} %"
        if why is not None:
            break
        stated |= {part: x, f"{part}_std": std} if names[1:] else {part: x[0], f"{part}_std": std[0]}
    for known in ("all", "com") if "com" in stated else ():
        try:
            return Payload(**stated, known=known), why
        except PayloadError as error:
            why = str(error) if why is None or known == "com" else why
            stated = {key: x for key, x in stated.items() if "inertia" not in key}
    return None, why


def masses_of_joints(payload: Payload, gains: KnownGains, estimate: GainEstimate | str) -> tuple[Quantity | str, ...]:
    """Return the mass from each joint [kg] by its gain in question, or why it gives none; arguments as in `verified`.

    Its deviation does not include that of the scale, which the estimated gains have in common.
    """
    results: list[Quantity | str] = [estimate if isinstance(estimate, str) else "its gain is not known"] * len(
        gains.names
    )
    rel_std = np.sqrt(np.diag(gains.log_covariance)).tolist()
    for j, gain, deviation in zip(gains.joints.tolist(), gains.value.tolist(), rel_std, strict=True):
        if isinstance(estimate, str):
            continue
        shown = estimate.joints[j]
        if isinstance(shown, RefusedGain):
            results[j] = shown.reason
            continue
        value = payload.mass * gain / shown.value
        of_shape = max(shown.payload_rel_std**2 - (payload.mass_std / payload.mass) ** 2, 0.0) ** 0.5
        mass = Quantity(
            name="mass",
            unit="kg",
            value=value,
            residual_std=abs(value * shown.residual_std / shown.value),
            gain_std=abs(value) * deviation,
            model_std=abs(value) * float(np.hypot(shown.model_rel_std, of_shape)),
        )
        weak = mass.std > WEAK_ALONE * payload.mass
        results[j] = f"its estimate of the mass has a standard deviation of {mass.std:.2g} kg" if weak else mass
    return tuple(results)


@dataclass(frozen=True, slots=True, kw_only=True)
class Departure:
    """A joint whose mass differs from that of the others."""

    joint: int  # the joint, from 0
    rel_error: float  # ratio of its mass to that of the others, minus one
    rel_std: float  # standard deviation of `rel_error`, relative


@dataclass(frozen=True, slots=True, kw_only=True)
class CommonError:
    """An error of the mass that several joints have in common, which no single gain explains."""

    joints: tuple[int, ...]  # the joints, from 0
    rel_error: float  # relative error, (estimate - weighed) / weighed
    rel_std: float  # standard deviation of `rel_error`, including that of the scale; relative
    apart: tuple[Departure, ...]  # joints that differ significantly from them


def common_error(found: Verification) -> CommonError | None:
    """Return a significant common error of the joints; None if they agree with the scale or have no common error."""
    each = [one for one in found.joints if (one.mass or 0.0) > 0.0 and (one.std or 0.0) > 0.0]
    if found.passed or len(each) < LEAST:
        return None
    value, std, of_gain = np.array([(one.mass, one.std, one.gain_std) for one in each], np.float64).T
    x, wide = np.log(value / found.payload.mass), std / value
    sharing = sharing_joints(x, np.diag(wide**2)).tolist()
    if len(sharing) < LEAST:
        return None
    # common errors of all gains, as from the payload's mass, do not average out
    alike = float(np.hypot(np.min(of_gain / value), found.payload.mass_std / found.payload.mass))
    groups = [sharing, *([k for k in sharing if k != one] for one in range(len(x)))]
    common, *others = (common_scale(x[kept], np.diag(wide[kept] ** 2)) for kept in groups)
    if not all(
        abs(one.value) > found.limit * np.hypot(one.std, alike) for one in (common, *(others[k] for k in sharing))
    ):
        return None
    joints = [one.joint for one in each if one.joint is not None]
    away = [(float(x[k]) - other.value, float(np.hypot(wide[k], other.std))) for k, other in enumerate(others)]
    return CommonError(
        joints=tuple(joints[k] for k in sharing),
        rel_error=float(np.expm1(common.value)),
        rel_std=float(np.exp(common.value) * np.hypot(common.std, alike)),
        apart=tuple(
            Departure(joint=joint, rel_error=float(np.expm1(off)), rel_std=float(np.exp(off)) * spread)
            for joint, (off, spread) in zip(joints, away, strict=True)
            if abs(off) > found.limit * spread
        ),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GainsOutcome:
    """Arm, from the bare motions, and payload with given gains, the latter compared with its weighed mass."""

    gains: KnownGains
    arm: BareArm
    weighed: Verification


def gains_outcome(
    problem: Problem, weight: Payload, gains: KnownGains, options: object, estimate: GainEstimate
) -> GainsOutcome:
    """Estimate payload and arm with given gains, from bare motions and those of one mounting with an unknown payload.

    For options of methods other than `nls`, `PLAIN` is used; `estimate` has the gains from the same motions and the
    weighed payload. Raises as `payload_of` and `verified`.
    """
    found = payload_of(problem, gains, options if isinstance(options, AllJointsOptions) else PLAIN)
    return GainsOutcome(gains=gains, weighed=verified(found, weight, gains, estimate), arm=arm_in_use(problem, gains))


def outcome_of_other_gains(
    problem: Problem, gains: KnownGains, options: object, estimate: GainEstimate
) -> GainsOutcome:
    """As `gains_outcome`, with other gains than those identified, `estimate`, and the motions' heaviest payload."""
    problem.check_difference()
    weight = max(problem.payloads, key=lambda each: each.mass)
    loaded = [motion for motion in problem.motions if motion.payload is weight]
    return gains_outcome(with_unknown_weight(problem, loaded), weight, gains, options, estimate)


def with_unknown_weight(problem: Problem, loaded: Sequence[ObservedMotion]) -> Problem:
    """Return the bare motions of a problem, and loaded ones with an unknown payload."""
    bare = [motion for motion in problem.motions if motion.payload is None]
    return replace(problem, motions=(*bare, *(ObservedMotion(each.observation, UNKNOWN) for each in loaded)))
