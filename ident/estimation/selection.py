"""Model selection by cross-validation: a term is added if it improves the prediction of omitted time blocks.

load        friction proportional to torque, always, with a common prior of all joints' coefficients, estimated from the
            joints, as drives of one arm are similar; it hardly affects a joint with accurate data
form        proportional to the torque of the motor, in the gears or at their output: the best prediction is selected;
            the others contribute to the interval, by the largest share that a mixture can have of them
cbrt        viscous friction that grows less than linearly with speed, joint by joint
laws        of the gains, with priors (`ident.estimation.laws`)
compliance  of all joints, or of none; a joint whose compliance is significantly negative stays rigid, as no joint is
            like that: a delay of its currents or its friction explains the same currents
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ident.estimation.all_joints import Fit, fit, improvement
from ident.estimation.estimate import GainCurve
from ident.estimation.intervals import deviations, z_of
from ident.estimation.laws import with_laws
from ident.estimation.setting import Setting, Term
from ident.estimation.terms import (
    LINKS,
    LOAD_FORMS,
    LOAD_MEAN,
    LOAD_STD,
    MOTOR,
    OFFSET,
    SHARES,
    SPEED_TERMS,
    STRONGEST,
    columns_along,
    load_terms,
    speed_terms,
    torques_of,
    transmitted_columns,
    with_softened,
)
from ident.support.arrays import Array, Indices, Mask
from ident.support.naming import joint_list

BETTER = 2.0
"""Number of standard errors by which the prediction of omitted time blocks must improve for a term to be selected.

