"""A result is its pydantic model: the JSON object, its JSON Schema, and what text, Markdown and pages show of it.

A kind of result subclasses `ResultModel`: fields with descriptions, a `title`, and `parts`, the tables, plots and
sentences in order, the verdict first. Renderers draw exactly these; a text leaves out plots.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from importlib import import_module
from operator import attrgetter
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, TypeVar

from pydantic import AliasChoices, BaseModel, ConfigDict, WrapSerializer, WrapValidator

from ident.support.display import Displayed
from scenarios.rendering.content import Mood, Paragraph, Part, Report, Table
from scenarios.rendering.plot import Plot

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Value = TypeVar("Value")
NAME, VALUE = (AliasChoices(key, attribute) for key, attribute in (("parameter", "name"), ("estimate", "value")))
"""Keys of an estimated quantity, and the attributes of its object."""


class ResultModel(BaseModel, Displayed):
    """A JSON object that may have more keys than these."""

    model_config = ConfigDict(extra="allow", from_attributes=True, defer_build=True)  # of those imported, few are used

    def __repr__(self) -> str:
        """Return the main statement; of a part of a result, its values."""
        return self._headline() or super().__repr__()

    def parts(self) -> Iterable[Part]:
        """Return what is shown of the result, in order."""
        return ()

    def _columns(self) -> dict[str, list[object]]:
        return next((part.values for part in self.parts() if isinstance(part, Table)), {})

    def _headline(self) -> str:
        return next((part.text for part in self.parts() if isinstance(part, Paragraph)), "")

    def plot(self) -> "Figure":
        """Return the first plot of its page as a Matplotlib figure."""
        plots = [part for part in self.parts() if isinstance(part, Plot)]
        if not plots:
            return super().plot()
        figure = plots[0].figure()
        figure.axes[0].set_title(plots[0].title)
        return figure

    def report(self, title: str, *more: Part, mood: Mood = Mood.PLAIN) -> Report:
        """Return what renderers draw: title, parts, `more` parts, and the JSON object."""
        return Report(title, (*self.parts(), *more), self.model_dump(mode="json"), mood)


class WithResult(Displayed):
    """Displayed as its result is, of the function `RESULT`: module, colon, name."""

    __slots__ = ()
    RESULT: ClassVar[str]

    def result(self) -> ResultModel:
        """Return the result as its page and JSON have it."""
        module, _, name = self.RESULT.partition(":")
        return attrgetter(name)(import_module(module))(self)

    def __repr__(self) -> str:
        """Return the main statement of its result."""
        return self._headline()

    def _shown(self) -> Displayed:
        return self.result()

    def _columns(self) -> Mapping[str, Sequence[object]]:
        return self._shown()._columns()

    def _headline(self) -> str:
        return self._shown()._headline()

    def plot(self) -> "Figure":
        """Return the first plot of its result as a Matplotlib figure."""
        return self.result().plot()


def _shifted(value: Any, by: int, key: str = "") -> Any:
    """Return JSON values with the numbers of `joint` and `joints`, at any depth, increased."""
    if isinstance(value, dict):
        return {name: _shifted(each, by, name) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_shifted(each, by, key) for each in value]
    return value + by if key in ("joint", "joints") and type(value) is int else value


FromOne = Annotated[
    Value,
    WrapSerializer(lambda value, handler: _shifted(handler(value), 1)),
    WrapValidator(lambda value, handler: handler(_shifted(value, -1))),  # an object is no JSON, and has joints from 0
]
"""A dataclass with `joint` or `joints` from 0, which count from 1 in JSON: `list[FromOne[Diagnosis]]`."""


def to_json(document: Mapping[str, object]) -> str:
    """Serialise; a number that is not finite is an error, as JSON has none."""
    return json.dumps(document, indent=2, allow_nan=False)
