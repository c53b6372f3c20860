"""Drive gains of all joints at once: common link parameters, each joint's friction in current units, logarithmic gains.

V_j = h_j (A_j theta + k_j) + F_j phi_j with h = 1/g, rows weighted by each joint's residual. Link parameters that act
on several joints relate their gains, so that the gain of a joint that the known payload hardly loads follows from those
of its neighbours.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated

from annotated_types import Interval, Unit

from ident.estimation.all_joints.friction import Term
from ident.estimation.all_joints.loss import LOSSES, Tame, drawn_in, settled
from ident.estimation.all_joints.misplaced import with_misplaced
from ident.estimation.all_joints.selection import Selected, selected
from ident.estimation.all_joints.solution import Fitted, GivenGain, Setting, fit_with, setting, solution
from ident.estimation.all_joints.terms import LOAD_FORMS, SPEED_TERMS, speed_terms, torque_terms
from ident.estimation.all_joints.transmitted import by_currents
from ident.estimation.estimate import GainEstimate
from ident.estimation.identifiability import judge_identifiability
from ident.estimation.problem import Problem
from ident.support.errors import OptionError
from ident.support.options import NAMES, refuse_outside, unknown_name

NAME = "nls"
AUTO = "auto"
PLAIN = "viscous-coulomb"
FRICTION_TERMS = (*LOAD_FORMS, *SPEED_TERMS)
"""Terms besides viscous and Coulomb friction, the same on every joint and without a prior: `cbrt`, the cube root of the
velocity; `by-direction`, its absolute value, so that viscous friction differs between directions; `load`, |torque of
links and payload| sign(dq); `load-motor`, |motor torque| sign(dq); `load-through`, |torque of links, payload and other
friction| sign(dq)."""


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
        tilt_std: Prior standard deviation of the base's tilt about its x and y axes [deg], likewise. The default is 2
            mm per metre.
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
        if (self.gain_joint is None) != (self.gain_value is None):
            raise OptionError("gain_joint and gain_value must be given together: the number of a joint and its gain")
        if self.gain_value == 0.0:
            raise OptionError("gain_value = 0: expected a gain that is not zero")

    @property
    def friction_terms(self) -> tuple[str, ...]:
        """Terms that `friction` names."""
        return () if self.friction in (AUTO, PLAIN) else tuple(self.friction.split("+"))


def all_joints_gains(problem: Problem, options: AllJointsOptions) -> GainEstimate:
    """Estimate the gains of all joints together.

    Args:
        problem: Motions, bare and with any number of payloads, fully or partly known.
        options: Friction and other parts of the model.

    Returns:
        A gain or a reason for each joint.

    Raises:
        NotIdentifiable: If nothing sets the scale of the gains, a joint has too few rows, or the iteration does not
            converge.
    """
    ready = setting_of(problem, options, _given(options, problem.structure.arm.n))
    chosen = chosen_model(ready, options)
    found = solution(ready, chosen.final, chosen.model, chosen.softened)
    if chosen.stiff is not None:
        found = replace(found, stiff=solution(ready, chosen.stiff, chosen.model[:, :0]))
    estimate = judge_identifiability(NAME, problem, found)
    return replace(estimate, remarks=chosen.remarks)


def setting_of(problem: Problem, options: AllJointsOptions, given: Sequence[GivenGain]) -> Setting:
    """Return the settings of a fit of all joints, with given gains."""
    return setting(problem, per_motion=options.friction_per_motion, prior_std=options.prior_std, given=given)


def chosen_model(ready: Setting, options: AllJointsOptions) -> Selected:
    """Fit the model that the options name, or that the data select."""
    tame = LOSSES[options.loss]
    recorded = all(motion.observation.full_rate is not None for motion in ready.problem.motions)
    if recorded and ready.shared.known.any():  # without a scale of the torques, zeros cannot be estimated
        ready = with_misplaced(ready, zero_deg=options.zero_std, tilt_deg=options.tilt_std)
    return _chosen(ready, options) if tame is None else _tamed(ready, options, tame)


def _chosen(ready: Setting, options: AllJointsOptions) -> Selected:
    recorded = all(motion.observation.full_rate is not None for motion in ready.problem.motions)
    if options.friction == AUTO and recorded:
        return selected(ready, yielding=options.compliance)
    final = fit_as_named(ready, options.friction_terms, compliance=options.compliance)
    return Selected(final=final, remarks=())


def _tamed(ready: Setting, options: AllJointsOptions, tame: Tame) -> Selected:
    """Select the model on currents without outliers, as its loss reduces them, and fit it with that loss."""
    plain = settled(fit_as_named(ready, (), compliance=False), ready.columns, tame)
    chosen = _chosen(replace(ready, columns=plain.columns), options)
    final = settled(chosen.final, ready.columns, tame)
    share = 100.0 * drawn_in(final, ready.columns)
    remark = f"{share:.2g} % of the rows have a weight below one half (loss = {options.loss})"
    return replace(chosen, final=final, remarks=(*chosen.remarks, remark))


def _given(options: AllJointsOptions, n: int) -> tuple[GivenGain, ...]:
    if options.gain_joint is None or options.gain_value is None:
        return ()
    if not 1 <= options.gain_joint <= n:
        raise OptionError(f"gain_joint = {options.gain_joint}: the arm has joints 1 to {n}")
    return (GivenGain(options.gain_joint - 1, options.gain_value),)


PASSES = 2
"""Number of fits after the first one if columns depend on fitted torques."""


def fit_as_named(ready: Setting, names: Collection[str], *, compliance: bool) -> Fitted:
    """Fit a model with the same terms on every joint, without a prior of their coefficients.

    Args:
        ready: The problem; from recordings if there are terms.
        names: Of `SPEED_TERMS` and `LOAD_FORMS`.
        compliance: Whether joints are elastic.
    """
    laws, forms = ([name for name in kind if name in names] for kind in (SPEED_TERMS, LOAD_FORMS))
    speeds = speed_terms(ready.problem, laws)
    fitted = fit_with(ready, speeds, (), None)
    if compliance or forms:
        for _ in range(PASSES):
            found = torque_terms(
                ready.problem, ready.shared, fitted.own, fitted.fit, compliance=compliance, forms=forms
            )
            terms = [
                {**known, **{name: Term(own[name]) for name in forms}}
                for known, own in zip(speeds, found.own, strict=True)
            ]
            softened = by_currents(ready, found, fitted, found.own) if compliance else ()
            fitted = fit_with(ready, terms, softened, fitted)
    return fitted
