"""Methods of strangers, well and badly behaved; a module of its own, so that a fresh process can import it."""

from ident import identify
from ident.preparation import SIMULATED
from scenarios.results.problem_folder import GivenProblem

REFUSED = {"reason": "I dare not"}


def _every(problem: GivenProblem, gain: dict) -> list[dict]:
    return [gain] * problem.arm.n


def least_squares(problem: GivenProblem) -> list[dict]:
    """What `ls-2011` finds, told by hand."""
    found = identify(
        problem.arm,
        problem.motions,
        method="ls-2011",
        observing=problem.observing,
        gains=problem.gains,
        policy=SIMULATED,
    )
    return [
        {"estimate": joint.value, "std": joint.std} if hasattr(joint, "value") else {"reason": joint.reason}
        for joint in found.estimate.joints
    ]


def constant(problem: GivenProblem) -> list[dict]:
    return _every(problem, {"estimate": 1.0, "std": 0.25})


def refuses(problem: GivenProblem) -> list[dict]:
    return _every(problem, REFUSED)


def raises(problem: GivenProblem) -> list[dict]:
    raise ValueError("what is this?")
