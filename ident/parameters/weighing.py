"""Gains tested with a weighed payload that was not used for their identification: mass from currents against the scale.

All joints together give the mass (`payload`). Each joint alone shows which gain is wrong, since a relative error of the
gain is the same relative error of its mass: its system has the joint's rows, its friction columns from the fit of all
joints, and the column of the torque per kilogram of the payload; all other columns are free.

A wrong weighed mass, here or in the identification of the gains, gives all joints the same relative error; a wrong gain
affects only its own joint. With x_j = log(m_j / m), the largest group of joints with a common x is selected, unless a
single one of them causes it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist

import numpy as np

from ident.estimation.all_joints import Fit
from ident.estimation.estimators.nls import AllJointsOptions
from ident.estimation.gain_comparison import common_scale, sharing_joints
from ident.estimation.intervals import UNCERTAINTIES, Rows
from ident.estimation.known_gains import KnownGains
from ident.estimation.problem import ObservedMotion, Problem
from ident.numerics.least_squares import factors
from ident.parameters.arm import PLAIN, BareArm, Quantity, arm_in_use
from ident.parameters.payload import CENTRE, SURE, FoundBody, FoundPayload, payload_of
from ident.payload.payload import FARTHEST, HEAVIEST, LIGHTEST, KnownPayload, Payload
from ident.support.arrays import Array
from ident.support.errors import NotIdentifiable, PayloadError

LEVEL = 0.05
"""False-alarm rate of all verdicts together, for correct gains and standard deviations."""
WEAK, WEAK_ALONE = 0.1, 0.25
"""Relative standard deviations of the mass, from all joints and from one, above which it is inconclusive."""
LEAST = 2
"""Least number of joints with a common error."""
DEPENDENT = 1e-9
"""Relative norm of the independent part of a unit column below which it is dependent."""
NEW = 1e-6
"""Least independent part of the unit column of the mass."""
STDS = ("std", "residual_std", "gain_std", "model_std")
AGREES, DIFFERS, SAYS_NOTHING = "agrees", "differs", "says nothing"
UNKNOWN = Payload(mass=1.0, known="none")
"""An unknown payload; its mass is not used."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Weighed:
    """A mass from currents compared with the stated one; without a mass its numbers are None.

    Attributes:
        std: Standard deviation of `mass`, without that of the scale [kg].
        residual_std: Contribution of the residuals to `std` [kg].
        gain_std: Contribution of the gains' standard deviations to `std` [kg].
        model_std: Contribution of the model's assumptions to `std` [kg].
        joint: The joint, from 0; None for all joints together.
        mass: Estimated mass [kg].
        rel_error: Relative error of the mass, (estimate - weighed) / weighed, which equals that of the gains.
        rel_std: Standard deviation of `rel_error`, including that of the scale; relative.
        verdict: "agrees", "differs" or, if inconclusive, "says nothing".
        reason: Why it is inconclusive.
    """

    std: float | None = None
    residual_std: float | None = None
    gain_std: float | None = None
    model_std: float | None = None
    joint: int | None
    mass: float | None = None
    rel_error: float | None = None
    rel_std: float | None = None
    verdict: str = SAYS_NOTHING
    reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Verification:
    """A weighed payload, its mass from all joints and from each alone, and the estimated body.

    `limit` is the number of standard deviations above which a mass differs, for a total false-alarm rate of `LEVEL`.
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
    """Compare a payload estimated with gains with its weighed mass; its known shape is used for single joints.

    The gains are assumed independent of this recording; correlation through a common bare recording is neglected.
    Raises `PayloadError` if the payload's mass is not known, `NotIdentifiable` if the mass is not identifiable.
    """
    if payload.known == "none":
        raise PayloadError("payload: known = 'none', but a verification needs its mass; weigh it, known = 'mass'")
    if "M" in found.refused:
        raise NotIdentifiable(f"the payload's M: {found.refused['M']}")
    alone = masses_alone(found, payload, gains)
    limit = -NormalDist().inv_cdf(0.5 * LEVEL / (1 + sum(isinstance(each, Quantity) for each in alone)))

    def weighed(joint: int | None, mass: Quantity | str | None) -> Weighed:
        if not isinstance(mass, Quantity):
            return Weighed(joint=joint, reason=mass)
        error, std = mass.value / payload.mass - 1.0, float(np.hypot(mass.std, payload.mass_std)) / payload.mass
        verdict, reason = DIFFERS if abs(error) > limit * std else AGREES, None
        if verdict == AGREES and joint is None and std > WEAK:
            verdict = SAYS_NOTHING
            reason = f"its standard deviation is {100.0 * std:.0f} %, above {100.0 * WEAK:g} %"
        shares: dict[str, float] = {each: getattr(mass, each) for each in STDS}
        of = Weighed(joint=joint, mass=mass.value, verdict=verdict, reason=reason)
        return replace(of, rel_error=error, rel_std=std, **shares)

    return Verification(
        payload=payload,
        together=weighed(None, found.body.of("mass")),
        joints=tuple(weighed(j, each) for j, each in enumerate(alone)),
        body=found.body,
        limit=limit,
        remarks=found.selected.remarks,
    )


def joint_agreement(found: FoundPayload, body: FoundBody, gains: KnownGains) -> tuple[Weighed, ...]:
    """Return the mass from each joint alone compared with that from all; empty if the latter is not significant.

    Each joint uses the estimated centre of mass with its standard deviations; the inertia is free. Errors of one joint
    and of all together are assumed independent, which makes false alarms rarer than `LEVEL`.
    """
    payload = as_stated(body)
    return () if payload is None else verified(found, payload, gains).joints


def as_stated(body: FoundBody) -> Payload | None:
    """Return an estimated body as a specified payload; None if its mass is not significant or not plausible."""
    mass, centre = body.of("mass"), [each for each in map(body.of, CENTRE) if each is not None]
    if mass is None or not SURE * mass.std < mass.value or not LIGHTEST <= mass.value <= HEAVIEST:
        return None
    stated = Payload(mass=mass.value, mass_std=mass.std, known="mass")
    if len(centre) < len(CENTRE) or max(abs(each.value) + each.std for each in centre) > FARTHEST:
        return stated
    (x, y, z), (sx, sy, sz) = [each.value for each in centre], [each.std for each in centre]
    return replace(stated, com=(x, y, z), com_std=(sx, sy, sz), known="com")


def masses_alone(found: FoundPayload, payload: Payload, gains: KnownGains) -> tuple[Quantity | str, ...]:
    """Return the mass from each joint alone [kg], with the known shape of a specified payload, or why it gives none."""
    known, final = payload.known_part(), found.selected.final
    ready, uncertainty = final.ready, UNCERTAINTIES[final.ready.problem.options.uncertainty]
    spread = known.spread[:, 1:] if len(known.names) > 1 else np.zeros((10, 0))  # of the shape; the mass is estimated
    results: list[Quantity | str] = ["its gain is not known"] * ready.n
    rel_std = np.sqrt(np.diag(gains.log_covariance)).tolist()
    for j, gain, deviation in zip(gains.joints.tolist(), gains.value.tolist(), rel_std, strict=True):
        solved = mass_alone(final, j, gain, known)
        if solved is None:
            results[j] = "the torque of the mass on this joint cannot be separated from that of the arm"
            continue
        rivals = [
            each.share * (other.mass - one.mass)
            for each in found.selected.rivals
            if (one := mass_alone(each.final, j, gain, known)) is not None
            and (other := mass_alone(each.other, j, gain, known)) is not None
        ]
        shape = solved.influence @ (ready.columns.W_L[0][ready.columns.joint == j] @ spread) / gain
        residual = uncertainty(solved.rows, solved.influence[None])
        mass = Quantity(
            name="mass",
            unit="kg",
            value=solved.mass,
            residual_std=float(np.sqrt(residual[0, 0])),
            gain_std=deviation * abs(solved.mass),
            model_std=float(np.linalg.norm((solved.belief, *rivals, *shape))),
        )
        weak = mass.std > WEAK_ALONE * payload.mass
        results[j] = f"its estimate of the mass has a standard deviation of {mass.std:.2g} kg" if weak else mass
    return tuple(results)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MassAlone:
    """Mass from one joint [kg], its derivative by each row's current, its change by priors, and the rows."""

    mass: float
    influence: Array
    belief: float
    rows: Rows


