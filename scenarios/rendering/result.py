"""A result is its pydantic model: the JSON object, its JSON Schema, and what text, Markdown and pages show of it.

A kind of result subclasses `ResultModel`: fields with descriptions, a `title`, and `parts`, the tables, plots and
sentences in order, the verdict first. Renderers draw exactly these; a text leaves out plots.
"""

import json
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, TypeVar

from pydantic import AliasChoices, BaseModel, ConfigDict, WrapSerializer, WrapValidator

from scenarios.rendering.content import Mood, Part, Report

Value = TypeVar("Value")
NAME, VALUE = (AliasChoices(key, attribute) for key, attribute in (("parameter", "name"), ("estimate", "value")))
"""Keys of an estimated quantity, and the attributes of its object."""


class ResultModel(BaseModel):
    """A JSON object that may have more keys than these."""

    model_config = ConfigDict(extra="allow", from_attributes=True, defer_build=True)  # of those imported, few are used

    def parts(self) -> Iterable[Part]:
        """Return what is shown of the result, in order."""
        return ()

    def report(self, title: str, *more: Part, mood: Mood = Mood.PLAIN) -> Report:
        """Return what renderers draw: title, parts, `more` parts, and the JSON object."""
        return Report(title, (*self.parts(), *more), self.model_dump(mode="json"), mood)


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
