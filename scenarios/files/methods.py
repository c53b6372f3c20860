"""A scenario with another method of identification than its file says."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, cast

from ident.estimators import ESTIMATORS
from ident.options import options_from_words
from scenarios.files.schema import Scenario

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


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
    given = options_from_words(ESTIMATORS[name].options, words)
    told = {word.partition("=")[0].strip().replace("-", "_") for word in words}
    options = {key: value for key, value in asdict(cast("DataclassInstance", given)).items() if key in told}
    chosen = stated.model_copy(update={"method": name, "options": {**kept, **options}})
    return replace(scenario, table=scenario.table.model_copy(update={"identification": chosen}))