There is no correction for multiple tests: 100 runs of `nominal` selected no useless term on a joint with a gain, and
2.9, by Bonferroni's inequality, omits two cube roots of a real arm, whose standard deviations then grow by a tenth.
"""
SUSPECTED = 1.0
"""Number of standard errors by which first-order compliance must improve the prediction for the exact column to be
computed. It only saves time: where the first order fails, at 8 Hz, the improvement is 1.5 or more."""
FIRST_ORDER = 0.15
"""Possible relative error of the correction for compliance: its column is of first order in the deflection, and a rotor
inertia that is regrouped with that of its link moves with the link (`docs/derivations.md`)."""
LEAST_LOAD = 5e-3
"""Smallest load-dependent friction that is reported."""
SPREAD_SHARE = 0.3
"""Smallest standard deviation of load-dependent friction between joints, as a share of its mean."""
LEAST_STD, BEGIN, MOST_STD = 1e-3, 1e-2, 1.0
"""Smallest standard deviation between joints, the one at which the search is split, and the largest."""
MEANS = (0.0, 1.0)
"""Smallest and largest mean of all joints."""
SETTLED = 1e-13
"""Relative tolerance of the standard deviation."""


@dataclass(frozen=True, slots=True)
class Belief:
    """A normal prior of a parameter."""

    mean: float
    std: float


ANY_DRIVE = Belief(LOAD_MEAN, LOAD_STD)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AlternativeModel:
    """An alternative model: a share of its difference from the selected one counts as a standard deviation."""

    share: float  # that share
    other: Fit  # its fit
    final: Fit  # the fit of the selected model


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Selected:
    """The model selected by the data."""

    final: Fit  # its fit
    remarks: tuple[str, ...]  # what was selected, in words
    rivals: tuple[AlternativeModel, ...] = ()  # alternative models
    stiff: Fit | None = None  # the same model with rigid joints if the data selected elastic ones, else None
    # relative change of each gain per standard deviation of laws of the gains that it neglects, shape (n, m):
    unsure: Array | None = None
    # gain over current, by joint, from laws that correct the gains:
    curves: Mapping[int, GainCurve] = field(default_factory=dict[int, GainCurve])

    @property
    def model(self) -> Array:
        """Relative change of each gain per standard deviation of other models and neglected laws, shape (n, m)."""
        unsure = np.zeros((len(self.final.h), 0)) if self.unsure is None else self.unsure
        others = (each.share * np.log(np.abs(each.other.h / each.final.h)) for each in self.rivals)
        return np.column_stack([unsure, *others])


def selected(ready: Setting, laws: Mapping[str, float], *, corrected: bool = False, yielding: bool = False) -> Selected:
    """Select the model of a problem with recorded motions.

    `laws` of the gains have the scale of the standard deviation of their coefficients; those that the data show correct
    the gains or are reported. If joints are not known to be `yielding`, the data decide.
    """
    plain = fit(ready, {}, None)
    ready = replace(ready, blocks=plain.model.blocks)  # orthonormal near the result
    plain = replace(plain, ready=ready)
    along = torques_of(ready, plain.theta)
    loads, ready = load_terms(ready, plain, along, tuple(LOAD_FORMS)), with_softened(ready, along)
    speeds = speed_terms(ready, tuple(SPEED_TERMS))
    elastic, soft = np.arange(ready.n), fit(ready.widened(ready.softened), {}, plain)
    if yielding or z_of(improvement(soft, plain).sum(axis=0)) > SUSPECTED:
        beside = [*(term.column for term in speeds.values()), *(loads[form][form] for form in LOAD_FORMS)]
        exact = transmitted_columns(ready, plain, along, beside)
        rigid = np.zeros(ready.n, dtype=bool)
        while True:
            elastic = elastic[~rigid]
            soft = fit(ready.widened(exact[:, elastic]), {}, plain) if len(elastic) else plain
            if yielding or not len(elastic) or not (rigid := of_negative_compliance(soft, len(elastic))).any():
                break
    del along  # large for long logs
    yields = yielding or z_of(improvement(soft, plain).sum(axis=0)) > BETTER
    base, elastic = (soft, elastic) if yields else (plain, elastic[:0])
    bent, chosen = dict[str, list[int]](), dict[str, Term]()
    for law, term in speeds.items():
        gain = improvement(fit(base.ready, {law: term}, base), base)
        bent[law] = [j for j in range(ready.n) if z_of(gain[j]) > BETTER]
        if bent[law]:
            chosen[law] = Term(np.where(np.isin(ready.columns.joint, bent[law]), term.column, 0.0))
    found = {form: _with_load(form, ready, base, chosen, loads[form], elastic) for form in LOAD_FORMS}
    best = max(found, key=lambda name: improvement(found[name].fit, base).sum())
    form = best if z_of(improvement(found[best].fit, found[MOTOR].fit).sum(axis=0)) > BETTER else MOTOR
    final = found[form]
    rivals = [mixture(final.fit, each.fit) for other, each in found.items() if other != form]
    if yields:
        rivals.append(AlternativeModel(share=FIRST_ORDER, other=plain, final=soft))
    remarks = [_load_note(form, final.belief)]
    remarks += [f"{SPEED_TERMS[law]} on {joint_list(joints)}" for law, joints in bent.items() if joints]
    if yields:
        others = np.setdiff1d(np.arange(ready.n), elastic).tolist()
        but = f" (but not of {joint_list(others)}, whose compliance would be negative)" if others else ""
        remarks.append(f"joint elasticity detected and modelled{but}")
    known = {} if ready.given else laws  # which the error of a given gain would imitate
    lawful = with_laws(final.terms, final.fit, known, corrected=corrected)
    stiff = None
    if yields and not yielding:
        stiff = fit(ready.widened(lawful.scaled, lawful.std), lawful.terms, lawful.fit)
    return Selected(
        final=lawful.fit,
        rivals=tuple(rivals),
        remarks=(*remarks, *lawful.remarks),
        stiff=stiff,
        unsure=lawful.unsure,
        curves=lawful.curves,
    )


def of_negative_compliance(soft: Fit, count: int) -> Mask:
    """Mask of the compliances, the last shared parameters of a fit, that are significantly negative, shape (count,)."""
    own = np.arange(len(soft.theta) - count, len(soft.theta))
    return soft.theta[own] < -BETTER * deviations(soft.of_theta(own).from_data)


def _load_note(form: str, belief: Belief) -> str:
    mean, spread = 100.0 * belief.mean, 100.0 * belief.std
    if belief.mean < LEAST_LOAD:
        allowed = f"{np.hypot(mean, spread):.2g} % of {LOAD_FORMS[form]}"
        return f"no load-dependent friction detected; the gains' intervals allow for an undetected one of {allowed}"
    return f"load-dependent friction: {mean:.2g} % of {LOAD_FORMS[form]}, varying by {spread:.2g} % between joints"


def mixture(best: Fit, other: Fit) -> AlternativeModel:
    """Return another form of load-dependent friction as an alternative: the truth may be a mixture of both.

    With a share w of the other form, the sum of squares changes by a w^2 - 2 b w, where a is that of the difference of
    both predictions and b is due to noise. Its minimum is at w = b / a, with standard error sd(b) / a; the other form
    alone, w = 1, has a - 2 b more. If the data do not distinguish them, both are equally probable, and the rms error is
    sqrt(1/2) of the difference.
    """
    apart = np.sum(((best.predicted() - other.predicted()) / other.model.sigma[:, None, None]) ** 2)
    share = mixture_share(improvement(best, other).sum(axis=0), float(apart))
    return AlternativeModel(share=share, other=other, final=best)


def mixture_share(more: Array, apart: float) -> float:
    """Return the share of `mixture`, from the improvement by block (B,) and a."""
    noise = np.sqrt(len(more)) * more.std(ddof=1) / 2.0
    part = np.hypot(max(0.0, apart - more.sum()) / 2.0, noise) / max(apart, 1e-300)
    return float(min(part, np.sqrt(0.5)))


@dataclass(frozen=True, slots=True, eq=False)
class _Loaded:
    """A fit with load-dependent friction, its terms, and the prior of its coefficients."""

    fit: Fit
    terms: Mapping[str, Term]
    belief: Belief


def _with_load(
    form: str, ready: Setting, base: Fit, chosen: Mapping[str, Term], first: Mapping[str, Array], elastic: Indices
) -> _Loaded:
    """Fit load-dependent friction of one form, with torques from an earlier fit that included it.

    If the estimated share of the offset that is not a torque is impossible, data cannot separate it from the friction,
    and all of the joint's offset counts as torque.
    """

    def found(offsets: Mask) -> tuple[_Loaded, Mask]:
        where, columns, belief, free, fitted = base.ready, first, ANY_DRIVE, base, base
        for last in (False, False, True):
            if last:
                k = fitted.model.names.index((form, -1))
                joints = np.flatnonzero(fitted.model.own.used[:, k])
                noise = fitted.of_own(joints, np.full(len(joints), k)).std
                belief = prior_of_drives(fitted.phi[joints, k], noise)
            priors, on = SHARES | {form: (belief.mean, belief.std)}, offsets[ready.columns.joint]
            own = {x: Term(np.where(on | (x != OFFSET), c, 0.0), *priors[x]) for x, c in columns.items()}
            terms = {**chosen, **own}
            free, fitted = fitted, fit(where, terms, fitted)
            if not last:
                where, loads = columns_along(ready, fitted, [form], elastic, chosen)
                columns = loads[form]
        return _Loaded(fitted, terms, belief), offsets & _is_possible(free, form) & _is_possible(fitted, form)

    offsets = np.full(ready.n, form != LINKS)
    loaded, possible = found(offsets)
    return loaded if (possible == offsets).all() else found(possible)[0]


def _is_possible(fitted: Fit, form: str) -> Mask:
    """Whether each joint's friction coefficient and the share of its offset that is not a torque are possible, (n,)."""
    mean, std = SHARES[OFFSET]
    off = fitted.common(OFFSET, mean) - mean
    return (np.abs(fitted.common(form, 0.0)) < STRONGEST) & (np.abs(off) < BETTER * std)


