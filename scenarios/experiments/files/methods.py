"""A scenario with another method of identification than its file says."""

from collections.abc import Sequence
from dataclasses import replace

from ident.estimation.estimators import ESTIMATORS
from ident.support.options import options_from_table, table_from_words
from scenarios.experiments.files.schema import Scenario


def with_method(scenario: Scenario, method: str | None, words: Sequence[str]) -> Scenario:
    """The scenario with another method, or other options of its own.

    Args:
        scenario: To change.
        method: A name in `ESTIMATORS`, None for the scenario's.
        words: `KEY=VALUE`, options of the method's own; a method that is named starts from its defaults.

    Raises:
        OptionError: If an option does not exist or does not take its value.
    """
    stated = scenario.table.identification
    if method is None and not words:
        return scenario
    name = stated.method if method is None else method
    kept = stated.options if method is None else {}
    told = table_from_words(ESTIMATORS[name].options, words)
    options_from_table(ESTIMATORS[name].options, {**kept, **told})
    chosen = stated.model_copy(update={"method": name, "options": {**kept, **told}})
    return replace(scenario, table=scenario.table.model_copy(update={"identification": chosen}))
