"""Monte Carlo: a scenario repeated with seeds that count up, everything it declares random drawn anew.

Trial k has the seed `first + k`, so `rx90 run SCENARIO --seed` with the seed of a row repeats that trial.
"""

from scenarios.experiments.build import setup_of
from scenarios.experiments.files.draws import check_draws, places_of
from scenarios.experiments.files.schema import Scenario
from scenarios.experiments.studies.study import MOST_TRIALS, Study
from scenarios.experiments.trials import Trial, trial_schema
from scenarios.support.errors import StudyError
from scenarios.support.seeds import SEEDS


def monte_carlo(scenario: Scenario, count: int, seed: int) -> Study:
    """The study of `count` trials.

    Args:
        scenario: What is repeated.
        count: Number of trials.
        seed: Of the first.

    Raises:
        StudyError: If there are not that many seeds, or part names.
        ScenarioError: If the scenario draws what it does not have, or from what scipy.stats has not.
    """
    if count > MOST_TRIALS:
        raise StudyError(f"a study has {MOST_TRIALS} trials at most; ask for fewer")
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
