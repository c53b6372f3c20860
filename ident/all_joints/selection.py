"""What data decide about the model: a term is added where stretches that were left out say so.

load        friction in proportion to torque, always, with one belief about all joints' coefficients that the joints
themselves give: drives of one arm are of one kind. Where a joint shows its own, the belief has no say.
form        of the motor's torque or of the rigid one: what predicts better; the other one is a share of the interval
cbrt        viscous friction that grows less than the speed, joint by joint
compliance  of all joints, or of none
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize

from ident.all_joints.friction import Term
from ident.all_joints.solution import Fitted, Setting, Terms, fit_with
from ident.all_joints.terms import LOAD_FORMS, TermColumns, speed_terms, torque_terms
from ident.arrays import Array
from ident.uncertainty.cautious import cautious
from ident.uncertainty.jackknife import left_out

BETTER = 2.0
"""Standard errors by which left-out stretches must be predicted better for a term to stay."""
LEAST_SPREAD, SPREAD_SHARE = 1e-3, 0.3
"""Least deviation of load friction between joints that is believed, on its own and as a share of their mean."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Selected:
    """The model that data chose.

    Attributes:
        final: Its fit.
        model: Relative change of each gain to other defensible models, shape (n, m).
        remarks: What was chosen, in words.
    """

    final: Fitted
    model: Array
    remarks: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Belief:
    """Mean and deviation of the coefficients of load friction of an arm's joints."""

    mean: float
    std: float


def selected(ready: Setting) -> Selected:
    """Choose the model of a problem whose motions come from recordings."""
    nothing: Terms = [{} for _ in range(ready.n)]
    plain = fit_with(ready, nothing, (), None)
    first = torque_terms(ready.problem, ready.shared, plain.own, plain.fit, compliance=True)
    root = speed_terms(ready.problem)
    trial = fit_with(ready, nothing, first.softened, plain)
    soft = _better(plain, trial, range(ready.n))
    yields: Sequence[Array] = first.softened if soft else ()
    base = trial if soft else plain
    curved = fit_with(ready, [{"cbrt": Term(each["cbrt"])} for each in root.own], yields, base)
    bent = [j for j in range(ready.n) if _better(base, curved, [j])]
    chosen = [{"cbrt": Term(root.own[j]["cbrt"])} if j in bent else {} for j in range(ready.n)]
    fits, beliefs = dict[str, Fitted](), dict[str, _Belief]()
    for form in LOAD_FORMS:
        fits[form], beliefs[form] = _with_load(ready, chosen, first, yields, base, form, soft)
    form, other = sorted(LOAD_FORMS, key=lambda name: _held_out(fits[name]).sum())
    shift = np.log(np.abs(fits[other].fit.found.h / fits[form].fit.found.h))
    remarks = [
        f"friction grows with load: {100.0 * beliefs[form].mean:.2g} % of the "
        f"{'motor torque' if form == 'load-motor' else 'torque of links and payload'}, "
        f"{100.0 * beliefs[form].std:.2g} % from joint to joint"
    ]
    if bent:
        remarks.append(f"viscous friction grows less than the speed on joint {', '.join(str(j + 1) for j in bent)}")
    if soft:
        remarks.append("the joints yield")
    return Selected(final=fits[form], model=0.5 * shift[:, None], remarks=tuple(remarks))


def _with_load(
    ready: Setting,
    chosen: Terms,
    first: TermColumns,
    yields: Sequence[Array],
    base: Fitted,
    form: str,
    soft: bool,
) -> tuple[Fitted, _Belief]:
    """A fit with load friction of one form, its torques taken from a fit that had it, and what it came to believe."""
    free = fit_with(ready, _grown(chosen, form, first, None), yields, base)
    again = torque_terms(ready.problem, ready.shared, free.own, free.fit, compliance=soft)
    belief = _belief(free, form)
    return fit_with(ready, _grown(chosen, form, again, belief), again.softened, free), belief


def _grown(chosen: Terms, form: str, columns: TermColumns, belief: _Belief | None) -> Terms:
    mean, std = (0.0, float("inf")) if belief is None else (belief.mean, belief.std)
    return [{**terms, form: Term(own[form], mean, std)} for terms, own in zip(chosen, columns.own, strict=True)]


def _belief(free: Fitted, form: str) -> _Belief:
    """Mean and spread of the joints' coefficients, by the largest likelihood of what each joint shows alone."""
    value, std = list[float](), list[float]()
    for own, phi, influence in zip(free.own, free.fit.phi, free.fit.phi_influence, strict=True):
        if form in own.names:
            k = own.names.index(form)
            value.append(float(phi[k]))
            std.append(float(np.sqrt(cautious(free.fit.rows, influence[k : k + 1], 0.0)[0, 0])))
    seen, noise = np.array(value), np.array(std)

    def unlikely(x: Array) -> float:
        mean, spread = x[0], np.exp(x[1])
        variance = noise**2 + spread**2
        return float(np.sum(np.log(variance) + (seen - mean) ** 2 / variance))

    weights = noise**-2.0
    start = max(0.0, float(weights @ seen / weights.sum()))
    best = optimize.minimize(
        unlikely, (start, np.log(0.01)), bounds=((0.0, 1.0), (np.log(LEAST_SPREAD), 0.0)), method="L-BFGS-B"
    )
    mean, spread = float(best.x[0]), float(np.exp(best.x[1]))
    return _Belief(mean, max(spread, SPREAD_SHARE * mean))


def _held_out(fitted: Fitted) -> Array:
    """Sum of squares of weighted residuals of each stretch left out, joint by joint, shape (stretches, n)."""
    rows = fitted.fit.rows
    n = int(rows.joint.max()) + 1
    squares = [((rows.weight[block] * left) ** 2, rows.joint[block]) for block, left in left_out(rows)]
    return np.array([np.bincount(joint, weights=each, minlength=n) for each, joint in squares], dtype=np.float64)


def _better(before: Fitted, after: Fitted, joints: Sequence[int]) -> bool:
    """Whether stretches that were left out are predicted better."""
    scale = (before.fit.rows.weight / after.fit.rows.weight) ** 2
    first = np.unique(before.fit.rows.joint, return_index=True)[1]
    gain = (_held_out(before) - _held_out(after) * scale[first])[:, list(joints)].sum(axis=1)
    return bool(gain.mean() > BETTER * gain.std(ddof=1) / np.sqrt(len(gain)))
