"""A result is its pydantic model: the JSON object, its JSON Schema, and what text, Markdown and pages show of it.

A kind of result subclasses `ResultModel`: fields with descriptions, a `title`, and `parts`, the tables, plots and
sentences in order, the verdict first. Renderers draw exactly these; a text leaves out plots.
"""

import json
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, TypeVar

from pydantic import (
    BaseModel,
    ConfigDict,
    SerializerFunctionWrapHandler,
    ValidatorFunctionWrapHandler,
    WrapSerializer,
    WrapValidator,
)

from scenarios.rendering.content import Mood, Part, Report, Table
from scenarios.rendering.plot import Plot

Value = TypeVar("Value")


class ResultModel(BaseModel):
    """A JSON object that may have more keys than these."""

    model_config = ConfigDict(extra="allow", defer_build=True)  # a command uses few of those that it imports

    def parts(self) -> Iterable[Part]:
        """Return what is shown of the result, in order."""
        return ()

    def tables(self) -> list[Table]:
        """Return its tables."""
        return [part for part in self.parts() if isinstance(part, Table)]

    def plots(self) -> list[Plot]:
        """Return its plots."""
        return [part for part in self.parts() if isinstance(part, Plot)]

    def report(self, title: str, *more: Part, mood: Mood = Mood.PLAIN) -> Report:
        """Return what renderers draw: title, parts, `more` parts, and the JSON object."""
        return Report(title, (*self.parts(), *more), self.model_dump(mode="json"), mood)


def _shifted(value: Any, by: int) -> Any:
    """Return JSON values with `joint` and `joints`, at any depth, increased."""
    match value:
        case {"joint": int(joint), **others}:
            return {**_shifted(others, by), "joint": joint + by}
        case dict():
            return {key: [j + by for j in v] if _numbers(key, v) else _shifted(v, by) for key, v in value.items()}
        case list() | tuple():
            return [_shifted(each, by) for each in value]
        case _:
            return value


def _numbers(key: str, value: Any) -> bool:
    return key == "joints" and isinstance(value, list | tuple) and all(type(j) is int for j in value)


def _to_json(value: Any, handler: SerializerFunctionWrapHandler) -> Any:
    return _shifted(handler(value), 1)


def _from_json(value: Any, handler: ValidatorFunctionWrapHandler) -> Any:
    return handler(_shifted(value, -1))  # an object is not JSON, and has joints from 0


FromOne = Annotated[Value, WrapSerializer(_to_json), WrapValidator(_from_json)]
"""A dataclass with `joint` or `joints` from 0, which count from 1 in JSON: `list[FromOne[Diagnosis]]`."""


def to_json(document: Mapping[str, object]) -> str:
    """Serialise; a number that is not finite is an error, as JSON has none."""
    return json.dumps(document, indent=2, allow_nan=False)
