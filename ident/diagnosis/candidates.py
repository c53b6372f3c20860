"""What competes: alternatives to first order or in full; which is believed, and what it cannot be told from."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from ident.diagnosis.added import Added
from ident.diagnosis.alternative import Alternative, Direction
from ident.diagnosis.catalog import FAMILIES
from ident.diagnosis.comparison import z_of
from ident.diagnosis.logs import Logs
from ident.support.arrays import Array

SHOWN = 5.0
"""Standard errors by which an alternative must predict the currents better to be believed.

The best of some 400 alternatives beat 187 sound sets of logs by more than 4 in 18 of them, by more than 5 in 5, four of
these with very soft joints, backlash or presliding (`docs/diagnosis.md` has what it does since).
"""
TIE = 2.0
"""Standard errors by which the best of two alternatives must predict better to be told from the other."""


class _Candidate:
    """What a direction and an alternative in full have alike when they compete."""

    __slots__ = ()

    if TYPE_CHECKING:

        @property
        def what(self) -> Direction | Alternative: ...

        @property
        def u(self) -> Array: ...

    @property
    def family(self) -> str:
        """What kind of fault, or of term of the model, it would be."""
        return self.what.family

    @property
    def logs(self) -> tuple[int, ...]:
        """Logs that it is about, from 0."""
        return self.what.logs

    @property
    def gain(self) -> float:
        """In log predictive density."""
        return float(self.u.sum())

    @property
    def z(self) -> float:
        """Standard errors by which it predicts better."""
        return z_of(self.u)


@dataclass(frozen=True, slots=True, eq=False)
class Small(_Candidate):
    """A direction, and what it adds to the predictions."""

    direction: Direction
    found: Added

    @property
    def what(self) -> Direction:
        """The direction."""
        return self.direction

    @property
    def parameters(self) -> int:
        """Number of sizes that it has."""
        return len(self.found.value)

    @property
    def within(self) -> bool:
        """Whether its size is one that the first order is to be believed of."""
        return self.direction.within(self.found.value)

    def near(self, alternative: Alternative) -> bool:
        """Whether an alternative is this one in full: no quarter turn or sign beside a zero of some degrees."""
        if self.direction.alternative is None or self.direction.key != alternative.key:
            return False
        own = self.direction.alternative(self.found.value)
        if own.family != alternative.family or own.value is None or alternative.value is None:
            return False
        return abs(own.value - alternative.value) <= self.direction.largest * self.direction.scale

    @property
    def u(self) -> Array:
        """Gain of each block, shape (blocks,)."""
        return self.found.u

    @property
    def words(self) -> str:
        """What it would be, in short."""
        return self.direction.family


@dataclass(frozen=True, slots=True, eq=False)
class Compared(_Candidate):
    """An alternative compared in full with the logs as they are.

    Attributes:
        alternative: The alternative.
        u: Gain of each block, shape (blocks,).
        read: The logs read so.
        spread: Standard deviations of the parameters that the alternative is refined in, shape (m,); None where it has
            none, or where it predicts too badly for them to be asked.
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
        """Number of sizes that it has."""
        return self.alternative.parameters

    @property
    def words(self) -> str:
        """What it would be."""
        return self.alternative.words

    @property
    def std(self) -> float | None:
        """Standard deviation of its size, None where it has none."""
        own = self.alternative
        if self.spread is None or own.value is None or own.refined is None:
            return None
        beside = [own.refined(sign * self.spread).value for sign in (1.0, -1.0)]
        return min((abs(each - own.value) for each in beside if each is not None), default=None)  # angles wrap one way


Found = TypeVar("Found", bound=Compared | Small)


def likeliest(shown: Sequence[Found]) -> tuple[Found, tuple[Found, ...]]:
    """Of alternatives that surely predict better the likeliest, and those that it cannot be told from.

    An alternative with more sizes than its special case must surely predict better than that; of those that predict as
    well as the best, one of a family that is seldom wrong comes last.
    """
    best = max(shown, key=lambda each: each.gain)
    special = [each for each in shown if _contains(best, each) and z_of(best.u - each.u) < SHOWN]
    best = max(special, key=lambda each: each.gain, default=best)
    seldom = {family.name for family in FAMILIES.values() if family.seldom}
    tied = [each for each in shown if z_of(best.u - each.u) < TIE and not _contains(each, best)]  # and itself
    best = max(tied, key=lambda each: (each.family not in seldom, each.gain))
    return best, tuple(each for each in tied if each is not best)


def _contains(general: Compared | Small, special: Compared | Small) -> bool:
    """Whether an alternative is another one with more sizes, as a delay of each joint of one of all joints."""
    same = (general.family, general.logs) == (special.family, special.logs)
    return same and general.parameters > special.parameters
