"""How much joints warmed, by logs that have temperatures, and what that may do to gains.

Per kelvin magnets weaken by up to `GAIN`, viscous friction falls by up to `VISCOUS`, dry friction by less: the
largest that the error budgets of this project draw (`gain and heat`, `friction and heat`). The default estimator has
friction of its own for every motion, which accounts for what differs between motions, not for what drifts within one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePath

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Severity
from ident.support.arrays import Array

GAIN, VISCOUS = 0.001, 0.03
"""Largest relative changes by temperature [1/K]: NdFeB magnets, oil."""
MOST_GAIN, MOST_FRICTION = 0.005, 0.1
"""Changes that are worth a warning: half a percent of a gain; a tenth of the friction."""
COLDEST, HOTTEST, JUMP = -40.0, 150.0, 5.0
"""Temperatures of drives, and what lies between two samples at most [degrees Celsius]."""
NAME = "temperature"
ENDS = 0.05
"""Share of a log, at either end, whose median is its temperature there."""


@dataclass(frozen=True, slots=True, eq=False)
class Warmth:
    """Temperatures of one log.

    Attributes:
        log: Its name.
        celsius: Of every joint [degrees Celsius], shape (N, n).
    """

    log: str
    celsius: Array

    @property
    def ends(self) -> Array:
        """Temperature at the beginning and at the end, shape (2, n)."""
        size = max(1, round(ENDS * len(self.celsius)))
        return np.array([np.median(part, axis=0) for part in (self.celsius[:size], self.celsius[-size:])])

    @property
    def level(self) -> Array:
        """Mean temperature, shape (n,)."""
        return np.mean(self.celsius, axis=0)


def temperature(warmths: Sequence[Warmth]) -> list[Diagnosis]:
    """How much each joint warmed within each log, and from the first log to each other.

    Args:
        warmths: Of the logs that have temperatures, in the order of the command line; none where none has.
    """
    found = list[Diagnosis]()
    sound = list[Warmth]()
    for each in warmths:
        strange = _strange(each.celsius)
        if strange is None:
            sound.append(each)
            found.append(_warming(each.log, ("warms by", ""), each.ends[1] - each.ends[0], 0.5, WITHIN))
        else:
            found.append(_no_temperature(each.log, strange))
    for each in sound[1:]:
        words = "is warmer by", f" than in {PurePath(sound[0].log).name}"
        found.append(_warming(each.log, words, each.level - sound[0].level, 1.0, BETWEEN))
    return found


WITHIN = "warm up longer before recording"
BETWEEN = "warm up first; record bare, loaded and bare again"


def _strange(celsius: Array) -> int | None:
    """The first joint whose column is no temperature of a drive."""
    inside = np.isfinite(celsius) & (celsius >= COLDEST) & (celsius <= HOTTEST)
    smooth = np.abs(np.diff(celsius, axis=0)).max(axis=0, initial=0.0) <= JUMP
    return next((j for j in range(celsius.shape[1]) if not (inside[:, j].all() and smooth[j])), None)


def _no_temperature(log: str, joint: int) -> Diagnosis:
    return Diagnosis(
        name=NAME,
        severity=Severity.WEAK,
        sentence=f"the temperature of joint {joint + 1} jumps or is outside {COLDEST:g} to {HOTTEST:g} "
        "degrees Celsius; it is ignored",
        joints=(joint,),
        logs=(log,),
    )


def _warming(log: str, words: tuple[str, str], rise: Array, mean: float, advice: str) -> Diagnosis:
    """A rise of every joint; `mean` is the share of it by which the motion as a whole is off."""
    gain, viscous = (float(np.abs(rise).max()) * mean * rate for rate in (GAIN, VISCOUS))
    joint, (verb, beside) = int(np.argmax(np.abs(rise))), words
    weak = gain > MOST_GAIN or viscous > MOST_FRICTION
    return Diagnosis(
        name=NAME,
        severity=Severity.WEAK if weak else Severity.GOOD,
        sentence=f"joint {joint + 1} {verb} {rise[joint]:.1f} K{beside}: gain may change by {100 * gain:.2g} %, "
        f"friction by {100 * viscous:.2g} %",
        advice=advice if weak else None,
        joints=(joint,),
        logs=(log,),
        value=float(rise[joint]),
        unit="K",
    )
