"""JSON Schema of methods side by side: on scenarios, on problem folders, and held to what any method should keep."""

from pydantic import Field

from scenarios.benchmark.comparison.statistics import MethodSummary
from scenarios.benchmark.methods.answers import AnswerRow
from scenarios.support.result_model import ResultModel


class ComparedScenario(ResultModel):
    """How methods did on a scenario.

    Attributes:
        name: Of the scenario, or of the sealed problems made from it.
        trials: Each method was given.
        unposed: Of these, trials that failed before any method was asked.
        methods: The best first.
    """

    name: str
    trials: int
    unposed: int
    methods: list[MethodSummary]


class Comparison(ResultModel):
    """What `rx90 compare --json` prints of scenarios, and with --open of sealed problems.

    Attributes:
        about: What it takes to repeat it: command, date, versions, methods from elsewhere.
        scenarios: One entry each.
    """

    about: dict[str, str]
    scenarios: list[ComparedScenario]


class Answers(ResultModel):
    """What `rx90 compare --json` prints of problem folders.

    Attributes:
        answers: One a problem and method.
    """

    answers: list[AnswerRow]


class KeptPromise(ResultModel):
    """A promise that any method should keep.

    Attributes:
        promise: In words.
        kept: Whether the method keeps it.
    """

    promise: str
    broken: str | None = Field(description="how, null if it is kept")
    kept: bool


class Contract(ResultModel):
    """What `rx90 compare --check M --json` prints.

    Attributes:
        method: As it was given.
        passed: Whether it keeps all promises.
        checks: One a promise.
    """

    method: str
    passed: bool
    checks: list[KeptPromise]


class SealedProblems(ResultModel):
    """What `rx90 compare --seal DIR --json` prints.

    Attributes:
        problems: How many were sealed.
        folder: That holds them, their seal and, until it is revealed, their truth.
    """

    problems: int
    folder: str
