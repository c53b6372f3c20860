"""Model selection by cross-validation: a term is added if it improves the prediction of omitted time blocks.

load        friction proportional to torque, always, with a common prior of all joints' coefficients, estimated from the
            joints, as drives of one arm are similar; it hardly affects a joint with accurate data
form        proportional to the torque of the motor, in the gears or at their output: the best prediction is selected;
            the others contribute to the interval, by the largest share that a mixture can have of them
cbrt        viscous friction that grows less than linearly with speed, joint by joint
compliance  of all joints, or of none; a joint whose compliance is significantly negative stays rigid, as no joint is
            like that: a delay of its currents or its friction explains the same currents
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.estimation.all_joints.empirical_prior import Belief, likeliest
from ident.estimation.all_joints.fit import AllJointsFit
from ident.estimation.all_joints.friction import OwnColumns, Term
from ident.estimation.all_joints.solution import Fitted, Setting, Terms, fit_with
from ident.estimation.all_joints.stiffness import assumed_compliance
from ident.estimation.all_joints.terms import (
    LINKS,
    LOAD_FORMS,
    LOAD_MEAN,
    LOAD_STD,
    OFFSET,
    SHARES,
    SPEED_TERMS,
    STRONGEST,
    TermColumns,
    speed_terms,
    torque_terms,
)
from ident.estimation.all_joints.transmitted import by_currents
from ident.estimation.uncertainty import left_out, max_of_classical_and_jackknife
from ident.support.arrays import Array, Indices, Mask
from ident.support.naming import joint_list

BETTER = 2.0
"""Number of standard errors by which the prediction of omitted time blocks must improve for a term to be selected.

It applies to each joint's term, without a correction for multiple tests: in 100 runs of `nominal` no useless term was
selected on a joint with a gain. 2.9, by Bonferroni's inequality for twelve tests, changes no error there, on `field` or
with load-dependent friction, but omits two cube roots of a real arm, whose standard deviations then grow by a tenth.
"""
SUSPECTED = 1.0
"""Number of standard errors by which first-order compliance must improve the prediction for the exact column to be
computed.

It only saves time: where the first order fails, at 8 Hz, the improvement is 1.5 or more; a sixth of rigid arms exceed
the limit.
"""
FIRST_ORDER = 0.15
"""Possible relative error of the correction for compliance: its column is of first order in the deflection, and a rotor
inertia that is regrouped with that of its link moves with the link (`docs/derivations.md`)."""
LEAST_LOAD = 5e-3
"""Smallest load-dependent friction that is reported."""
SPREAD_SHARE = 0.3
"""Smallest standard deviation of load-dependent friction between joints, as a share of its mean."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AlternativeModel:
    """An alternative model: a share of its difference from the selected one counts as a standard deviation.

    Attributes:
        share: That share.
        other: Its fit.
        final: The fit of the selected model.
    """

    share: float
    other: Fitted
    final: Fitted


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Selected:
    """The model selected by the data.

    Attributes:
        final: Its fit.
        rivals: Alternative models.
        remarks: What was selected, in words.
        softened: Change of the torque of each joint's rows at the largest compliance of real drives, n arrays of shape
            (r_j,); a model with elastic joints has it among its columns.
        stiff: The same model with rigid joints if the data selected elastic ones, else None.
    """

    final: Fitted
    remarks: tuple[str, ...]
    rivals: tuple[AlternativeModel, ...] = ()
    softened: tuple[Array, ...] = ()
    stiff: Fitted | None = None

    @property
    def model(self) -> Array:
        """Relative change of each gain per standard deviation, one column for each alternative model, shape (n, m)."""
        nothing = np.zeros((len(self.final.own), 0))
        return np.column_stack([nothing, *(each.share * _log_ratio(each.other, each.final) for each in self.rivals)])


ANY_DRIVE = Belief(LOAD_MEAN, LOAD_STD)


