"""An estimator of one's own for `rx90 compare --method median:gains`: the median of three, joint by joint."""

import numpy as np

from ident import identify, structure_of
from scenarios.results.problem_folder import GivenProblem

METHODS = ("ls-2011", "iv", "nls")


def gains(problem: GivenProblem) -> list[dict[str, object]]:
    """One answer a joint; a joint that a method refuses is refused, with its reason."""
    arm = structure_of(problem.arm)
    found = [
        identify(arm, problem.motions, method=name, observing=problem.observing, gains=problem.gains)
        for name in METHODS
    ]
    gain = np.median([each.gain.filled(np.nan) for each in found], axis=0)
    std = np.max([each.std.filled(np.nan) for each in found], axis=0)  # estimates from one log are not independent
    reasons = [next(filter(None, own), None) for own in zip(*(each.reasons for each in found), strict=True)]
    return [
        {"reason": reason} if reason else {"estimate": float(gain[j]), "std": float(std[j])}
        for j, reason in enumerate(reasons)
    ]
