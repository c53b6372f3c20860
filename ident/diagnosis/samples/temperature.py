"""Warming of joints, from logs with temperatures, and its possible effect on gains.

Per kelvin, magnets weaken by up to `GAIN` and viscous friction falls by up to `VISCOUS`, Coulomb friction by less: the
largest values in the error budgets of this project (`gain and heat`, `friction and heat`). The default estimator has
separate friction for every motion, which accounts for differences between motions, but not for drift within one.
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
"""Changes that cause a warning: 0.5 % of a gain, 10 % of friction."""
COLDEST, HOTTEST, JUMP = -40.0, 150.0, 5.0
"""Range of drive temperatures, and largest change between two samples [degrees Celsius]."""
NAME = "temperature"
ENDS = 0.05
"""Share of a log at each end whose median is the temperature there."""


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
    """Check how much each joint warmed within each log, and from the first log to each other one.

    Args:
        warmths: Temperatures of the logs that have them, in the order of the command line; may be empty.
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
    """The first joint whose column is not a plausible temperature."""
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
    """Return the diagnosis of a temperature rise; `mean` is the share of it that affects the motion on average."""
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
