"""An estimator of one's own for `rx90 compare --method median:gains`: the median of three, joint by joint."""

from statistics import median

from ident import IdentifiedGain
from ident.identification import identify_motions
from ident.model.structure import structure_of
from scenarios.results.problem_folder import GivenProblem

METHODS = ("ls-2011", "iv", "ols")


def gains(problem: GivenProblem) -> list[dict[str, object]]:
    """One answer a joint; a joint that a method refuses is refused, with its reason."""
    structure = structure_of(problem.arm)
    found = [
        identify_motions(problem.motions, structure, method=name, observing=problem.observing, gains=problem.gains)
        for name in METHODS
    ]
    return [_together(answers) for answers in zip(*(each.estimate.joints for each in found), strict=True)]


def _together(answers: tuple[object, ...]) -> dict[str, object]:
    """The median with the widest deviation: three estimates from one log are not independent."""
    told = [each for each in answers if isinstance(each, IdentifiedGain)]
    if len(told) < len(answers):
        return {"reason": next(each.reason for each in answers if not isinstance(each, IdentifiedGain))}
    return {"estimate": median(each.value for each in told), "std": max(each.std for each in told)}
