"""Definition of a sensor: values, and functions that change readings or the log.

A sensor is a dataclass. Its fields are keys of a scenario's `[experiment.sensors]`, zero for an ideal one; its methods
act, and an inherited method does nothing. `sim.sensors` lists all of them. As for `sim.effects`, each method is called
on the values of all sensors as that of its own class (`Clock.logs(options, log, streams)`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, TypeAlias

import numpy as np

from ident.support.arrays import Array
from ident.support.options import refuse_outside
from sim.errors import PlantError

NoiseStreams: TypeAlias = Mapping[str, np.random.Generator]
"""Random numbers of one motion: a generator for each kind of noise."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Log:
    """The log of one motion: N samples of n joints."""

    t: Array  # time stamps [s], shape (N,)
    q: Array  # positions as read by the controller [rad], shape (N, n)
    v: Array  # current references [drive units], shape (N, n)
    rate_hz: float  # sampling rate [Hz]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Noise:
    """First-order model of one kind of noise: factors of independent numbers of unit variance."""

    stream: str
    q: Array  # factor for positions [rad], broadcasts to (N, n)
    v: Array  # factor for currents [drive units], broadcasts to (N, n)
    shared: bool = False  # whether all joints have the same number in a sample
    lasting: bool = False  # whether all samples of a motion have the same number
    sos: Array | None = None  # second-order sections that filter the numbers; None for white noise


Reader = Callable[[Array], None]
"""Changes the readings of one control period in place, shape (B, n); called once a period, in order."""


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """Base of the sensors.

    Attributes:
        streams: Names of its random numbers, from one generator unless a run replaces some.
    """

    streams: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        """Check the ranges."""
        refuse_outside(self, PlantError, "sensors")

    def fits(self, rate_hz: float) -> None:
        """Raise a `PlantError` for values that do not fit a rate [Hz]."""

    @staticmethod
    def reader(values: Sequence[object], streams: Sequence[NoiseStreams], n: int) -> Reader | None:
        """Return the function that distorts readings of B simulations in the loop; None if all are exact."""
        return None

    def logs(self, log: Log, streams: NoiseStreams) -> Log:
        """Change the log, outside the loop; the same object if nothing changes."""
        return log

    def noise(self, log: Log) -> Sequence[Noise]:
        """First-order model of the noise that is added to a noise-free log; none without a known spectrum."""
        return ()
