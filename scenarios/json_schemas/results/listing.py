"""JSON Schema of lists of what is built in, and of a file that was written."""

from pydantic import Field

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


class Written(ResultModel):
    """What `rx90 recipe --json` and `rx90 view --render FILE --json` print."""

    out: str = Field(description="the file that was written")
