"""Definition of a sensor effect: values with ranges, and functions that change readings or the log.

Each file of this package defines one, or a few that share random numbers. The values are a dataclass whose fields are
keys of a scenario's `[experiment.sensors]`; `EFFECT` has the functions that act, and an omitted function does nothing.
`sim.sensors` lists all of them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from ident.support.arrays import Array
from ident.support.ranges import refuse_outside
from sim.errors import SensorError

V = TypeVar("V", contravariant=True)


@dataclass(frozen=True, kw_only=True)
class Values:
    """Base of the values of every sensor.

    Raises:
        SensorError: If a number is not finite or outside its annotated range.
    """

    def __post_init__(self) -> None:
        """Check the values."""
        refuse_outside(self, SensorError, "sensors")


@dataclass(frozen=True, slots=True, eq=False)
class NoiseStreams:
    """Random numbers of one motion, with a generator for each kind of noise.

    Attributes:
        generators: Generators by the name of the kind.
    """

    generators: Mapping[str, np.random.Generator]

    def __getitem__(self, name: str) -> np.random.Generator:
        """Return the generator of one kind."""
        return self.generators[name]

    def replaced(self, others: Mapping[str, np.random.Generator]) -> "NoiseStreams":
        """Return a copy with other generators for some kinds."""
        return NoiseStreams({**self.generators, **others})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Log:
    """The log of one motion: N samples of n joints.

    Attributes:
        t: Time stamps [s], shape (N,).
        q: Positions as read by the controller [rad], shape (N, n).
        v: Current references [drive units], shape (N, n).
        rate_hz: Sampling rate [Hz].
    """

    t: Array
    q: Array
    v: Array
    rate_hz: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Noise:
    """First-order model of one kind of noise: factors of independent numbers of unit variance.

    Attributes:
        stream: Name of the random numbers.
        q: Factor for positions [rad], broadcasts to (N, n).
        v: Factor for currents [drive units], broadcasts to (N, n).
        shared: Whether all joints have the same number in a sample.
        lasting: Whether all samples of a motion have the same number.
        sos: Second-order sections that filter the numbers; None for white noise.
    """

    stream: str
    q: Array
    v: Array
    shared: bool = False
    lasting: bool = False
    sos: Array | None = None


Reader = Callable[[Array], None]
"""Changes the readings of one control period in place, shape (B, n); called once a period, in order."""


def _nothing(*_: object) -> None:
    """Function of a sensor that does nothing at this point."""


def _no_reader(*_: object) -> None:
    """Function of a sensor that is not in the loop."""
    return


def no_noise(*_: object) -> Sequence[Noise]:
    """Function of a sensor without random numbers, or without a known spectrum."""
    return ()


def _as_it_is(values: object, log: Log, streams: NoiseStreams) -> Log:
    return log


@dataclass(frozen=True, kw_only=True, eq=False)
class SensorEffect(Generic[V]):
    """Functions of one sensor effect; V is the type of its values.

    Attributes:
        streams: Names of its random numbers, from one generator unless a run replaces some.
        fits: Raises a `SensorError` for values that do not fit a rate [Hz].
        reader: Returns the function that distorts readings of B simulations in the loop; None if all are exact.
        logs: Changes the log, outside the loop.
        noise: First-order model of the noise that it adds to a noise-free log.
    """

    streams: tuple[str, ...] = ()
    fits: Callable[[V, float], None] = _nothing
    reader: Callable[[Sequence[V], Sequence[NoiseStreams], int], Reader | None] = _no_reader
    logs: Callable[[V, Log, NoiseStreams], Log] = _as_it_is
    noise: Callable[[V, Log], Sequence[Noise]] = no_noise
