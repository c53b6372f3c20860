"""Families of faults, a row each: large ones as hypotheses on the logs, small ones as columns of currents.

`FAMILIES` is all that search and limits know of a kind of fault. Terms that the model may lack compete with faults, so
that no fault is reported for what a term explains; they are in `ident.diagnosis.terms`.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from ident.diagnosis import arm_faults as arms
from ident.diagnosis import column_faults as columns
from ident.diagnosis import encoding_faults as encodings
from ident.diagnosis import terms
from ident.diagnosis.hypothesis import Alternative, Logs
from ident.diagnosis.models import Reference


@dataclass(frozen=True, slots=True)
class Limit:
    """Sizes of a family whose limit is reported."""

    words: str  # what is excluded beyond the limit
    column: str = ""  # column of the single joint concerned, "" for faults of all joints
    one_log: bool = False  # whether the fault is one of a single log
    undetectable: str = ""  # what is reported without a limit; "" for nothing


@dataclass(frozen=True, slots=True, kw_only=True)
class Family:
    """A kind of fault, or of term of the model: large ones as hypotheses, small ones as columns of currents."""

    name: str  # name of its directions
    alternatives: Callable[[Logs], Iterable[Alternative]] = lambda logs: ()  # large ones
    # large ones of another arm, which are compared only if the logs show some fault or term:
    laborious: Callable[[Logs], Iterable[Alternative]] = lambda logs: ()
    directions: Callable[[Reference, Logs], Iterable[Alternative]] = lambda reference, logs: ()  # small ones
    # small ones that only refine large ones:
    refining: Callable[[Reference, Logs], Iterable[Alternative]] = lambda reference, logs: ()
    seldom: bool = False  # whether it is a rare fault, which comes last of alternatives that predict equally well
    limits: tuple[Limit, ...] = ()  # sizes that are bounded; large alternatives are then not reported as excluded
    # names of its large alternatives that are excluded as a whole or by joint, with their wording:
    excluded: Mapping[str, str] = field(default_factory=dict[str, str])


FAMILIES: tuple[Family, ...] = (
    Family(
        name="zero", alternatives=columns.zeros, directions=columns.small_zeros, limits=(Limit("zeros", "q"),),
        excluded={
            "sign": "opposite sign of q{joints}",
            "joint reversed": "q{joints} and v{joints} both negated in one log",
        },
    ),
    Family(name="convention", laborious=encodings.conventions),
    Family(
        name="delay", directions=columns.delays,
        limits=(Limit("delays of all currents"), Limit("delays of one current in one log", "v", one_log=True)),
    ),
    Family(name="order", alternatives=columns.orders, excluded={"order": "exchanged or reordered columns"}),
    Family(
        name="coupling", alternatives=columns.couplings, excluded={"coupling": "positions that include a neighbour's"}
    ),
    Family(name="transmission", alternatives=arms.misstated_transmissions, laborious=arms.transmissions),
    Family(
        name="ratio", directions=arms.small_ratios, refining=encodings.own_ratios, seldom=True,
        limits=(Limit("errors of a motor's ratio", "q", False, "ratio of motor {joints}"),),
    ),
    Family(
        name="base", alternatives=arms.bases, directions=arms.small_tilts,
        excluded={"base": "a different orientation of the base"},
    ),
    Family(  # from a drawing
        name="lengths", alternatives=arms.lengths, directions=arms.small_lengths, seldom=True,
        limits=(Limit("errors of all lengths"),),
    ),
    Family(
        name="clock", alternatives=columns.clocks, directions=columns.small_clocks,
        limits=(
            Limit("errors of the clock", "", False, "rate of the clock"),
            Limit("errors of the clock of one log", "", True, "rate of the clock of one log"),
        ),
    ),
    Family(
        name="current scale", alternatives=columns.scales, directions=columns.small_scales,
        limits=(
            Limit("errors of all currents' scale in one log", "", True, "scale of all currents in one log"),
            Limit("errors of one current's scale in one log", "v", True, "scale of v{joints} in one log"),
        ),
        excluded={"current sign": "opposite sign of v{joints} in one log"},
    ),
    Family(
        name="unit", alternatives=encodings.units, laborious=encodings.own_gears,
        excluded={"unit": "a different unit of positions"},
    ),
    Family(
        name="normalised", alternatives=encodings.normalised, seldom=True,
        excluded={"normalised": "positions in per cent of each joint's range"},
    ),
    Family(
        name="gravity compensation", alternatives=arms.compensated,
        excluded={"gravity compensation": "gravity-compensated currents"},
    ),
    *(Family(name=name, directions=directions) for name, directions in terms.TERMS.items()),
)  # fmt: skip
"""All families that logs are compared with, in the order in which limits are reported."""
