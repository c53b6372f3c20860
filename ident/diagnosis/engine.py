"""Which faults logs have: all alternatives against the logs as they are, the best one read in, and again."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.arrays import Array
from ident.diagnosis.alternative import Alternative, Direction
from ident.diagnosis.catalog import FAMILIES, Family
from ident.diagnosis.comparison import Added, added, gains, z_of
from ident.diagnosis.logs import Logs, read_as, score_as
from ident.diagnosis.reference import reference
from ident.diagnosis.screen import Screen, Screened, screened
from ident.errors import IdentificationError

SHOWN = 4.0
"""Standard errors by which an alternative must predict the currents better to be a fault."""
TIE = 2.0
"""Standard errors by which the best of two alternatives must predict better to be told from the other."""
LOOKED_AT = 3
"""Best alternatives of either kind that are compared in full."""
WORTH = 8.0
"""Gain in log likelihood on few instants from which a reading is compared in full: that of z = 4 if all is white."""
FAULTS = 3
"""Faults that are looked for in one set of logs."""


@dataclass(frozen=True, slots=True, eq=False)
class Small:
    """A direction, and what it adds."""

    direction: Direction
    found: Added

    @property
    def z(self) -> float:
        """Standard errors by which it predicts better."""
        return z_of(self.found.u)


@dataclass(frozen=True, slots=True, eq=False)
class Compared:
    """An alternative compared in full with the logs as they are.

    Attributes:
        alternative: The alternative.
        u: Gain of each block, shape (blocks,).
        logs: The logs read so.
    """

    alternative: Alternative
    u: Array
    logs: Logs

    @property
    def z(self) -> float:
        """Standard errors by which it predicts better."""
        return z_of(self.u)


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """What is said of one set of logs by all alternatives.

    Attributes:
        small: Directions, those that predict best first.
        gross: Other readings by the screen, the best first.
        full: Those compared in full, the best first.
    """

    small: tuple[Small, ...]
    gross: tuple[Screened, ...]
    full: tuple[Compared, ...]


def survey(logs: Logs, families: Sequence[Family] = tuple(FAMILIES.values())) -> Survey:
    """Compare logs with all alternatives."""
    fit = reference(logs.problem)
    small = list[Small]()
    if fit is not None:
        for family in families:
            for each in family.directions(fit, logs):
                found = added(logs.model.fits, each.columns)
                if found is not None:
                    small.append(Small(each, found))
    small.sort(key=lambda each: -float(each.found.u.sum()))
    gross = screened(Screen(logs), [each for family in families for each in family.alternatives(logs)])
    likely = [each.alternative for each in gross[:LOOKED_AT] if each.gain.sum() > WORTH]
    for each in [each for each in small if each.z > SHOWN - 1.0][:LOOKED_AT]:
        if each.direction.alternative is not None:
            likely.append(each.direction.alternative(each.found.value))
    full = [each for alternative in likely if (each := compared(logs, alternative)) is not None]
    full.sort(key=lambda each: -float(each.u.sum()))
    return Survey(tuple(small), tuple(gross), tuple(full))


def compared(logs: Logs, alternative: Alternative) -> Compared | None:
    """An alternative in full; None if logs read so cannot be filtered."""
    try:
        other = read_as(logs, alternative.reading)
    except IdentificationError:
        return None
    return Compared(alternative, gains(logs.model.fits.score, score_as(other, alternative.reading)), other)


def unfolded(x: Array) -> float:
    """Norm."""
    return float(np.linalg.norm(x))
