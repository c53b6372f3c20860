"""Drive gains of all joints at once: common link parameters, each joint's friction in current units, logarithmic gains.

V_j = h_j (A_j theta + k_j) + F_j phi_j with h = 1/g, rows weighted by each joint's residual. Link parameters that act
on several joints relate their gains, so that the gain of a joint that the known payload hardly loads follows from those
of its neighbours.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np
from annotated_types import Interval, Unit

from ident.estimation.all_joints import Fit, fit, search, solution
from ident.estimation.blocks import ROUNDING
from ident.estimation.estimate import GainEstimate, judge_identifiability
from ident.estimation.intervals import rms
from ident.estimation.laws import POSITION, SCALE, SIGN, SIZE, TIME
from ident.estimation.problem import Problem
from ident.estimation.selection import Selected, selected
from ident.estimation.setting import GivenGain, Setting, Term, setting
from ident.estimation.sweep import independent_misplacements
from ident.estimation.terms import LOAD_FORMS, SPEED_TERMS, columns_along, speed_terms, torques_of, with_softened
from ident.model.displacement import Dynamics
from ident.support.arrays import Array
from ident.support.errors import NotIdentifiable, OptionError
from ident.support.options import NAMES, refuse_outside, unknown_name

NAME = "nls"
AUTO = "auto"
PLAIN = "viscous-coulomb"
FRICTION_TERMS = (*LOAD_FORMS, *SPEED_TERMS)
"""Terms besides viscous and Coulomb friction (`ident.estimation.terms`), the same on every joint, without a prior."""
MILLIMETRE = 1e-3
"""Zero error of a prismatic joint [m] that corresponds to one degree of a revolute one."""
PASSES = 2
"""Number of fits after the first one if columns depend on fitted torques."""
FREEDOM = 4.0
"""Degrees of freedom of Student's distribution: heavy tails with little loss of efficiency for normal errors."""
GAUSSIAN = 1.4826
"""Ratio of standard deviation to median absolute value of a normal distribution."""
SETTLED = 1e-9
"""Largest change of the logarithm of a gain between fits at convergence."""
MOST_FITS = 100


def student(e: Array, V: Array) -> Array:
    """Return residuals of which the squares have the same minimum as Student's loss of the given ones.

    If the residuals e of a joint, u = e / s, follow Student's distribution with f degrees of freedom, the most likely
    unknowns satisfy sum J psi(u) = 0, with J the Jacobian. The currents

        V* = V - e + s psi(u) / mean(psi'(u))        psi(u) = (f + 1) u / (f + u^2)

    fitted by least squares have the same solution, and the least-squares covariance is the sandwich estimate s^2
    sum(psi^2) / (r - p) / mean(psi')^2 (J^T J)^-1 (Huber and Ronchetti 2009, sections 7.6 and 7.8). So everything that
    uses a least-squares fit, such as cross-validation, can use this one. The scale s is from the median of |e|.
    """
    s = max(GAUSSIAN * float(np.median(np.abs(e))), ROUNDING * rms(V))
    u2 = (e / s) ** 2
    slope = (FREEDOM + 1.0) * (FREEDOM - u2) / (FREEDOM + u2) ** 2
    return (FREEDOM + 1.0) * e / (FREEDOM + u2) / float(slope.mean())