def prior_of_drives(seen: Array, noise: Array) -> Belief:
    """Return the prior of a coefficient from estimates of single joints, and the standard deviations of their noise.

    A joint without a gain may end at c = 1, where V = |V| s holds for any torque: it is excluded.
    """
    shown = np.abs(seen) < STRONGEST
    if not shown.any():
        return ANY_DRIVE
    belief = fitted_prior(seen[shown], noise[shown])
    return Belief(belief.mean, max(belief.std, SPREAD_SHARE * belief.mean))


def fitted_prior(seen: Array, noise: Array) -> Belief:
    """Return the normal distribution of maximum likelihood of a parameter over k drives (empirical Bayes).

    From noisy values and the standard deviation of the noise of each, positive, shapes (k,).
    """
    low, high = (LEAST_STD, BEGIN) if likelihood_slope(seen, noise, BEGIN) > 0.0 else (BEGIN, MOST_STD)
    if likelihood_slope(seen, noise, low) >= 0.0:
        high = low
    elif likelihood_slope(seen, noise, high) <= 0.0:
        low = high
    while high > low * (1.0 + SETTLED):
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if likelihood_slope(seen, noise, middle) < 0.0 else (low, middle)
    std = float(np.sqrt(low * high))
    return Belief(_mean(seen, noise, std), std)


def likelihood_slope(seen: Array, noise: Array, std: float) -> float:
    """Derivative of -2 log L by log std, at the most likely mean.

    -2 log L = sum log v + (x - mean)^2 / v, v = noise^2 + std^2. If its derivative by the mean is not zero, the mean is
    at a limit of `MEANS`; so a change of the mean does not contribute.
    """
    v = noise**2 + std**2
    return float(np.sum((1.0 - (seen - _mean(seen, noise, std)) ** 2 / v) / v)) * 2.0 * std**2


def _mean(seen: Array, noise: Array, std: float) -> float:
    weight = 1.0 / (noise**2 + std**2)
    return float(np.clip(weight @ seen / weight.sum(), *MEANS))
