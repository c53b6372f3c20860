"""Selection among alternatives, evaluated to first order or exactly, and those that cannot be distinguished."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from ident.diagnosis.added import Added
from ident.diagnosis.alternative import Alternative, Direction
from ident.diagnosis.comparison import z_of
from ident.diagnosis.families import FAMILIES
from ident.diagnosis.logs import Logs
from ident.support.arrays import Array

SHOWN = 5.0
"""Number of standard errors by which an alternative must improve the predictions to be accepted.

In 187 fault-free sets of logs, the best of some 400 alternatives exceeded 4 in 18 sets, and 5 in 5 sets, four of these
with very elastic joints, backlash or presliding (`docs/diagnosis.md` has the present rates).
"""
WORTH = 8.0
"""Improvement of the log-likelihood beyond which predictions are compared: z = 4 for white residuals.

Of a large alternative it is that on subsampled states, of a direction that of the fit, which predictions of omitted
blocks hardly exceed. It only saves time.
"""
TIE = 2.0
"""Difference of two alternatives, in standard errors, below which they cannot be distinguished."""


class _Candidate:
    """Common properties of directions and exactly evaluated alternatives."""

    __slots__ = ()

    if TYPE_CHECKING:

        @property
        def what(self) -> Direction | Alternative: ...

        @property
        def u(self) -> Array: ...

    @property
    def family(self) -> str:
        """Kind of fault, or of term of the model."""
        return self.what.family

    @property
    def parameter(self) -> str:
        """Family of directions that have its parameter."""
        return self.what.key[0]

    @property
    def logs(self) -> tuple[int, ...]:
        """Logs concerned, from 0."""
        return self.what.logs

    @property
    def gain(self) -> float:
        """Improvement of the log predictive density."""
        return float(self.u.sum())

    @property
    def z(self) -> float:
        """Improvement of the predictions, in standard errors."""
        return z_of(self.u)


@dataclass(frozen=True, slots=True, eq=False)
class Small(_Candidate):
    """A direction, and its improvement of the predictions."""

    direction: Direction
    found: Added

    @property
    def what(self) -> Direction:
        """The direction."""
        return self.direction

    @property
    def parameters(self) -> int:
        """Number of parameters."""
        return len(self.found.value)

    @property
    def within(self) -> bool:
        """Whether the first order is valid for its size."""
        return self.direction.within(self.found.value)

    def near(self, alternative: Alternative) -> bool:
        """Whether an alternative is this one evaluated exactly, not another one of a very different size."""
        if self.direction.alternative is None or self.direction.key != alternative.key:
            return False
        own = self.direction.alternative(self.found.value)
        if own.family != alternative.family or own.value is None or alternative.value is None:
            return False
        return abs(own.value - alternative.value) <= self.direction.largest * self.direction.scale

    @property
    def u(self) -> Array:
        """Improvement in each block, shape (blocks,)."""
        return self.found.u

    @property
    def words(self) -> str:
        """Short description."""
        return self.direction.family


@dataclass(frozen=True, slots=True, eq=False)
class Compared(_Candidate):
    """An alternative compared exactly with the logs as they are.

    Attributes:
        alternative: The alternative.
        u: Improvement in each block, shape (blocks,).
        read: The logs under its hypothesis.
        spread: Standard deviations of its refined parameters, shape (m,); None without parameters, or if it predicts
            too badly.
    """

    alternative: Alternative
    u: Array  # pyright: ignore[reportIncompatibleMethodOverride]
    read: Logs
    spread: Array | None = None

    @property
    def what(self) -> Alternative:
        """The alternative."""
        return self.alternative

    @property
    def parameters(self) -> int:
        """Number of parameters."""
        return self.alternative.parameters

    @property
    def words(self) -> str:
        """Description."""
        return self.alternative.words

    @property
    def std(self) -> float | None:
        """Standard deviation of its size, None without one."""
        own = self.alternative
        if self.spread is None or own.value is None or own.refined is None:
            return None
        beside = [own.refined(sign * self.spread).value for sign in (1.0, -1.0)]
        return min((abs(each - own.value) for each in beside if each is not None), default=None)  # angles wrap


Found = TypeVar("Found", bound=Compared | Small)


def likeliest(shown: Sequence[Found]) -> tuple[Found, tuple[Found, ...]]:
    """Return the most likely of significantly better alternatives, and those that cannot be distinguished from it.

    An alternative with more parameters than its special case must be significantly better than that; of those that
    predict as well as the best, rare faults come last.
    """
    best = max(shown, key=lambda each: each.gain)
    special = [each for each in shown if _contains(best, each) and z_of(best.u - each.u) < SHOWN]
    best = max(special, key=lambda each: each.gain, default=best)
    seldom = {family.name for family in FAMILIES if family.seldom}
    tied = [each for each in shown if z_of(best.u - each.u) < TIE and not _contains(each, best)]  # includes itself
    best = max(tied, key=lambda each: (each.family not in seldom, each.gain))
    return best, tuple(each for each in tied if each is not best)


def _contains(general: Compared | Small, special: Compared | Small) -> bool:
    """Whether an alternative is a generalisation of another one: separate delays of all joints of a common delay."""
    same = (general.parameter, general.logs) == (special.parameter, special.logs)
    return same and general.parameters > special.parameters
