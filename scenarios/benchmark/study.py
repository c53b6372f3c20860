"""A comparison of methods as a study: trials of a Monte Carlo study, simulated once, given to every method.

A row per trial, method and joint; a failed call has rows with its failure, which are neither gains nor refusals.
"""

import tempfile
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path

import pyarrow as pa

from scenarios.benchmark.methods import Limits, Method, call
from scenarios.experiments.draws import places_of
from scenarios.experiments.judge import judge_claims
from scenarios.experiments.run import Failure, Simulated
from scenarios.experiments.schema import Scenario
from scenarios.experiments.study import Study, monte_carlo
from scenarios.experiments.trials import Rows, common_columns, judged_rows, trial_schema
from scenarios.experiments.verdict import Claim
from scenarios.results.problem_folder import write_problem
from scenarios.results.run_folder import simulated_problem
from scenarios.support.errors import ScenarioError

METHOD = "method"
COLUMNS = (("expected", pa.bool_()), ("seconds", pa.float64()))
"""Additional columns: whether the data should identify the gain, and the time of the call [s]."""


def comparison(scenario: Scenario, methods: Sequence[Method], limits: Limits, count: int, seed: int) -> Study:
    """Return the study of the trials of `monte_carlo` by some methods; raises as that, and if one is given twice."""
    texts = [method.text for method in methods]
    for twice in (text for text in texts if texts.count(text) > 1):
        raise ScenarioError(f"method {twice!r} is given twice; give each method once")
    schema = trial_schema(scenario, places_of(scenario.table.random), (METHOD,))
    return replace(
        monte_carlo(scenario, count, seed),
        kind="comparison",
        schema=pa.schema([*schema, *(pa.field(name, kind) for name, kind in COLUMNS)]),
        identity={
            "seed": seed,
            "methods": [{"text": method.text, "files": dict(method.digests)} for method in methods],
            "limits": asdict(limits),
        },
        rows=partial(_answered, tuple(methods), limits),
        rows_per_joint=len(methods),
    )


def _answered(methods: tuple[Method, ...], limits: Limits, scenario: Scenario, outcome: Simulated | Failure) -> Rows:
    """Return the rows of a trial; each method has a copy of the folder of its own."""
    rows, wanted = list[dict[str, object]](), scenario.table.tolerance.identifiable
    if isinstance(outcome, Failure):  # it reached no method
        failed = list(zip(judged_rows(scenario, outcome), wanted, strict=True))
        return [{**row, METHOD: each.text, "expected": expected} for each in methods for row, expected in failed]
    setup, common = outcome.setup, common_columns(outcome)
    tolerance, joints = setup.scenario.table.tolerance, setup.structure.arm.n
    for method in methods:
        with tempfile.TemporaryDirectory(prefix="rx90-problem-") as place:
            write_problem(Path(place), simulated_problem(setup, outcome.recordings))  # without true values and seed
            called = call(method, Path(place), joints, limits)
        answer, lost = called.outcome, dict[str, object]()
        if isinstance(answer, ScenarioError):
            lost = {"failure": answer.kind, "reason": str(answer), "passed": False}
            answer = (Claim(None, None, None),) * joints
        verdict = judge_claims(answer, outcome.truth.gain, tolerance)
        called_once = {**common, METHOD: method.text, "seconds": called.seconds}
        for gain, expected in zip(verdict.gains, tolerance.identifiable, strict=True):
            rows.append({**called_once, "expected": expected, **dict(gain), **lost})
    return rows
