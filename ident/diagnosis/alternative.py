"""Alternatives to the logs as they are: other interpretations of the logs, and effects that the model may lack.

An `Alternative` is another interpretation of the logs. A `Direction` is a small one, to first order: columns of
currents whose coefficients are its parameters; with values of these it becomes an alternative, evaluated exactly.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import PurePath
from typing import NamedTuple

import numpy as np

from ident.diagnosis.logs import Hypothesis
from ident.support.arrays import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Alternative:
    """An interpretation of logs that assumes a fault.

    Attributes:
        family: Kind of fault, such as `zero` or `delay`.
        parameter: Family of directions whose parameter is, or is included in, its size; "" if that is its own.
        words: Description, such as `zero of q2 off by +4 degrees in loaded.csv alone`.
        joints: Joints concerned, from 0; empty for all.
        logs: Logs concerned, from 0.
        hypothesis: The interpretation of the logs.
        advice: The remedy.
        value: Size of the fault, None without one.
        unit: Unit of the size.
        parameters: Number of parameters.
        refined: Function that returns the same alternative with parameters changed slightly, in units of the family's
            direction.
        searched: Whether its size was selected from a grid, so that it has no special value.
    """

    family: str
    parameter: str = ""
    words: str
    joints: tuple[int, ...]
    logs: tuple[int, ...]
    hypothesis: Hypothesis
    advice: str
    value: float | None = None
    unit: str | None = None
    parameters: int = 1
    refined: "Callable[[Array], Alternative] | None" = None
    searched: bool = False

    @property
    def key(self) -> tuple[str, tuple[int, ...], tuple[int, ...]]:
        """Family of its parameter, joints and logs, which identify it."""
        return self.parameter or self.family, self.joints, self.logs


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Term:
    """An effect that is not an interpretation of the logs: the model lacks it, or a payload is not as specified.

    Attributes:
        words: Function that returns its description from the parameters, shape (m,).
        advice: The remedy.
        at_fault: Whether a log or a specified value would be wrong, so that gains may be refused; else the model lacks
            it, which is only reported.
    """

    words: Callable[[Array], str]
    advice: str
    at_fault: bool


class DirectionMessage(NamedTuple):
    """Description of an alternative of a given size, the remedy, and its size, None without one."""

    words: str
    advice: str
    value: float | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Direction:
    """A small alternative: the currents change in proportion to its parameters.

    Attributes:
        family: Kind of fault, or of term of the model.
        parameter: As for an alternative.
        joints: Joints concerned, from 0; empty for all.
        logs: Logs concerned, from 0.
        columns: Change of each joint's currents per unit of the m parameters, n arrays of shape (r_j, m); None where
            they are zero.
        alternative: Function that returns the alternative for values of the parameters, shape (m,); None for a term.
        term: The term, None for an alternative.
        unit: Unit in which the parameter is reported.
        scale: Reported value per unit of the columns.
        largest: Largest value of the parameter for which the first order is valid.
        prior_std: Specified standard deviations of the parameters, which the estimate includes, shape (m,).
    """

    family: str
    parameter: str = ""
    joints: tuple[int, ...]
    logs: tuple[int, ...]
    columns: tuple[Array | None, ...]
    alternative: Callable[[Array], Alternative] | None = None
    term: Term | None = None
    unit: str
    scale: float
    largest: float
    prior_std: Array | None = None

    @property
    def key(self) -> tuple[str, tuple[int, ...], tuple[int, ...]]:
        """As for an alternative."""
        return self.parameter or self.family, self.joints, self.logs

    @property
    def at_fault(self) -> bool:
        """Whether a log or a specified value would be wrong, not the model."""
        return self.term is None or self.term.at_fault

    def within(self, value: Array) -> bool:
        """Whether the first order is valid for values of its parameters, shape (m,)."""
        return bool((np.abs(value) <= self.largest).all())

    def message(self, value: Array, names: Sequence[str]) -> DirectionMessage:
        """Description, remedy and size for values of its parameters.

        Args:
            value: Values of the parameters, shape (m,).
            names: Names of all logs.
        """
        if self.alternative is not None:
            found = self.alternative(value)
            return DirectionMessage(found.words, found.advice, found.value)
        assert self.term is not None, "one of both"
        words = in_logs(self.term.words(value), self.logs, names)
        return DirectionMessage(words, self.term.advice, float(value[0]) * self.scale if len(value) == 1 else None)


def scopes(logs: int) -> list[tuple[int, ...]]:
    """All logs together, and each alone."""
    every = tuple(range(logs))
    return [every, *((k,) for k in every)] if logs > 1 else [every]


def in_logs(words: str, logs: Sequence[int], names: Sequence[str]) -> str:
    """Add the names of the logs concerned to a description, unless all are."""
    if len(logs) == len(names):
        return words
    short = names_apart(tuple(names))
    return f"{words} in {' and '.join(short[k] for k in logs)} alone"


@lru_cache(maxsize=8)  # used by hundreds of alternatives of the same logs
def names_apart(names: tuple[str, ...]) -> tuple[str, ...]:
    """Names of files without folders, unless these are needed to distinguish them."""
    short = tuple(PurePath(name).name for name in names)
    return short if len(set(short)) == len(set(names)) else tuple(names)


def in_rows(parts: Sequence[Sequence[Array]], logs: Sequence[int], joints: Sequence[int] | None = None):
    """Return columns of all logs' rows, joint by joint, zero outside given logs and joints.

    Args:
        parts: n arrays of shape (r, m) of each log.
        logs: Logs in which they are not zero.
        joints: Joints for which they are not zero; all if None.
    """
    n = len(parts[0])
    return tuple(
        np.concatenate([each[j] if k in logs else np.zeros_like(each[j]) for k, each in enumerate(parts)])
        if joints is None or j in joints
        else None
        for j in range(n)
    )


def two_digits(value: float, *, sign: str = "") -> str:
    """A number with two digits, or all digits before the decimal point."""
    return f"{value:{sign}.0f}" if abs(value) >= 10.0 else f"{value:{sign}.2g}"
