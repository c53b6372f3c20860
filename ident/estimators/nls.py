"""Drive gains of all joints at once: shared links, own friction in current units, logarithms of the gains.

V_j = h_j (A_j theta + k_j) + F_j phi_j with h = 1/g, rows weighted by each joint's own residual. Links that several
joints feel tie the gains of these joints together, so that a joint that the known payload hardly loads is found
through its neighbours.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from ident.all_joints.friction import Term
from ident.all_joints.selection import Selected, selected
from ident.all_joints.solution import Fitted, GivenGain, Setting, Terms, fit_with, setting, solution
from ident.all_joints.terms import LOAD_FORMS, speed_terms, torque_terms
from ident.conclusion import concluded
from ident.errors import OptionError
from ident.estimate import GainEstimate
from ident.options import NAMES, check_range
from ident.problem import Problem

NAME = "nls"
AUTO = "auto"
FRICTIONS: dict[str, tuple[str, ...]] = {
    AUTO: (),
    "viscous-coulomb": (),
    "cbrt": ("cbrt",),
    "load": ("load",),
    "load-motor": ("load-motor",),
    "load+cbrt": ("load", "cbrt"),
    "load-motor+cbrt": ("load-motor", "cbrt"),
}
"""Further friction terms of every joint by name.

`auto`: what data choose; `cbrt`: the cube root of the velocity; `load`: |torque of links and payload| sign(dq);
`load-motor`: |motor torque| sign(dq).
"""
PASSES = 2
"""Fits after the first one, where columns follow from torques that a fit must give."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AllJointsOptions:
    """Options of `nls`.

    Attributes:
        friction: Friction of every joint besides viscous and Coulomb.
        friction_per_motion: Whether viscous and Coulomb friction differ between motions.
        compliance: Whether joints yield, one compliance each; with `friction = "auto"` data decide.
        prior_std: Deviation of log|1/g| that is allowed around the start: keeps a joint finite that nothing loads.
        gain_joint: Joint, from 1, whose gain is known: with it no payload is needed.
        gain_value: That gain [N m / drive unit].
    """

    friction: str = field(default=AUTO, metadata={NAMES: FRICTIONS})
    friction_per_motion: bool = True
    compliance: bool = False
    prior_std: float = 1.0
    gain_joint: int | None = None
    gain_value: float | None = None

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            OptionError: If one makes no sense.
        """
        if self.friction not in FRICTIONS:
            raise OptionError(f"friction = {self.friction!r}: expected one of {', '.join(FRICTIONS)}")
        check_range("prior_std", self.prior_std, above=0.0, upto=100.0)
        if (self.gain_joint is None) != (self.gain_value is None):
            raise OptionError("gain_joint and gain_value belong together: the number of a joint and its gain")
        if self.gain_value is not None:
            check_range("gain_value", abs(self.gain_value), above=0.0, upto=1e9, unit="N m / drive unit")


def all_joints_gains(problem: Problem, options: AllJointsOptions) -> GainEstimate:
    """Estimate the gains of all joints together.

    Args:
        problem: Motions, bare and with any number of mountings, whose payloads are known in full or in part.
        options: Friction and what else the model holds.

    Returns:
        A gain or a reason for each joint.

    Raises:
        NotIdentifiable: If nothing sets the scale of the gains.
        TooFewRows: If a joint has fewer rows than unknowns.
        NotConverged: If no end is found.
    """
    ready = setting(
        problem,
        per_motion=options.friction_per_motion,
        prior_std=options.prior_std,
        given=_given(options, problem.structure.arm.n),
    )
    recorded = all(motion.observation.full_rate is not None for motion in problem.motions)
    if options.friction == AUTO and recorded:
        chosen = selected(ready)
    else:
        final = _as_told(ready, FRICTIONS[options.friction], compliance=options.compliance)
        chosen = Selected(final=final, model=np.zeros((ready.n, 0)), remarks=())
    found = solution(ready, chosen.final, chosen.model, chosen.softened)
    return replace(concluded(NAME, problem, found), remarks=chosen.remarks)


def _given(options: AllJointsOptions, n: int) -> GivenGain | None:
    if options.gain_joint is None or options.gain_value is None:
        return None
    if not 1 <= options.gain_joint <= n:
        raise OptionError(f"gain_joint = {options.gain_joint}: the arm has joints 1 to {n}")
    return GivenGain(options.gain_joint - 1, options.gain_value)


def _as_told(ready: Setting, names: tuple[str, ...], *, compliance: bool) -> Fitted:
    """The fit with named terms, every coefficient free."""
    fixed: Terms = [{} for _ in range(ready.n)]
    if "cbrt" in names:
        fixed = [{"cbrt": Term(each["cbrt"])} for each in speed_terms(ready.problem).own]
    fitted = fit_with(ready, fixed, (), None)
    if compliance or not set(LOAD_FORMS).isdisjoint(names):
        for _ in range(PASSES):
            found = torque_terms(ready.problem, ready.shared, fitted.own, fitted.fit, compliance=compliance)
            terms = [
                {**known, **{name: Term(own[name]) for name in LOAD_FORMS if name in names}}
                for known, own in zip(fixed, found.own, strict=True)
            ]
            fitted = fit_with(ready, terms, found.softened, fitted)
    return fitted
