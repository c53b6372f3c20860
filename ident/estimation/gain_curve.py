"""Drive gain of one joint over its current, from laws of size and sign (`ident.estimation.laws`)."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from annotated_types import Interval

from ident.support.arrays import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class GainCurve:
    """Gain over current, g(i) = g (1 - slope (|i| - current) - by_sign sign(i)); the torque of the drive is g(i) i.

    Attributes:
        current: Size of the current at which g, the mean of both signs, holds [drive units]: rms with a payload.
        largest: Largest current of the logs [drive units]; larger ones have the gain of this one.
        slope: Relative fall of the gain per unit of current [1 / drive unit].
        by_sign: Relative fall of the gain at positive currents, and rise at negative ones.
        covariance: Covariance of slope, then of by_sign, with log g, slope and by_sign.
    """

    current: Annotated[float, Interval(ge=0.0)]
    largest: Annotated[float, Interval(gt=0.0)]
    slope: float
    by_sign: float
    covariance: tuple[tuple[float, float, float], tuple[float, float, float]]

    def _law(self, i: Array) -> Array:
        """Derivatives of g(i) / g by slope and by_sign at some currents, shape (.., 2)."""
        return -np.stack((np.minimum(np.abs(i), self.largest) - self.current, np.sign(i)), axis=-1)

    def relative(self, i: Array) -> Array:
        """Return g(i) / g at some currents [drive units], of any shape."""
        return 1.0 + self._law(i) @ (self.slope, self.by_sign)

    def rel_variance(self, i: Array) -> Array:
        """Return the variance of log g(i) at some currents, less that of log g, which may be larger."""
        x, K = self._law(i), np.array(self.covariance)
        return np.sum(x * (2.0 * K[:, 0] + x @ K[:, 1:]), axis=-1)

    @property
    def even(self) -> "GainCurve":
        """The mean of both signs."""
        (with_gain, own, _), nothing = self.covariance[0], (0.0, 0.0, 0.0)
        return replace(self, by_sign=0.0, covariance=((with_gain, own, 0.0), nothing))

    def words(self, joint: int, gain: float, unit: str) -> str:
        """Describe the curve of a joint, from 0, with gain g, by the unit of its torque."""
        said = f"joint {joint + 1}: {gain:.4g} {unit}/unit"
        if self.slope:
            end = gain * float(self.even.relative(np.array(self.largest)))
            way = "falls" if self.slope > 0.0 else "rises"
            said += f" at a current of {self.current:.3g}, {way} to {end:.4g} at {self.largest:.3g}, the largest seen"
        if self.by_sign:
            ways = ("larger", "smaller") if self.by_sign < 0.0 else ("smaller", "larger")
            said += f"; {100.0 * abs(self.by_sign):.2g} % {ways[0]} at positive and {ways[1]} at negative currents"
        return said
