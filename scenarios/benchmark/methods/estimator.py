"""Methods of this project: `NAME`, or `NAME,KEY=VALUE,...` with options of the method or of the identification."""

from dataclasses import asdict, dataclass, fields
from typing import TypeVar

from ident.estimation.estimators import ESTIMATORS
from ident.estimation.gain_options import GainOptions
from ident.identification import Identification, identify
from ident.observation.observation import ObserveOptions
from ident.preparation import SIMULATED
from ident.support.errors import OptionError
from ident.support.naming import nearest, shown
from ident.support.options import options_from_table, options_from_words, table_from_words
from scenarios.benchmark.methods.method import Method
from scenarios.results.problem_folder import GivenProblem
from scenarios.support.errors import ScenarioError

Options = TypeVar("Options", ObserveOptions, GainOptions)


@dataclass(frozen=True, slots=True)
class _Chosen:
    """A name of `ESTIMATORS` with words `KEY=VALUE`, grouped by kind of option."""

    name: str
    own: tuple[str, ...]
    observing: tuple[str, ...]
    gains: tuple[str, ...]


def method(text: str) -> Method:
    """The method of a text.

    Raises:
        ScenarioError: If there is no such estimator or option.
    """
    _checked(text)
    return Method(text)


def identified(text: str, problem: GivenProblem) -> Identification:
    """Identify with the method of a text.

    Raises:
        IdentificationError: If no gain is identifiable.
    """
    chosen = _checked(text)
    return identify(
        problem.arm,
        problem.motions,
        method=chosen.name,
        options=options_from_words(ESTIMATORS[chosen.name].options, chosen.own),
        observing=_overlaid(problem.observing, chosen.observing),
        gains=_overlaid(problem.gains, chosen.gains),
        policy=SIMULATED,
    )


def _checked(text: str) -> _Chosen:
    name, *words = text.split(",")
    if name not in ESTIMATORS:
        raise ScenarioError(
            f"unknown method {shown(name)}{nearest(name, ESTIMATORS)}; known: {', '.join(ESTIMATORS)}, "
            "package.module:function, exec:COMMAND"
        )
    shared = [{field.name for field in fields(kind)} for kind in (ObserveOptions, GainOptions)]
    sorted_words: tuple[list[str], ...] = ([], [], [])
    for word in words:
        key = word.partition("=")[0].strip().replace("-", "_")
        sorted_words[1 if key in shared[0] else 2 if key in shared[1] else 0].append(word)
    own, observing, gains = map(tuple, sorted_words)
    try:
        options_from_words(ESTIMATORS[name].options, own)
        options_from_words(ObserveOptions, observing)
        options_from_words(GainOptions, gains)
    except OptionError as error:
        raise ScenarioError(f"method {shown(text)}: {error}") from error
    return _Chosen(name, own, observing, gains)


def _overlaid(options: Options, words: tuple[str, ...]) -> Options:
    kind = type(options)
    return options_from_table(kind, {**asdict(options), **table_from_words(kind, words)})