@dataclass(frozen=True, slots=True, eq=False)
class _Elastic:
    """Elastic joints.

    Attributes:
        joints: Their indices, shape (e,).
        columns: Change of the torque of each joint's rows per compliance of each elastic joint, n arrays of shape (r_j,
            e); empty for rigid joints.
    """

    joints: Indices
    columns: Sequence[Array]

    def among(self, softened: Sequence[Array]) -> tuple[Array, ...]:
        """Columns of the elastic joints among those of all, n arrays of shape (r_j, n)."""
        return tuple(each[:, self.joints] for each in softened)

    def without(self, rigid: Mask) -> "_Elastic":
        """Leave out some of the elastic joints, shape (e,)."""
        return _Elastic(self.joints[~rigid], tuple(each[:, ~rigid] for each in self.columns))


RIGID = _Elastic(np.zeros(0, dtype=np.intp), ())


def selected(ready: Setting, *, yielding: bool = False) -> Selected:
    """Select the model of a problem with recorded motions.

    Args:
        ready: The problem.
        yielding: Whether joints are known to be elastic; else the data decide.
    """
    nothing: Terms = [{} for _ in range(ready.n)]
    plain = _tried(fit_with(ready, nothing, (), None))
    first = torque_terms(ready.problem, ready.shared, plain.fitted.own, plain.fitted.fit, compliance=True)
    speeds = speed_terms(ready.problem)
    elastic = _Elastic(np.arange(ready.n), first.softened)
    soft = _tried(fit_with(ready, nothing, elastic.columns, plain.fitted))
    if yielding or soft.surer_than(plain, range(ready.n)) > SUSPECTED:
        laws = [{law: term.column for law, term in each.items()} for each in speeds]
        torques = [a | b for a, b in zip(laws, first.own, strict=True)]
        elastic = _Elastic(elastic.joints, by_currents(ready, first, plain.fitted, torques))
        soft = _tried(fit_with(ready, nothing, elastic.columns, plain.fitted))
        while not yielding and (rigid := _of_negative_compliance(soft.fitted.fit, len(elastic.joints))).any():
            elastic = elastic.without(rigid)
            soft = _tried(fit_with(ready, nothing, elastic.columns, plain.fitted)) if len(elastic.joints) else plain
    yields = yielding or soft.surer_than(plain, range(ready.n)) > BETTER
    base, elastic = (soft, elastic) if yields else (plain, RIGID)
    bent = {law: _bent(ready, law, speeds, elastic, base) for law in SPEED_TERMS}
    chosen: Terms = [{law: terms[law] for law in SPEED_TERMS if j in bent[law]} for j, terms in enumerate(speeds)]
    loads = {form: _with_load(ready, chosen, first, elastic, base.fitted, form) for form in LOAD_FORMS}
    form = _form_of(loads, base)
    best = loads[form].tried
    rivals = [_beside(best, each.tried) for other, each in loads.items() if other != form]
    if yields:
        rivals.append(AlternativeModel(share=FIRST_ORDER, other=plain.fitted, final=soft.fitted))
    remarks = [_load_note(form, loads[form].belief)]
    remarks += [f"{SPEED_TERMS[law].words} on {joint_list(sorted(joints))}" for law, joints in bent.items() if joints]
    if yields:
        rigid_ones = np.setdiff1d(np.arange(ready.n), elastic.joints).tolist()
        remarks.append(f"joint elasticity detected and modelled{_except(rigid_ones)}")
    compliance = assumed_compliance(ready.problem, ready.shared, plain.fitted.fit.found.theta)
    return Selected(
        final=best.fitted,
        rivals=tuple(rivals),
        remarks=tuple(remarks),
        softened=tuple(each @ compliance for each in first.softened),
        stiff=fit_with(ready, loads[form].terms, (), best.fitted) if yields and not yielding else None,
    )


def _of_negative_compliance(fit: AllJointsFit, count: int) -> Mask:
    """Mask of the compliances, the last shared parameters of a fit, that are significantly negative, shape (count,)."""
    own = slice(len(fit.found.theta) - count, None)
    covariance = max_of_classical_and_jackknife(fit.rows, fit.theta_influence[own])
    return fit.found.theta[own] < -BETTER * np.sqrt(np.diag(covariance))


def _except(joints: Sequence[int]) -> str:
    """Return joints, from 0, whose negative compliance is not modelled, in words."""
    return f" (but not of {joint_list(joints)}, whose compliance would be negative)" if joints else ""


