"""Families of alternatives, one file each: a function for large ones, and one for small ones."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from ident.diagnosis.alternative import Alternative, Direction
from ident.diagnosis.catalog import (
    base,
    clocks,
    current_scales,
    delays,
    lengths,
    orders,
    terms,
    units,
    zeros,
)
from ident.diagnosis.fitted_currents import Reference
from ident.diagnosis.logs import Logs


@dataclass(frozen=True, slots=True)
class Family:
    """A kind of fault.

    Attributes:
        alternatives: Large ones, as hypotheses.
        directions: Small ones, as columns of currents; none if all are large.
        name: Name of its directions.
        seldom: Whether it is a rare fault, so that it comes last of alternatives that predict equally well.
    """

    alternatives: Callable[[Logs], Iterable[Alternative]] = lambda logs: ()
    directions: Callable[[Reference, Logs], Iterable[Direction]] = lambda reference, logs: ()
    name: str = ""
    seldom: bool = False


FAMILIES: dict[str, Family] = {
    "zeros": Family(zeros.alternatives, zeros.directions, "zero"),
    "orders": Family(orders.alternatives),
    "base": Family(base.alternatives, base.directions, "base"),
    "lengths": Family(lengths.alternatives, lengths.directions, "lengths", seldom=True),  # from a drawing
    "clocks": Family(clocks.alternatives, clocks.directions, "clock"),
    "delays": Family(delays.alternatives, delays.directions, "delay"),
    "current scales": Family(current_scales.alternatives, current_scales.directions, "current scale"),
    "units": Family(units.alternatives),
    "gravity compensation": Family(base.compensated),
    "joint elasticity": Family(directions=terms.elasticity),
    "position-dependent torque": Family(directions=terms.position),
    "friction law": Family(directions=terms.speed),
    "friction drift": Family(directions=terms.warming),
    "friction of couplings": Family(directions=terms.coupled_friction),
    "current drift": Family(directions=terms.current_drift),
    "offsets": Family(directions=terms.offsets),
}
"""All families that logs are compared with."""
