"""How much joints warmed, by logs that have temperatures, and what that may do to gains.

Per kelvin magnets weaken by up to `GAIN`, dry friction falls by up to `COULOMB` and viscous friction by `VISCOUS`: the
largest that the error budgets of this project draw (`gain and heat`, `friction and heat`). Friction of its own for
every motion, which the default estimator has, takes up what differs between motions, not what drifts within one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.arrays import Array
from ident.checks.remark import Grade, Remark

GAIN, COULOMB, VISCOUS = 0.001, 0.01, 0.03
"""Largest relative changes by temperature [1/K]: NdFeB magnets, seals and grease, oil."""
MOST_GAIN, MOST_FRICTION = 0.005, 0.1
"""Changes from which on a line is weak: half a percent of a gain; a tenth of the friction."""
COLDEST, HOTTEST, JUMP = -40.0, 150.0, 5.0
"""Temperatures of drives, and what lies between two samples at most [degrees Celsius]."""
TOPIC = "temperature"
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


def warming_remarks(warmths: Sequence[Warmth]) -> list[Remark]:
    """How much each joint warmed within each log, and from the first to each other.

    Args:
        warmths: Of the logs that have temperatures, in the order of the command line; none where none has.
    """
    found = list[Remark]()
    sound = list[Warmth]()
    for each in warmths:
        strange = _strange(each.celsius)
        if strange is None:
            sound.append(each)
            found.append(_line(each.log, "warmed by", each.ends[1] - each.ends[0], 0.5, WITHIN))
        else:
            found.append(Remark(topic=TOPIC, log=each.log, joint=strange, grade=Grade.WEAK, seen=_why(strange)))
    for each in sound[1:]:
        rise = each.level - sound[0].level
        found.append(_line(each.log, f"beside {sound[0].log} warmer by", rise, 1.0, BETWEEN))
    return found


WITHIN = "warm up longer before recording, or rest less between motions"
BETWEEN = "warm up before the first motion, and record bare, loaded and bare again"


def _strange(celsius: Array) -> int | None:
    """The first joint whose column is no temperature of a drive."""
    inside = np.isfinite(celsius) & (celsius >= COLDEST) & (celsius <= HOTTEST)
    smooth = np.abs(np.diff(celsius, axis=0)).max(axis=0, initial=0.0) <= JUMP
    return next((j for j in range(celsius.shape[1]) if not (inside[:, j].all() and smooth[j])), None)


def _why(joint: int) -> str:
    return (
        f"T of joint {joint + 1} is no temperature in degrees Celsius ({COLDEST:g} to {HOTTEST:g}, no jumps); it is "
        "not looked at"
    )


def _line(log: str, words: str, rise: Array, mean: float, advice: str) -> Remark:
    """A line on a rise of every joint; `mean` is the share of it by which the motion as a whole is off."""
    gain, dry, viscous = (float(np.abs(rise).max()) * mean * rate for rate in (GAIN, COULOMB, VISCOUS))
    joint = int(np.argmax(np.abs(rise)))
    weak = gain > MOST_GAIN or viscous > MOST_FRICTION
    listed = ", ".join(f"{x:.1f}" for x in rise)
    may = f"joint {joint + 1}: up to {100 * gain:.2g} % of gain, {100 * dry:.2g} and {100 * viscous:.2g} % of friction"
    return Remark(
        topic=TOPIC,
        log=log,
        joint=joint,
        seen=f"joints {words} {listed} K; {may}",
        grade=Grade.WEAK if weak else Grade.GOOD,
        advice=advice if weak else None,
    )
