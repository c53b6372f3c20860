"""A comparison: the trials of a Monte Carlo study, each given to several methods."""

from collections.abc import Sequence
from dataclasses import asdict, replace

import pyarrow as pa

from scenarios.benchmark.comparison.rows import COLUMNS, METHOD, comparing
from scenarios.benchmark.methods.method import Method
from scenarios.benchmark.methods.process import Limits
from scenarios.experiments.files.draws import places_of
from scenarios.experiments.files.schema import Scenario
from scenarios.experiments.studies.monte_carlo import monte_carlo
from scenarios.experiments.studies.study import Study
from scenarios.experiments.trials import trial_schema
from scenarios.support.errors import ScenarioError


def comparison(scenario: Scenario, methods: Sequence[Method], limits: Limits, count: int, seed: int) -> Study:
    """The study of `count` trials of one scenario.

    Args:
        scenario: What is repeated; the method it names itself is not asked.
        methods: Those that are.
        limits: What each call may take.
        count: Number of trials.
        seed: Of the first; trial k is that of `monte_carlo`.

    Raises:
        ScenarioError: If there is no method, or one twice; as `monte_carlo`.
    """
    texts = [method.text for method in methods]
    if not texts:
        raise ScenarioError("no method; name one with --method")
    for text in texts:
        if texts.count(text) > 1:
            raise ScenarioError(f"method {text!r} is given twice; give each method once")
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
        work=comparing(tuple(methods), limits),
        rows_per_joint=len(methods),
    )
