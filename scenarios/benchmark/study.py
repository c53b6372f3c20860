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
from scenarios.experiments.judge import Claim, judge_claims
from scenarios.experiments.run import Failure, Simulated
from scenarios.experiments.scenario import Setup
from scenarios.experiments.schema import Scenario
from scenarios.experiments.study import Study, monte_carlo
from scenarios.experiments.trials import Rows, Work, failed_rows, setting_columns, trial_schema
from scenarios.results.problem_folder import write_problem
from scenarios.support.errors import MethodError, ScenarioError

METHOD = "method"
COLUMNS = (("expected", pa.bool_()), ("seconds", pa.float64()))
"""Additional columns: whether the data should identify the gain, and the time of the call [s]."""


def comparison(scenario: Scenario, methods: Sequence[Method], limits: Limits, count: int, seed: int) -> Study:
    """Return the study of `count` trials of one scenario.

    Trial k is that of `monte_carlo`; the scenario's method is not run.

    Raises:
        ScenarioError: If there is no method, or a duplicate one; as `monte_carlo`.
    """
    texts = [method.text for method in methods]
    if not texts:
        raise ScenarioError("no method; name one with --method")
    twice = next((text for text in texts if texts.count(text) > 1), None)
    if twice is not None:
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
        work=Work(rows=partial(_answered, tuple(methods), limits), failed=partial(_failed, tuple(methods))),
        rows_per_joint=len(methods),
    )


def write_trial(simulated: Simulated, folder: Path) -> None:
    """Write the problem of a trial, without true values, scenario and seed."""
    setup = simulated.setup
    chosen = setup.scenario.table
    write_problem(
        folder,
        setup.experiments[0].plant.robot,
        chosen.belief.couplings,
        simulated.logs,
        observing=chosen.identification.observe,
        gains=chosen.identification.gains,
    )


def _answered(methods: tuple[Method, ...], limits: Limits, simulated: Simulated) -> Rows:
    """Return the rows of a trial; each method has a copy of the folder of its own."""
    trial, joints, rows = simulated.trial, simulated.setup.structure.arm.n, list[dict[str, object]]()
    common = {"trial": trial.number, "seed": trial.seed, **setting_columns(simulated.settings)}
    for method in methods:
        with tempfile.TemporaryDirectory(prefix="rx90-problem-") as place:
            write_trial(simulated, Path(place))
            called = call(method, Path(place), joints, limits)
        judged = _judged(simulated.setup, called.outcome)
        rows += [{**common, METHOD: method.text, "seconds": called.seconds, **row} for row in judged]
    return rows


def _judged(setup: Setup, outcome: tuple[Claim, ...] | MethodError) -> Rows:
    """Return the judged columns of a call, one row per joint."""
    tolerance, lost = setup.scenario.table.tolerance, dict[str, object]()
    if isinstance(outcome, MethodError):
        lost = {"failure": outcome.kind, "reason": str(outcome), "passed": False}
        outcome = (Claim(None, None, None),) * len(tolerance.gain)
    verdict = judge_claims(outcome, setup.true_gain, tolerance, expectation=setup.scenario.expectation)
    pairs = zip(verdict.gains, tolerance.identifiable, strict=True)
    return [{"expected": expected, **asdict(gain), **lost} for gain, expected in pairs]


def _failed(methods: tuple[Method, ...], scenario: Scenario, failure: Failure) -> Rows:
    """Return the rows of a trial that reached no method."""
    expected = scenario.table.tolerance.identifiable
    return [
        {**row, METHOD: method.text, "expected": wanted}
        for method in methods
        for row, wanted in zip(failed_rows(scenario, failure), expected, strict=True)
    ]