LOSSES: dict[str, Callable[[Array, Array], Array] | None] = {"squares": None, "student": student}
"""Replacement of a joint's residuals by loss, such that least squares minimises it; None: as they are."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AllJointsOptions:
    """Options of `nls`.

    Attributes:
        friction: `auto`: terms selected by the data, joint by joint, with a prior of load-dependent friction;
            `viscous-coulomb`: no further terms; otherwise some of `FRICTION_TERMS`, joined by `+`.
        friction_per_motion: Whether viscous and Coulomb friction differ between motions.
        compliance: Whether joints are elastic, one compliance each; if not, `friction = "auto"` selects it from data.
        zero_std: Prior standard deviation of the joints' zeros [deg; mm for prismatic joints], which are estimated; 0
            if they are exact. Zeros of real arms have errors of 0.02 to 0.5 degrees; the default assumes a calibrated
            arm.
        tilt_std: Prior standard deviation of the base's tilt about each of two axes across gravity [deg], likewise. The
            default is 2 mm per metre.
        gain_laws: Whether laws of the gains that the data show correct them, for `friction = "auto"`; else they are
            reported, with the change. What does not correct the gains counts in their intervals.
        scale_std: Scale of the standard deviation of the gains between logs [%], for `friction = "auto"`, as for those
            of the following laws (`ident.estimation.laws`); 0 if gains do not depend on it. Magnets weaken by 0.1
            (samarium-cobalt: 0.04) to 0.2 % per K: the default is 2.5 to 5 K.
        size_std: The same of the fall of a gain from zero to peak current [%]: iron saturates.
        sign_std: The same of half the difference between both signs of a current [%]: current sensors are accurate to
            0.5 to 1 %.
        position_std: The same of the variation once a turn of the joint [%]; that of a geared motor is faster.
        time_std: The same of the fall within a log [%].
        loss: Loss of the residuals: their squares, or that of Student's t distribution, robust to gross outliers.
        prior_std: Prior standard deviation of log|1/g| about the initial value; it keeps the gain of an unloaded joint
            finite.
        gain_joint: Joint, from 1, whose gain is known, so that no payload is needed.
        gain_value: That gain [N m / drive unit].
    """

    friction: str = AUTO
    friction_per_motion: bool = True
    compliance: bool = False
    zero_std: Annotated[float, Interval(ge=0.0, le=45.0), Unit("deg")] = 0.1
    tilt_std: Annotated[float, Interval(ge=0.0, le=45.0), Unit("deg")] = 0.1
    gain_laws: bool = False
    scale_std: Annotated[float, Interval(ge=0.0, le=20.0), Unit("%")] = 0.5
    size_std: Annotated[float, Interval(ge=0.0, le=50.0), Unit("%")] = 2.0
    sign_std: Annotated[float, Interval(ge=0.0, le=20.0), Unit("%")] = 0.5
    position_std: Annotated[float, Interval(ge=0.0, le=20.0), Unit("%")] = 0.2
    time_std: Annotated[float, Interval(ge=0.0, le=20.0), Unit("%")] = 0.5
    loss: str = field(default="squares", metadata={NAMES: LOSSES})
    prior_std: Annotated[float, Interval(gt=0.0, le=100.0)] = 1.0
    gain_joint: int | None = None
    gain_value: Annotated[float | None, Interval(ge=-1e9, le=1e9), Unit("N m / drive unit")] = None

    def __post_init__(self) -> None:
        """Check the values; raises `OptionError`."""
        terms = self.friction_terms
        wrong = next((each for each in terms if each not in FRICTION_TERMS), None)
        if wrong is not None:
            raise unknown_name("friction", wrong, (AUTO, PLAIN, *FRICTION_TERMS))
        if len({*terms}) < len(terms) or len({*terms} & {*LOAD_FORMS}) > 1:
            raise OptionError(
                f"friction = {self.friction!r}: expected each term once, and at most one of {', '.join(LOAD_FORMS)}"
            )
        if self.loss not in LOSSES:
            raise unknown_name("loss", self.loss, LOSSES)
        refuse_outside(self, OptionError)
        if self.gain_laws and self.friction != AUTO:
            raise OptionError(f"gain_laws = true: expected friction = {AUTO!r}, not {self.friction!r}")
        if (self.gain_joint is None) != (self.gain_value is None):
            raise OptionError("gain_joint and gain_value must be given together: the number of a joint and its gain")
        if self.gain_value == 0.0:
            raise OptionError("gain_value = 0: expected a gain that is not zero")

    @property
    def friction_terms(self) -> tuple[str, ...]:
        """Terms that `friction` names."""
        return () if self.friction in (AUTO, PLAIN) else tuple(self.friction.split("+"))

    @property
    def laws(self) -> dict[str, float]:
        """Scale of the standard deviation of the coefficients of each law of the gains that is believed possible."""
        std = {
            SCALE: self.scale_std, SIZE: self.size_std, SIGN: self.sign_std, POSITION: self.position_std,
            TIME: self.time_std,
        }  # fmt: skip
        return {law: 0.01 * percent for law, percent in std.items() if percent}


def all_joints_gains(problem: Problem, options: AllJointsOptions) -> GainEstimate:
    """Estimate the gains of all joints together, from bare and loaded motions; raises `NotIdentifiable`."""
    given = list[GivenGain]()
    if options.gain_joint is not None and options.gain_value is not None:
        if not 1 <= options.gain_joint <= (n := problem.structure.arm.n):
            raise OptionError(f"gain_joint = {options.gain_joint}: the arm has joints 1 to {n}")
        given.append(GivenGain(options.gain_joint - 1, options.gain_value))
    ready = setting_of(problem, options, given)
    chosen = chosen_model(ready, options)
    found = solution(ready, chosen.final, chosen.model)
    if chosen.stiff is not None:
        found = replace(found, stiff=solution(ready, chosen.stiff, chosen.model[:, :0]))
    estimate = judge_identifiability(NAME, problem, replace(found, curves=chosen.curves))
    units = np.where(problem.structure.arm.revolute, "N m", "N").tolist()
    own = ((j, each.value, each.curve) for j, each in estimate.identified.items())
    curves = (curve.words(j, g, units[j]) for j, g, curve in own if curve is not None)
    return replace(estimate, remarks=(*chosen.remarks, *curves))


def setting_of(problem: Problem, options: AllJointsOptions, given: Sequence[GivenGain] | None) -> Setting:
    """Return the settings of a fit of all joints, with given gains as `setting`."""
    return setting(problem, per_motion=options.friction_per_motion, prior_std=options.prior_std, given=given)


def chosen_model(ready: Setting, options: AllJointsOptions) -> Selected:
    """Fit the model that the options name, or that the data select."""
    if ready.recorded and ready.shared.known.any():  # without a scale of the torques, zeros cannot be estimated
        elastic = options.compliance or options.friction == AUTO
        ready = with_misplaced(ready, zero_deg=options.zero_std, tilt_deg=options.tilt_std, elastic=elastic)
    tame = LOSSES[options.loss]
    if tame is None:
        return _chosen(ready, options)
    # the model is selected on currents without outliers, as the loss reduces them, and fitted with the loss
    plain, _ = settled(fit_as_named(ready, (), compliance=False), ready, tame)
    chosen = _chosen(ready.with_currents(plain.model.blocks.rows_of_currents), options)
    final, share = settled(chosen.final, ready, tame)
    remark = f"{100.0 * share:.2g} % of the rows have a weight below one half (loss = {options.loss})"
    return replace(chosen, final=final, remarks=(*chosen.remarks, remark))


def _chosen(ready: Setting, options: AllJointsOptions) -> Selected:
    if options.friction == AUTO and ready.recorded:
        return selected(ready, options.laws, corrected=options.gain_laws, yielding=options.compliance)
    return Selected(final=fit_as_named(ready, options.friction_terms, compliance=options.compliance), remarks=())


def with_misplaced(ready: Setting, *, zero_deg: float, tilt_deg: float, elastic: bool = False) -> Setting:
    """Add errors of the joints' zeros and tilt of the base, to first order, with their priors.

    Data that are more accurate than the calibration correct it; otherwise the prior contributes to the interval. Their
    standard deviations [deg; mm for prismatic joints] are those of `AllJointsOptions`. For joints that may be `elastic`
    the same torques give the columns of compliance.
    """
    if not zero_deg and not tilt_deg:
        return ready
    plain = fit(ready, {}, None)
    along = torques_of(ready, plain.theta)
    columns = ready.columns.of_logs([each.sweep.rows(each.by(Dynamics.misplaced)) for each in along])
    ready = with_softened(ready, along) if elastic else ready
    zero = np.where(ready.problem.structure.arm.revolute, np.radians(zero_deg), MILLIMETRE * zero_deg)
    std = np.concatenate((zero, np.full(columns.shape[1] - ready.n, np.radians(tilt_deg))))
    near, kept = replace(ready, blocks=plain.model.blocks), std > 0.0  # orthonormal near the result
    mountings = {id(motion.payload): motion.payload is not None for motion in ready.problem.motions}
    own = independent_misplacements(ready.problem.structure, tuple(mountings.values()), tuple(kept.tolist()))
    return near.widened(columns[:, kept], std[kept], own).restarted()


def settled(first: Fit, ready: Setting, tame: Callable[[Array, Array], Array]) -> tuple[Fit, float]:
    """Repeat a fit until the currents with replaced residuals, V*, are consistent with it; raises `NotIdentifiable`.

    Returns the fit, and the share of the rows whose residual was reduced to less than half.
    """
    V, joint, fitted = ready.columns.V, ready.columns.joint, first
    for _ in range(MOST_FITS):
        e = V - fitted.fitted_currents
        tamed = np.concatenate([tame(e[joint == j], V[joint == j]) for j in range(ready.n)])
        before, model = fitted.h, replace(fitted.model, blocks=fitted.model.blocks.with_currents(V - e + tamed))
        model, found = search(model, before, fitted.mean, fitted.log_std)
        fitted = replace(fitted, model=model, h=found.h, z=found.z, cost=found.cost)
        if np.abs(np.log(fitted.h / before)).max() < SETTLED:
            reduced = np.abs(fitted.rows.residual) < 0.5 * np.abs(V - fitted.fitted_currents)
            return fitted, float(np.mean(reduced))
    raise NotIdentifiable(
        f"with Student's loss the gains do not converge in {MOST_FITS} fits: too many outliers; check the "
        "currents, or set loss = squares"
    )


def fit_as_named(ready: Setting, names: Collection[str], *, compliance: bool) -> Fit:
    """Fit a model with the same terms, of `SPEED_TERMS` and `LOAD_FORMS`, on every joint, without priors of them."""
    laws, forms = ([name for name in kind if name in names] for kind in (SPEED_TERMS, LOAD_FORMS))
    speeds, elastic = speed_terms(ready, laws), np.arange(ready.n if compliance else 0)
    fitted = fit(ready, speeds, None)
    for _ in range(PASSES if compliance or forms else 0):
        wide, loads = columns_along(ready, fitted, forms, elastic, speeds)
        fitted = fit(wide, speeds | {form: Term(columns[form]) for form, columns in loads.items()}, fitted)
    return fitted
