"""The fit with friction terms that are named beforehand."""

from collections.abc import Collection

from ident.estimation.all_joints.friction import Term
from ident.estimation.all_joints.solution import Fitted, Setting, fit_with
from ident.estimation.all_joints.terms import LOAD_FORMS, SPEED_TERMS, speed_terms, torque_terms

PASSES = 2
"""Fits after the first one, where columns follow from torques that a fit must give."""


def fit_as_named(ready: Setting, names: Collection[str], *, compliance: bool) -> Fitted:
    """Fit a model of which every joint has the same terms; nothing is believed of their coefficients beforehand.

    Args:
        ready: The problem, of recordings where there is a term at all.
        names: Of `SPEED_TERMS` and `LOAD_FORMS`.
        compliance: Whether joints yield.
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
            fitted = fit_with(ready, terms, found.softened, fitted)
    return fitted