def mass_alone(fitted: Fit, j: int, gain: float, known: KnownPayload) -> MassAlone | None:
    """Solve the least squares of one joint's rows with the priors of its own parameters; None if the mass is dependent.

    The joint's shared columns are the arm's, then the unknown ones of the payload, then compliance; the column of the
    mass, per kilogram with the known shape, replaces those of the known payload parameters.
    """
    ready, columns, model = fitted.ready, fitted.ready.columns, fitted.model
    arm = len(ready.shared.arm)
    at = columns.joint == j
    V, shared, W_L = fitted.rows.V[at], ready.A[at], columns.W_L[0][at]
    used = model.own.used[j]
    F, mean, std = model.F[at][:, used], model.mean[j, used], model.std[j, used]
    weight, believed = fitted.rows.weight[at], np.isfinite(std)
    kilogram = W_L[:, known.mask] @ known.chi[known.mask] / (known.chi[9] * gain)
    elastic = shared[:, arm + len(ready.shared.free[0]) :]
    others = np.hstack((F, shared[:, :arm], W_L[:, ~known.mask], elastic))
    beliefs = np.zeros((np.count_nonzero(believed), others.shape[1]))
    beliefs[np.arange(len(beliefs)), np.flatnonzero(believed)] = 1.0 / std[believed]
    basis = factors(np.vstack((others * weight[:, None], beliefs)), rank_tol=DEPENDENT).Q
    column = np.concatenate((kilogram * weight, np.zeros(len(beliefs))))
    left = column - basis @ (basis.T @ column)
    if np.linalg.norm(left) <= NEW * np.linalg.norm(column):
        return None
    Y = np.concatenate((V * weight, (mean / std)[believed]))
    pseudo, size = left / float(left @ column), len(V)
    explained = np.column_stack((basis, left / np.linalg.norm(left)))
    rows = Rows(
        V=V,
        residual=(Y - explained @ (explained.T @ Y))[:size] / weight,
        joint=np.full(size, j, dtype=np.intp),
        motion=columns.motion[at],
        position=columns.position[at],
        unknowns={j: float(np.sum(explained[:size] ** 2))},
        weight=weight,
        explained=explained[:size],
    )
    influence, belief = pseudo[:size] * weight, float(np.linalg.norm(pseudo[size:]))
    return MassAlone(mass=float(pseudo @ Y), influence=influence, belief=belief, rows=rows)


