"""The process of a method written in Python: `python -m scenarios.benchmark.methods.inside METHOD FOLDER`.

It prints the JSON object of `rx90 identify --json`, or of a function what that function returned. What a method prints
besides goes to standard error.
"""

import json
import os
import sys
import time
from importlib import import_module
from pathlib import Path

from ident.estimation.estimators import ESTIMATORS
from ident.support.errors import IdentificationError
from scenarios.benchmark.methods import estimator, function
from scenarios.results.models.run import Result
from scenarios.results.problem_folder import GivenProblem, read_problem

LATE = (
    "pyarrow.compute",
    "pyarrow.parquet",
    "pinocchio",
    *(f"scipy.{name}" for name in ("interpolate", "ndimage", "signal", "stats")),
)
"""Modules that reading a problem and identifying import where they are first needed."""


def main(text: str, folder: Path) -> None:
    """Read the problem, call the method, print the answer."""
    answers = os.dup(1)
    os.dup2(2, 1)  # also of what compiled code prints
    document = _document(text, read_problem(folder))
    sys.stdout.flush()
    with os.fdopen(answers, "w", encoding="utf-8") as output:
        json.dump(document, output)  # what is not finite is the reader's to find


def prepare() -> None:
    """Import what a call would import late, and read nothing."""
    for name in LATE:
        import_module(name)


def _document(text: str, problem: GivenProblem) -> object:
    started = time.perf_counter()
    try:
        if text.partition(",")[0] not in ESTIMATORS:
            return function.answered(text, problem)
        found = estimator.identified(text, problem)
        return Result.of_identification(found, time.perf_counter() - started).model_dump(mode="json")
    except IdentificationError as error:  # data refused as a whole are every joint refused
        refused = {"std": None, "estimate": None, "identifiable": False, "reason": str(error)}
        return {"gains": [{"joint": joint, **refused} for joint in range(1, problem.arm.n + 1)]}


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
