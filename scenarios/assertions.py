"""`assert_scenario`: test of a scenario's accuracy in a pytest suite, with a given false-alarm rate."""

from collections.abc import Iterable
from operator import index
from typing import TYPE_CHECKING

import pyarrow as pa

from scenarios.experiments.draws import check_draws, places_of
from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.setup import setup_of
from scenarios.experiments.statistics import (
    FALSE_ALARM,
    JointStatistics,
    allowed_misses,
    detectable_rate,
    joint_statistics,
    study_rows,
)
from scenarios.experiments.trials import Trial, run_trials, trial_schema
from scenarios.support.errors import ScenarioError
from scenarios.support.seeds import SEEDS

if TYPE_CHECKING:
    import pandas as pd

POWER = 0.95
BATCH = 32
"""Number of seeds simulated together."""


def assert_scenario(
    scenario: str, seeds: Iterable[int], *, false_alarm: float = FALSE_ALARM, threads: int = 1
) -> tuple[JointStatistics, ...]:
    """Assert that every joint passes as often as the scenario's `tolerance.pass_rate` requires.

    Misses are compared with the binomial distribution at that rate, joint by joint: a scenario with this rate on all
    joints fails for less than `false_alarm` of all choices of seeds. With fixed seeds the outcome is always the same.
    The message states which pass rate the number of seeds can detect.

    Args:
        scenario: A built-in name or the path of a TOML file.
        seeds: Seeds, with one trial each, as in `rx90 run --seed`.
        false_alarm: Largest false-alarm rate.
        threads: Threads to simulate with; the outcome does not depend on it.

    Returns:
        The result of each joint, if all pass.

    Raises:
        AssertionError: If a joint fails; the message names the joints, their misses, and the worst trial.
        ScenarioError: If the scenario is wrong, or there are no seeds or too few for any failure.
    """
    loaded, seeds = load_scenario(scenario), _checked(seeds)
    if not 0.0 < false_alarm < 1.0:
        raise ScenarioError(f"false_alarm = {false_alarm}: expected a rate between 0 and 1")
    check_draws(loaded, setup_of)
    wanted = loaded.table.tolerance.pass_rate
    if allowed_misses(len(seeds), wanted, false_alarm / len(loaded.table.tolerance.gain)) >= len(seeds):
        seed = "1 seed" if len(seeds) == 1 else f"{len(seeds)} seeds"
        raise ScenarioError(f"{loaded.name}: {seed} cannot reject a pass rate of {wanted:g}; run more seeds")
    schema = trial_schema(loaded, places_of(loaded.table.random), ())
    trials = [Trial(number=number, seed=seed) for number, seed in enumerate(seeds)]
    batches = [trials[start : start + BATCH] for start in range(0, len(trials), BATCH)]
    tables = [run_trials(loaded, batch, schema, threads=threads) for batch in batches]
    joints = study_rows(tables, trials=len(trials)).joints
    found = joint_statistics(joints, wanted=wanted, false_alarm=false_alarm)
    missed = [joint for joint in found if not joint.held]
    if missed:
        raise AssertionError(_complaint(loaded.name, missed, pa.concat_tables(tables).to_pandas()))
    return found


def _checked(seeds: Iterable[int]) -> list[int]:
    """Check that seeds are whole numbers without repetition."""
    checked: list[int] = []
    for seed in seeds:
        if isinstance(seed, bool) or not hasattr(seed, "__index__") or not 0 <= index(seed) < SEEDS:
            raise ScenarioError(f"seed {seed!r}: expected a whole number from 0 to 2^31 - 1")
        checked.append(index(seed))
    if not checked:
        raise ScenarioError("give at least one seed")
    if len(set(checked)) < len(checked):
        raise ScenarioError("a seed is given twice; a repeated trial adds no information")
    return checked


def _complaint(name: str, missed: list[JointStatistics], rows: "pd.DataFrame") -> str:
    many = "1 joint passes" if len(missed) == 1 else f"{len(missed)} joints pass"
    lines = [f"scenario {name}: {many} less often than required"]
    for rule in missed:
        failing = rows[(rows["joint"] == rule.joint) & ~rows["passed"]]
        worst = failing.loc[failing["rel_error"].abs().fillna(float("inf")).idxmax()]
        lines.append(
            f"  joint {rule.joint}: {rule.trials - rule.passed} of {rule.trials} trials failed, {rule.allowed} allowed "
            f"at a pass rate of {rule.wanted:g}; seed {worst['seed']}: {worst['reason']}"
        )
    rate = detectable_rate(missed[0].trials, missed[0].allowed, POWER)
    lines.append(f"  ({missed[0].trials} seeds detect a pass rate below {rate:.2f} in {100 * POWER:g} % of cases)")
    return "\n".join(lines)