@dataclass(frozen=True, slots=True, kw_only=True)
class Departure:
    """A joint whose mass differs from that of the others.

    Attributes:
        joint: The joint, from 0.
        rel_error: Relative error, the ratio of its mass to that of the others minus one.
        rel_std: Standard deviation of `rel_error`, relative.
    """

    joint: int
    rel_error: float
    rel_std: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CommonError:
    """An error of the mass that several joints have in common, which no single gain explains.

    Attributes:
        joints: The joints, from 0.
        rel_error: Relative error, (estimate - weighed) / weighed.
        rel_std: Standard deviation of `rel_error`, including that of the scale; relative.
        apart: Joints that differ significantly from them.
    """

    joints: tuple[int, ...]
    rel_error: float
    rel_std: float
    apart: tuple[Departure, ...]


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


def gains_outcome(problem: Problem, weight: Payload, gains: KnownGains, options: object) -> GainsOutcome:
    """Estimate payload and arm with given gains, from bare motions and those of one mounting with an unknown payload.

    The known shape of `weight` is used for single joints; for options of methods other than `nls`, `PLAIN` is used.

    Raises:
        NotIdentifiable: If no motion is bare or none is loaded, or the mass is not identifiable.
        GainsError: If the gains are not of this arm.
        PayloadError: If no parameter of the payload is known.
    """
    found = payload_of(problem, gains, options if isinstance(options, AllJointsOptions) else PLAIN)
    return GainsOutcome(gains=gains, weighed=verified(found, weight, gains), arm=arm_in_use(problem, gains))


def outcome_of_other_gains(problem: Problem, gains: KnownGains, options: object) -> GainsOutcome:
    """Estimate arm and heaviest payload of motions used for identification, as `gains_outcome`, with other gains."""
    problem.check_difference()
    weight = max(problem.payloads, key=lambda each: each.mass)
    loaded = [motion for motion in problem.motions if motion.payload is weight]
    return gains_outcome(with_unknown_weight(problem, loaded), weight, gains, options)


def with_unknown_weight(problem: Problem, loaded: Sequence[ObservedMotion]) -> Problem:
    """Return the bare motions of a problem, and loaded ones with an unknown payload."""
    bare = [motion for motion in problem.motions if motion.payload is None]
    return replace(problem, motions=(*bare, *(ObservedMotion(each.observation, UNKNOWN) for each in loaded)))
