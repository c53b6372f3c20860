"""Methods of strangers, well and badly behaved; a module of its own, so that a fresh process can import it."""

import os
import subprocess
import sys
import time
from pathlib import Path

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


def not_a_number(problem: GivenProblem) -> list[dict]:
    return _every(problem, {"estimate": float("nan"), "std": 0.1})


def infinite(problem: GivenProblem) -> list[dict]:
    return _every(problem, {"estimate": 1.0, "std": float("inf")})


def one_short(problem: GivenProblem) -> list[dict]:
    return _every(problem, {"estimate": 1.0})[1:]


def raises(problem: GivenProblem) -> list[dict]:
    raise ValueError("what is this?")


def leaves(problem: GivenProblem) -> list[dict]:
    sys.exit(0)


def aborts(problem: GivenProblem) -> list[dict]:
    os.abort()


def sleeps(problem: GivenProblem) -> list[dict]:
    """Leaves its number, and that of a child that outlives it, in a file of the working folder."""
    child = subprocess.Popen(["sleep", "600"])
    Path("sleepers").write_text(f"{os.getpid()} {child.pid}")
    time.sleep(600)
    return []


def devours(problem: GivenProblem) -> list[dict]:
    held = []
    while True:
        held.append(bytearray(10**8))


def by_place(problem: GivenProblem) -> list[dict]:
    """The number of the process, so that one sees whether it is always another."""
    return _every(problem, {"estimate": float(os.getpid())})


NOT_CALLABLE = 3
