"""What a sensor does between the plant and its log: values with ranges, and how they change readings or the log.

A file of this package holds one or a few that share random numbers. Their values are a dataclass whose fields are keys
of a scenario's `[experiment.sensors]`, `EFFECT` the functions that act; a function that is left out does nothing.
`sim.sensors` names them all.
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
    """Random numbers of one motion, each kind of noise from a generator of its own choice.

    Attributes:
        generators: By the name of the kind.
    """

    generators: Mapping[str, np.random.Generator]

    def __getitem__(self, name: str) -> np.random.Generator:
        """The generator of one kind."""
        return self.generators[name]

    def replaced(self, others: Mapping[str, np.random.Generator]) -> "NoiseStreams":
        """The same with some kinds from other generators."""
        return NoiseStreams({**self.generators, **others})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Log:
    """What is logged of one motion: N samples of n joints.

    Attributes:
        t: Time stamps [s], shape (N,).
        q: Positions as the controller read them [rad], shape (N, n).
        v: Current references [drive units], shape (N, n).
        rate_hz: Rate at which the samples were taken [Hz].
    """

    t: Array
    q: Array
    v: Array
    rate_hz: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Noise:
    """What one kind of noise adds to a log, to first order: independent numbers of unit variance times these.

    Attributes:
        stream: Name of its random numbers.
        q: Into positions [rad], broadcasts to (N, n).
        v: Into currents [drive units], broadcasts to (N, n).
        shared: Whether all joints get the same number of a sample.
        lasting: Whether all samples of a motion get the same number.
        sos: Second-order sections that the numbers pass through first; None for white.
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
    """Of a sensor that does nothing here."""


def _no_reader(*_: object) -> None:
    """Of a sensor that is not in the loop."""
    return


def no_noise(*_: object) -> Sequence[Noise]:
    """Of a sensor that draws nothing, or nothing of which a spectrum is known."""
    return ()


def _as_it_is(values: object, log: Log, streams: NoiseStreams) -> Log:
    return log


@dataclass(frozen=True, kw_only=True, eq=False)
class SensorEffect(Generic[V]):
    """What one sensor does; V are its values.

    Attributes:
        streams: Names of its random numbers. They are one generator unless a run replaces some.
        fits: Refuses values that do not fit a rate [Hz], with a `SensorError`.
        reader: What B simulations with these values and noise read in the loop; None if all read the truth.
        logs: What stands in the log, beside the loop.
        noise: What its random numbers add to a log that has none of them yet, to first order.
    """

    streams: tuple[str, ...] = ()
    fits: Callable[[V, float], None] = _nothing
    reader: Callable[[Sequence[V], Sequence[NoiseStreams], int], Reader | None] = _no_reader
    logs: Callable[[V, Log, NoiseStreams], Log] = _as_it_is
    noise: Callable[[V, Log], Sequence[Noise]] = no_noise
