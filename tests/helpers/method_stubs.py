"""Methods of strangers, well and badly behaved; a module of its own, so that a fresh process can import it."""

import os
import sys

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


def half_sure(problem: GivenProblem) -> list[dict]:
    """Gains without a deviation, the last joint refused; says a lot besides."""
    sys.stdout.write("a line of its own\n")
    os.system("echo another one")
    return [{"estimate": 0.75}] * (problem.arm.n - 1) + [REFUSED]


def refuses(problem: GivenProblem) -> list[dict]:
    return _every(problem, REFUSED)


def raises(problem: GivenProblem) -> list[dict]:
    raise ValueError("what is this?")


def devours(problem: GivenProblem) -> list[dict]:
    held = []
    while True:
        held.append(bytearray(10**8))
