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
        if field.name not in ranges:
            continue
        interval, unit = ranges[field.name]
        low, high = _number(interval.ge, interval.gt), _number(interval.le, interval.lt)
        above = value > low if interval.ge is None else value >= low
        if not (above and (value < high if interval.le is None else value <= high)):
            more, less = "more than " * (interval.ge is None), "less than " * (interval.le is None)
            raise error(f"{within}{field.name} = {value:g}: expected {more}{low:g} to {less}{high:g}{unit}")


@lru_cache(maxsize=64)
def _ranges(kind: type) -> Mapping[str, tuple[Interval, str]]:
    found: dict[str, tuple[Interval, str]] = {}
    for name, hint in get_type_hints(kind, include_extras=True).items():
        details = get_args(hint)[1:]
        unit = "".join(f" {detail.unit}" for detail in details if isinstance(detail, Unit))
        for interval in (detail for detail in details if isinstance(detail, Interval)):
            found[name] = interval, unit
    return found


def _number(closed: Any, opened: Any) -> float:  # bounds of annotated_types may have any type
    return float(opened if closed is None else closed)
