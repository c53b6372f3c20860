"""What logs may mean, or what a model may lack: the alternatives that compete with the logs as they are.

An `Alternative` is another way to read the logs. A `Direction` is a small one, to first order: columns of currents
whose coefficient is its parameter; with a value it becomes an alternative that is read exactly.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import PurePath
from typing import NamedTuple

import numpy as np

from ident.diagnosis.logs import Hypothesis
from ident.support.arrays import Array

SAME_PARAMETER = {"sign": "zero", "current sign": "current scale"}
"""Families whose size is the parameter of another's direction."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Alternative:
    """One way to read logs that differs from what they say.

    Attributes:
        family: What kind of fault it would be, as `zero` or `delay`.
        words: What the fault would be, as `zero of q2 off by +4 degrees in loaded.csv alone`.
        joints: Joints that it is about, from 0; none where it is about all.
        logs: Logs that it is about, from 0.
        hypothesis: How to read them.
        advice: What to do if it is so.
        value: Size of the fault, None where it has none.
        unit: Of the size.
        parameters: Number of sizes that it has.
        refined: The same with its parameters changed by a little, in units of the direction of the family.
        searched: Whether its size was chosen from a grid, so that no value is more natural than its neighbours.
    """

    family: str
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
        """What tells it from others of another family, joint or log."""
        return SAME_PARAMETER.get(self.family, self.family), self.joints, self.logs


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Term:
    """Something that is no other way to read the logs: the model lacks it, or a payload is not as stated.

    Attributes:
        words: What it would be, by the parameters, shape (m,).
        advice: What to do about it.
        at_fault: Whether a log, or what is stated, would be wrong, so that a gain may be refused; else the model lacks
            it, which is only told.
    """

    words: Callable[[Array], str]
    advice: str
    at_fault: bool


class DirectionMessage(NamedTuple):
    """What an alternative of some size says: in words, what to do, and its size, None where it has none."""

    words: str
    advice: str
    value: float | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Direction:
    """A small alternative: currents that change in proportion to its parameters.

    Attributes:
        family: What kind of fault, or of term of the model, it would be.
        joints: Joints that it is about, from 0; none where it is about all.
        logs: Logs that it is about, from 0.
        columns: Change of each joint's currents per unit of the m parameters, n arrays of shape (r_j, m); None where
            they are zero.
        alternative: What it is with values of the parameters, shape (m,); None for a term.
        term: What it is otherwise, None for an alternative.
        unit: Of the parameter as it is told.
        scale: Of the parameter as it is told, per unit of the columns.
        largest: Value of the parameter up to which the first order is to be believed.
        prior_std: Standard deviations of the parameters that are stated, which the estimate allows for, shape (m,).
    """

    family: str
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
        """As of an alternative."""
        return self.family, self.joints, self.logs

    @property
    def at_fault(self) -> bool:
        """Whether a log, or what is stated, would be wrong, not the model."""
        return self.term is None or self.term.at_fault

    def within(self, value: Array) -> bool:
        """Whether values of its parameters, shape (m,), are such that the first order is to be believed of them."""
        return bool((np.abs(value) <= self.largest).all())

    def message(self, value: Array, names: Sequence[str]) -> DirectionMessage:
        """What it says with values of its parameters.

        Args:
            value: Of the parameters, shape (m,).
            names: Of all logs.
        """
        if self.alternative is not None:
            found = self.alternative(value)
            return DirectionMessage(found.words, found.advice, found.value)
        assert self.term is not None, "one of both"
        words = in_logs(self.term.words(value), self.logs, names)
        return DirectionMessage(words, self.term.advice, float(value[0]) * self.scale if len(value) == 1 else None)


def scopes(logs: int) -> list[tuple[int, ...]]:
    """All logs, and each alone."""
    every = tuple(range(logs))
    return [every, *((k,) for k in every)] if logs > 1 else [every]


def in_logs(words: str, logs: Sequence[int], names: Sequence[str]) -> str:
    """What is so in some logs of all."""
    if len(logs) == len(names):
        return words
    short = names_apart(tuple(names))
    return f"{words} in {' and '.join(short[k] for k in logs)} alone"


@lru_cache(maxsize=8)  # hundreds of alternatives of the same logs ask for them
def names_apart(names: tuple[str, ...]) -> tuple[str, ...]:
    """Names of files without their folders, where these do not tell them apart."""
    short = tuple(PurePath(name).name for name in names)
    return short if len(set(short)) == len(set(names)) else tuple(names)


def in_rows(parts: Sequence[Sequence[Array]], logs: Sequence[int], joints: Sequence[int] | None = None):
    """Columns of all logs' rows, joint by joint, zero outside some logs and joints.

    Args:
        parts: Of each log, n arrays of shape (r, m).
        logs: Where they are not zero.
        joints: Likewise; all if None.
    """
    n = len(parts[0])
    return tuple(
        np.concatenate([each[j] if k in logs else np.zeros_like(each[j]) for k, each in enumerate(parts)])
        if joints is None or j in joints
        else None
        for j in range(n)
    )


def two_digits(value: float, *, sign: str = "") -> str:
    """A number in two digits, or all that stand before the point."""
    return f"{value:{sign}.0f}" if abs(value) >= 10.0 else f"{value:{sign}.2g}"
