"""Ranges as annotations: `Annotated[float, Interval(ge=0.0, le=1.0), Unit("m")]`.

They validate options, model errors and sensors; scenario files and their schema use the same annotations.
"""

from collections.abc import Mapping
from dataclasses import fields
from functools import lru_cache
from math import isfinite
from typing import TYPE_CHECKING, Any, get_args, get_type_hints

from annotated_types import Interval, Unit

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def refuse_outside(values: "DataclassInstance", error: type[Exception], place: str = "") -> None:
    """Check every number of a dataclass against its annotated range.

    Args:
        values: A dataclass; fields that are not numbers are ignored.
        error: Class of the error.
        place: Context for the message.

    Raises:
        Exception: As `error`, if a number is not finite or outside its range.
    """
    within = f"{place}: " if place else ""
    ranges = _ranges(type(values))
    for field in fields(values):
        value = getattr(values, field.name)
        if not isinstance(value, float | int):
            continue
        if not isfinite(value):
            raise error(f"{within}{field.name} = {value}: expected a finite number")
        if field.name in ranges and not _inside(value, ranges[field.name][0]):
            interval, unit = ranges[field.name]
            raise error(f"{within}{field.name} = {value:g}: expected {_expected(interval)}{unit}")


@lru_cache(maxsize=64)
def _ranges(kind: type) -> Mapping[str, tuple[Interval, str]]:
    found: dict[str, tuple[Interval, str]] = {}
    for name, hint in get_type_hints(kind, include_extras=True).items():
        details = get_args(hint)[1:]
        unit = "".join(f" {detail.unit}" for detail in details if isinstance(detail, Unit))
        for interval in (detail for detail in details if isinstance(detail, Interval)):
            found[name] = interval, unit
    return found


def _inside(value: float, interval: Interval) -> bool:
    above = value >= _number(interval.ge) if interval.gt is None else value > _number(interval.gt)
    return above and (value <= _number(interval.le) if interval.lt is None else value < _number(interval.lt))


def _expected(interval: Interval) -> str:
    low = f"{_number(interval.ge):g}" if interval.gt is None else f"more than {_number(interval.gt):g}"
    high = f"{_number(interval.le):g}" if interval.lt is None else f"less than {_number(interval.lt):g}"
    return f"{low} to {high}"


def _number(bound: Any) -> float:  # bounds of annotated_types may have any type
    return float(bound)
