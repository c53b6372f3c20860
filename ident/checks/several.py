"""Whether more than one thing is wrong with logs: what explains them better is mended, and they are looked at again.

With two mistakes the single change that explains most need not be one of them: what a second look names is tried first
as well, and the pair that leaves least counts. It is named only where a last look finds nothing more; otherwise nobody
can say what is wrong, but that it is more than one thing.
"""

from dataclasses import dataclass, replace

import numpy as np

from ident.arrays import Array, Mask
from ident.checks.arm_remarks import MEND, TOPIC, named_readings
from ident.checks.comparison import Alternative, Comparison, Logs, compared, prepared
from ident.checks.gear_ratio import motor_side
from ident.checks.remark import Grade, Remark
from ident.evidence import NOTHING
from ident.observation import ObserveOptions
from ident.readings import Reading
from ident.recording import Recording
from ident.structure import structure_of

TURNS = 3
"""Times that the second change of a pair is tried as the first."""


@dataclass(frozen=True, slots=True, eq=False)
class Several:
    """More than one mistake.

    Attributes:
        changes: What undoes them, one after the other.
        settled: Whether nothing explains the logs better after them; if not, they may be others.
    """

    changes: tuple[Reading, Reading]
    settled: bool


@dataclass(frozen=True, slots=True, eq=False)
class _Pair:
    """Two changes, one after the other, and the sum of logarithms of what they leave."""

    changes: tuple[Reading, Reading]
    left: float


def several_mistakes(logs: Logs, first: Alternative, options: ObserveOptions) -> Several | None:
    """Two changes that explain logs better than the best single one does; None if that one is enough.

    Args:
        logs: As they are.
        first: The single change that surely explains them best.
        options: Filters.
    """
    pair = _second(logs, first.readings[0], options)
    if pair is None:
        return None
    best = pair
    for _ in range(TURNS):
        turned = _second(logs, pair.changes[1], options)
        if turned is None or turned.changes[1].words == pair.changes[0].words:
            break
        pair, best = turned, min(best, turned, key=lambda each: each.left)
    both = mended(mended(logs, best.changes[0], options), best.changes[1], options)
    last = _looked_at(both)
    return Several(best.changes, settled=_surest(last) is None and not last.unreachable)


def mended(logs: Logs, reading: Reading, options: ObserveOptions) -> Logs:
    """Logs with what a reading changes of them, and of the arm.

    Args:
        logs: As they are.
        reading: What they may mean.
        options: Filters.
    """
    arm, structure = logs.arm, logs.structure
    if reading.gravity is not arm.gravity or (reading.stretch != 1.0).any():
        structure = structure_of(
            replace(arm, gravity=reading.gravity, translation=reading.stretch[:, None] * arm.translation)
        )
    recordings = [
        Recording(
            each.t, reading.factor * each.q[:, reading.q_order] + reading.zero, each.v[:, reading.v_order], each.name
        )
        for each in logs.recordings
    ]
    return prepared(structure, recordings, options)


def _second(logs: Logs, first: Reading, options: ObserveOptions) -> _Pair | None:
    """A change and the best one after it; None if nothing more explains the logs surely better."""
    after = _looked_at(mended(logs, first, options))
    second = _surest(after)
    if second is None:
        return None
    left = _sum_of_logarithms(after.given.column_left) - float(second.gain.sum())
    return _Pair((first, second.readings[0]), left)


def _looked_at(logs: Logs) -> Comparison:
    return compared(logs, motor_side(logs))


def _surest(found: Comparison) -> Alternative | None:
    return next(iter(named_readings(found, ())), None)


def _sum_of_logarithms(left: Array) -> float:
    known = left[np.isfinite(left)]
    return float(np.log(np.maximum(known, NOTHING)).sum())


def several_remark(found: Several) -> Remark:
    """The line on more than one mistake."""
    first, second = found.changes
    joint = int(np.flatnonzero(touched(first))[0]) if touched(first).any() else None
    if found.settled:
        return Remark(
            topic=TOPIC,
            joint=joint,
            seen=f"more than one thing is wrong: {first.words}, and then {second.words}, explain the currents",
            grade=Grade.WRONG,
            advice=f"{MEND}, first the one, then the other, and check again",
        )
    begin = "the base or the lengths" if joint is None else f"joint {joint + 1}"
    return Remark(
        topic=TOPIC,
        joint=joint,
        seen="more than one thing is wrong: no two changes explain the currents",
        grade=Grade.WRONG,
        advice=f"begin with sign, zero and columns of {begin}, and check again"
        if joint is not None
        else f"begin with {begin}, and check again",
    )


def touched(reading: Reading) -> Mask:
    """Joints whose columns a reading changes, shape (n,)."""
    own = np.arange(len(reading.factor))
    return (reading.factor != 1.0) | (reading.zero != 0.0) | (reading.q_order != own) | (reading.v_order != own)