def _load_note(form: str, belief: Belief) -> str:
    mean, spread = 100.0 * belief.mean, 100.0 * belief.std
    if belief.mean < LEAST_LOAD:
        allowed = f"{np.hypot(mean, spread):.2g} % of {LOAD_FORMS[form]}"
        return f"no load-dependent friction detected; the gains' intervals allow for an undetected one of {allowed}"
    return f"load-dependent friction: {mean:.2g} % of {LOAD_FORMS[form]}, varying by {spread:.2g} % between joints"


def _form_of(loads: Mapping[str, "_Loaded"], base: "_Tried") -> str:
    """Return the form of load-dependent friction that predicts best, if significantly, else `load-motor`."""
    motor, *_ = LOAD_FORMS
    best = max(loads, key=lambda name: loads[name].tried.better_than(base).sum())
    surer = loads[best].tried.surer_than(loads[motor].tried, range(len(base.fitted.own)))
    return best if surer > BETTER else motor


def _beside(best: "_Tried", other: "_Tried") -> AlternativeModel:
    """Return another form of load-dependent friction as an alternative: the truth may be a mixture of both.

    With a share w of the other form, the sum of squares changes by a w^2 - 2 b w, where a is that of the difference of
    both predictions and b is due to noise. Its minimum is at w = b / a, with standard error sd(b) / a; the other form
    alone, w = 1, has a - 2 b more. If the data do not distinguish them, both are equally probable, and the rms error is
    sqrt(1/2) of the difference.
    """
    more = best.better_than(other).sum(axis=1)
    apart = best.apart_from(other)
    noise = np.sqrt(len(more)) * more.std(ddof=1) / 2.0
    part = np.hypot(max(0.0, apart - more.sum()) / 2.0, noise) / max(apart, 1e-300)
    return AlternativeModel(share=float(min(part, np.sqrt(0.5))), other=other.fitted, final=best.fitted)


def _bent(
    ready: Setting, law: str, speeds: Sequence[Mapping[str, Term]], elastic: _Elastic, base: "_Tried"
) -> list[int]:
    """Joints, from 0, for which a friction law of the speed is selected."""
    tried = _tried(fit_with(ready, [{law: terms[law]} for terms in speeds], elastic.columns, base.fitted))
    return [j for j in range(ready.n) if tried.surer_than(base, [j]) > BETTER]


def _log_ratio(one: Fitted, other: Fitted) -> Array:
    """Relative difference of the gains of two fits, shape (n,)."""
    return np.log(np.abs(one.fit.found.h / other.fit.found.h))


@dataclass(frozen=True, slots=True, eq=False)
class _Tried:
    """A fit and its prediction of omitted time blocks.

    Attributes:
        fitted: The fit.
        left: Prediction error of each row [drive units], shape (r,).
        squares: Sum of its weighted squares in each block, joint by joint, shape (blocks, n).
    """

    fitted: Fitted
    left: Array
    squares: Array

    def surer_than(self, other: "_Tried", joints: Sequence[int]) -> float:
        """Improvement of the prediction of omitted blocks over another fit, in standard errors."""
        gain = self.better_than(other)[:, list(joints)].sum(axis=1)
        return float(gain.mean() / max(gain.std(ddof=1) / np.sqrt(len(gain)), 1e-300))

    def better_than(self, other: "_Tried") -> Array:
        """Reduction of the sum of squares from another fit, by the other's weights, shape (blocks, n)."""
        rows, before = self.fitted.fit.rows, other.fitted.fit.rows
        first = np.unique(rows.joint, return_index=True)[1]
        same = (before.weight / rows.weight)[first] ** 2
        return other.squares - same * self.squares

    def apart_from(self, other: "_Tried") -> float:
        """Sum of squares of the difference of both predictions, in units of the other's weights."""
        return float(np.sum((other.fitted.fit.rows.weight * (self.left - other.left)) ** 2))


def _tried(fitted: Fitted) -> _Tried:
    rows, n = fitted.fit.rows, len(fitted.own)
    left, counted = np.empty(len(rows.joint)), []
    for block, fresh in left_out(rows):
        left[block] = fresh
        counted.append(np.bincount(rows.joint[block], weights=(rows.weight[block] * fresh) ** 2, minlength=n))
    return _Tried(fitted, left, np.array(counted, dtype=np.float64))


