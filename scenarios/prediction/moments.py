"""Mean and deviations of what a draw changes, as settings of a scenario: where a linear answer is asked."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ident.support.arrays import Array
from scenarios.experiments.files.draws import settings_from, spread_of
from scenarios.experiments.files.schema import DrawTable, ScenarioTable
from scenarios.experiments.files.settings import Value, value_at
from scenarios.support.errors import StudyError

Settings = Mapping[str, Value]


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Settings that stand for a draw.

    Attributes:
        mean: At the mean of every number.
        deviated: One deviation from there, one independent number after the other.
        equal: Settings of equal probability instead, for what is no number or one of few.
    """

    mean: Settings
    deviated: tuple[Settings, ...] = ()
    equal: tuple[Settings, ...] = ()


def points_of(draw: DrawTable, table: ScenarioTable) -> Points:
    """The settings that a draw's first two moments follow from.

    Args:
        draw: What is drawn.
        table: The resolved scenario's, for the values that `add` and `multiply` start from.

    Raises:
        StudyError: If a number has no mean or deviation.
        ScenarioError: If the draw cannot be made.
    """
    if draw.choice is not None:
        middle = (np.arange(len(draw.choice)) + 0.5) / len(draw.choice)
        return Points({}, equal=tuple(settings_from(draw, np.array([u]), table) for u in middle))
    mean, steps = dict[str, Array](), list[dict[str, Array]]()
    bases = {place: np.atleast_1d(np.asarray(value_at(table, place), dtype=np.float64)) for place in draw.targets}
    total, used = sum(map(len, bases.values())), 0
    for place, base in bases.items():
        spread = spread_of(draw, slice(used, used + len(base)), total)
        used += len(base)
        if not (np.isfinite(spread.mean).all() and np.isfinite(spread.std).all()):
            raise StudyError(f"{place}: {draw.distribution} with these parameters has no mean or no deviation")
        mean[place], std = {
            "replace": (spread.mean, spread.std),
            "add": (base + spread.mean, spread.std),
            "multiply": (base * spread.mean, base * spread.std),
        }[draw.apply]
        if draw.shared:
            steps = steps or [{}]
            steps[0][place] = std
        else:
            steps += [{place: each} for each in np.diag(std)]
    lists = {place: isinstance(value_at(table, place), list) for place in draw.targets}
    deviated = [{place: numbers + step.get(place, 0.0) for place, numbers in mean.items()} for step in steps]
    return Points(_settings(mean, lists), tuple(_settings(each, lists) for each in deviated))


def _settings(numbers: Mapping[str, Array], lists: Mapping[str, bool]) -> dict[str, Value]:
    return {place: each.tolist() if lists[place] else float(each[0]) for place, each in numbers.items()}
