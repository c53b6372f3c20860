"""The built-in scenarios as `rx90 list` prints them."""

from collections.abc import Mapping

from scenarios.support.result_model import ResultModel


class ListedScenario(ResultModel):
    """A built-in scenario.

    Attributes:
        name: By which commands take it.
        description: What it shows, in a line.
    """

    name: str
    description: str


class ListedScenarios(ResultModel):
    """What `rx90 list --json` prints.

    Attributes:
        scenarios: Those that are built in.
    """

    scenarios: list[ListedScenario]


def listed(described: Mapping[str, str]) -> ListedScenarios:
    """Scenarios by their names, with their descriptions."""
    return ListedScenarios(scenarios=[ListedScenario(name=name, description=said) for name, said in described.items()])
