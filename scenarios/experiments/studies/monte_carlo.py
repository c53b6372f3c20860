"""Repetition of a scenario: with consecutive seeds and new random values, or with swept values.

Trial k of a Monte Carlo study has the seed `first + k`, so `rx90 run SCENARIO --seed` with the seed of a row repeats
that trial. A sweep runs every combination of some values, with the same seeds each time.
"""

import itertools
from collections.abc import Iterable, Mapping, Sequence

from scenarios.experiments.build import setup_of
from scenarios.experiments.files.draws import check_draws, drawn_settings, places_of
from scenarios.experiments.files.schema import Scenario
from scenarios.experiments.files.settings import Value, place_of, with_settings
from scenarios.experiments.studies.study import MOST_TRIALS, Study
from scenarios.experiments.trials import Trial, trial_schema
from scenarios.support.errors import StudyError
from scenarios.support.seeds import SEEDS


def monte_carlo(scenario: Scenario, count: int, seed: int) -> Study:
    """Return the study of `count` trials.

    Raises:
        StudyError: If there are not enough seeds or part names.
        ScenarioError: If the target or distribution of a draw does not exist.
    """
    if count > MOST_TRIALS:
        raise StudyError(f"a study has {MOST_TRIALS} trials at most; request fewer")
    if seed + count > SEEDS:
        raise StudyError(f"{count} trials from seed {seed} need seeds beyond 2^31 - 1; begin at a smaller one")
    check_draws(scenario, setup_of)
    return Study(
        kind="monte-carlo",
        scenario=scenario,
        count=count,
        trial=lambda number: Trial(number=number, seed=seed + number),
        schema=trial_schema(scenario, places_of(scenario.table.random), ()),
        identity={"seed": seed},
    )


def sweep(scenario: Scenario, values: Mapping[str, Sequence[Value]], seeds: int | Iterable[int]) -> Study:
    """Return the study of all combinations; the first key varies slowest, seeds fastest.

    Args:
        scenario: The scenario to be repeated; its random values are drawn, except swept ones.
        values: Values by key path or its end.
        seeds: Seeds of the trials of each combination; a number n means 0 to n - 1.

    Raises:
        ScenarioError: If a key path does not exist or is ambiguous, a value is not valid, or the scenario's draws are
            wrong.
    """
    check_draws(scenario, setup_of)
    places = [place_of(scenario.table, name) for name in values]
    points = [dict(zip(places, point, strict=True)) for point in itertools.product(*values.values())]
    for point in points:
        setup_of(with_settings(scenario, point))  # a wrong value is an error, not a failure of every trial
    chosen = tuple(range(seeds) if isinstance(seeds, int) else seeds)

    def trial(number: int) -> Trial:
        point, seed = points[number // len(chosen)], chosen[number % len(chosen)]
        return Trial(number=number, seed=seed, settings={**drawn_settings(scenario, seed), **point})

    return Study(
        kind="sweep",
        scenario=scenario,
        count=len(points) * len(chosen),
        trial=trial,
        schema=trial_schema(scenario, list(dict.fromkeys([*places, *places_of(scenario.table.random)])), ()),
        identity={"values": {place: list(of) for place, of in zip(places, values.values(), strict=True)}},
    )