@dataclass(frozen=True, slots=True, eq=False)
class _Loaded:
    """A fit with load-dependent friction, its terms, and the prior of its coefficients."""

    tried: _Tried
    terms: Terms
    belief: Belief


def _with_load(
    ready: Setting,
    chosen: Terms,
    first: TermColumns,
    elastic: _Elastic,
    base: Fitted,
    form: str,
) -> _Loaded:
    """Fit load-dependent friction of one form, with torques from an earlier fit that included it.

    If the estimated share of the offset that is not a torque is impossible, data cannot separate it from the friction,
    and all of the joint's offset counts as torque.

    Args:
        ready: The problem.
        chosen: Terms that are selected for each joint.
        first: Columns from the torques of rigid joints.
        elastic: The elastic joints.
        base: An earlier fit.
        form: A name in `LOAD_FORMS`.
    """

    def columns(fitted: Fitted) -> TermColumns:
        own, fit = fitted.own, fitted.fit
        yields = bool(elastic.columns)
        found = torque_terms(ready.problem, ready.shared, own, fit, compliance=yields, forms=[form])
        if not yields:
            return found
        return replace(found, softened=elastic.among(by_currents(ready, found, fitted, found.own)))

    def found(offsets: Collection[int]) -> tuple[_Loaded, list[int]]:
        free = fit_with(ready, _grown(chosen, form, first, ANY_DRIVE, offsets), elastic.columns, base)
        again = columns(free)
        free = fit_with(ready, _grown(chosen, form, again, ANY_DRIVE, offsets), again.softened, free)
        again = columns(free)
        belief = _belief(free, form)
        terms = _grown(chosen, form, again, belief, offsets)
        final = fit_with(ready, terms, again.softened, free)
        told = [j for j in offsets if all(_is_possible(each.own[j], each.fit.phi[j], form) for each in (free, final))]
        return _Loaded(_tried(final), terms, belief), told

    offsets = [] if form == LINKS else list(range(ready.n))
    loaded, told = found(offsets)
    return loaded if told == offsets else found(told)[0]


def _is_possible(own: OwnColumns, phi: Array, form: str) -> bool:
    """Whether a joint's friction coefficient and the share of its offset that is not a torque are possible."""
    value, belief = dict(zip(own.names, phi.tolist(), strict=True)), SHARES[OFFSET]
    off = value.get(OFFSET, belief.mean) - belief.mean
    return abs(value.get(form, 0.0)) < STRONGEST and abs(off) < BETTER * belief.std


def _grown(
    chosen: Terms, form: str, columns: TermColumns, belief: Belief, offsets: Collection[int]
) -> list[dict[str, Term]]:
    """Add load-dependent friction and its shares to each joint's terms; that of the offset on some joints only."""
    terms = list[dict[str, Term]]()
    for j, (each, own, shares) in enumerate(zip(chosen, columns.own, columns.shares, strict=True)):
        beside = {name: column for name, column in shares[form].items() if name != OFFSET or j in offsets}
        believed = {name: Term(column, SHARES[name].mean, SHARES[name].std) for name, column in beside.items()}
        terms.append({**each, form: Term(own[form], belief.mean, belief.std), **believed})
    return terms


def _belief(free: Fitted, form: str) -> Belief:
    """Return the prior of the joints' coefficients, by maximum likelihood from the estimates of single joints.

    A joint without a gain may end at c = 1, where V = |V| s holds for any torque: it is excluded.
    """
    at = [(j, own.names.index(form)) for j, own in enumerate(free.own) if form in own.names]
    seen = np.array([free.fit.phi[j][k] for j, k in at])
    influence = np.array([free.fit.own_influence(j, np.eye(1, len(free.own[j].names), k))[0] for j, k in at])
    held = np.array([np.linalg.norm(free.fit.phi_belief[j][k]) for j, k in at])
    noise = np.hypot(np.sqrt(np.diag(max_of_classical_and_jackknife(free.fit.rows, influence))), held)
    shown = np.abs(seen) < STRONGEST
    if not shown.any():
        return ANY_DRIVE
    found = likeliest(seen[shown], noise[shown])
    return Belief(found.mean, max(found.std, SPREAD_SHARE * found.mean))
