"""Mean and standard deviation of linear functions of a draw, from few settings of a scenario."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from ident.support.arrays import Array
from scenarios.experiments.draws import settings_from, spread_of
from scenarios.experiments.scenario import Value, value_at
from scenarios.experiments.schema import DrawTable, ScenarioTable
from scenarios.support.errors import StudyError

Settings = Mapping[str, Value]
T = TypeVar("T")
U = TypeVar("U")


@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """Relative errors of k gains, each (k,).

    Attributes:
        bias: Mean error.
        std: Standard deviation of the error.
    """

    bias: Array
    std: Array

    @property
    def rms(self) -> Array:
        """Root mean square of the error."""
        return np.hypot(self.bias, self.std)

    @classmethod
    def together(cls, errors: Iterable["Moments"], k: int) -> "Moments":
        """Return independent errors of k gains together: sums of the signed biases and of the variances."""
        several = list(errors)
        bias = np.sum([np.zeros(k), *(each.bias for each in several)], axis=0)
        return cls(bias, np.sqrt(np.sum([np.zeros(k), *(each.std**2 for each in several)], axis=0)))


@dataclass(frozen=True, slots=True, eq=False)
class Points(Generic[T]):
    """Settings that represent a draw, or their results.

    Attributes:
        at: The mean of all numbers, then for each independent number the mean plus one standard deviation.
        alike: Whether they are settings of equal probability instead, for values that are not numbers or are from a
            set.
    """

    at: tuple[T, ...]
    alike: bool

    def map(self, make: Callable[[T], U]) -> "Points[U]":
        """Return the results of a function of each."""
        return Points(tuple(map(make, self.at)), self.alike)

    def moments(self, error: Callable[[T], Array]) -> Moments:
        """Return mean and standard deviation of errors (k,) at the settings."""
        errors = np.array([error(each) for each in self.at])
        if self.alike:
            return Moments(errors.mean(axis=0), errors.std(axis=0))
        return Moments(errors[0], np.linalg.norm(errors[1:] - errors[0], axis=0))


def points_of(draw: DrawTable, table: ScenarioTable) -> Points[Settings]:
    """Return the settings for the first two moments of a draw.

    Raises:
        StudyError: If a number has no mean or standard deviation.
        ScenarioError: If the draw is not possible.
    """
    if draw.choice is not None:
        middle = (np.arange(len(draw.choice)) + 0.5) / len(draw.choice)
        return Points(tuple(settings_from(draw, np.array([u]), table) for u in middle), alike=True)
    mean, steps = dict[str, Array](), list[dict[str, Array]]()
    bases = {place: np.atleast_1d(np.asarray(value_at(table, place), dtype=np.float64)) for place in draw.targets}
    total, used = sum(map(len, bases.values())), 0
    for place, base in bases.items():
        spread = spread_of(draw, slice(used, used + len(base)), total)
        used += len(base)
        if not (np.isfinite(spread.mean).all() and np.isfinite(spread.std).all()):
            raise StudyError(
                f"{place}: distribution {draw.distribution} with these parameters has no finite mean or "
                "standard deviation"
            )
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

    def settings(step: Mapping[str, Array]) -> Settings:
        numbers = {place: each + step.get(place, 0.0) for place, each in mean.items()}
        lists = {place: isinstance(value_at(table, place), list) for place in numbers}
        return {place: each.tolist() if lists[place] else float(each[0]) for place, each in numbers.items()}

    return Points(tuple(map(settings, [{}, *steps])), alike=False)
