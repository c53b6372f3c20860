"""What the comparison of readings says of the model: right, perhaps another, surely another; and what nothing tells."""

from collections.abc import Sequence

import numpy as np

from ident.checks.comparison import SUSPECT, Alternative, Comparison
from ident.checks.remark import Grade, Remark
from ident.evidence import among_best, convincing
from ident.readings import Reading

WITNESSED = 12.0
"""The same from which a reading that friction speaks for as well is sure."""
NAMED = 4
"""Readings that a line names."""
MEND = "mend the log, or the model if it is the model that is so"
TOPIC = "signs, zeros, order, base"


def arm_remarks(found: Comparison, backward: Sequence[int], several: Remark | None = None) -> list[Remark]:
    """Lines on the model, the most important one first.

    Args:
        found: The comparison.
        backward: Joints, from 0, whose friction drives.
        several: That more than one thing is wrong, None if that is not so.
    """
    return [several or _best(found, backward), *_out_of_reach(found), *_untold(found), *_not_excluded(found)]


def named_readings(found: Comparison, backward: Sequence[int]) -> tuple[Alternative, ...]:
    """The readings that surely explain the log better than it does itself, best first; those within a tie of the best.

    A joint that its friction drives is a second witness for a reading that negates its positions.
    """
    return _best_of([each for each in found.alternatives if _proven(each, found) or _witnessed(each, backward)])


def better_readings(found: Comparison) -> tuple[Alternative, ...]:
    """As `named_readings`, borne out or not: where they are not, something else is wrong that they make up for."""
    return _best_of([each for each in found.alternatives if _convincing(each, found)])


def _best_of(sure: Sequence[Alternative]) -> tuple[Alternative, ...]:
    """Those within a tie of the best."""
    return tuple(each for each, tied in zip(sure, among_best([each.gain for each in sure]), strict=True) if tied)


def words_of(readings: Sequence[Reading], backward: Sequence[int] = ()) -> str:
    """Readings in words; first those that let friction brake every joint."""
    ordered = sorted(readings, key=lambda each: _against_friction(each, backward))
    words = " = ".join(each.words for each in ordered[:NAMED])
    return words + (f" = {len(ordered) - NAMED} more" if len(ordered) > NAMED else "")


def _proven(each: Alternative, found: Comparison) -> bool:
    # Where the log as it is cannot be right, any reading that explains more is likelier.
    return _convincing(each, found) and (each.borne_out or bool(found.unreachable and not found.same))


def _convincing(each: Alternative, found: Comparison) -> bool:
    # The log as it is cannot be right; without one that explains as much and can, any that explains more is likelier.
    if found.unreachable and not found.same:
        return each.evidence > 0.0
    return convincing(each.gain, each.evidence, each.readings[0])


def _witnessed(each: Alternative, backward: Sequence[int]) -> bool:
    return each.evidence > WITNESSED and any((reading.factor[list(backward)] < 0.0).any() for reading in each.readings)


def _against_friction(reading: Reading, backward: Sequence[int]) -> int:
    """Joints that friction would drive under a reading."""
    negated = set(np.flatnonzero(reading.factor < 0.0).tolist())
    return len(negated ^ set(backward))


def _best(found: Comparison, backward: Sequence[int]) -> Remark:
    sure = named_readings(found, backward)
    if sure:
        words = " or ".join(words_of(each.readings, backward) for each in sure[:NAMED])
        return Remark(
            topic=TOPIC,
            joint=_joint(sure[0]),
            seen=f"{words} explains the currents better: {_share(found, sure[0])}",
            grade=Grade.WRONG,
            advice=MEND,
        )
    if found.unreachable and found.same:
        words = words_of(found.same, backward)
        return Remark(topic=TOPIC, seen=f"{words} puts the joints where they can be", grade=Grade.WRONG, advice=MEND)
    suspects = [each for each in found.alternatives if each.evidence > SUSPECT]
    if suspects:
        return Remark(
            topic=TOPIC,
            joint=_joint(suspects[0]),
            seen=f"perhaps {words_of(suspects[0].readings, backward)}: {_share(found, suspects[0])}, too little to be "
            "sure",
            grade=Grade.WEAK,
            advice="check it, or record longer, with more speed or with a payload, which tells",
        )
    left = ", ".join("-" if not np.isfinite(each) else f"{100.0 * each:.2g}" for each in found.given.left)
    return Remark(topic=TOPIC, seen=f"no other reading explains the currents better; unexplained: {left} % of rms")


def _out_of_reach(found: Comparison) -> list[Remark]:
    joints = ", ".join(f"q{j + 1}" for j in found.unreachable)
    return (
        [
            Remark(
                topic="reach",
                joint=found.unreachable[0],
                seen=f"{joints} {'is' if len(found.unreachable) == 1 else 'are'} where the model's joints cannot be",
                grade=Grade.WRONG,
                advice="check units (degrees, motor side), zeros and the model's limits",
            )
        ]
        if found.unreachable
        else []
    )


def _untold(found: Comparison) -> list[Remark]:
    if not found.same:
        return []
    words = ", ".join(each.words for each in found.same)
    return [Remark(topic="no motion tells", seen=f"{words}: the same by the kinematics")]


def _not_excluded(found: Comparison) -> list[Remark]:
    """What these logs alone are too quiet to exclude; lengths, which hardly matter where they hardly show, left out."""
    near = [
        each
        for each in found.alternatives
        if -SUSPECT < each.evidence <= SUSPECT and (each.readings[0].stretch == 1.0).all()
    ]
    if not near or found.unreachable:
        return []
    words = "; ".join(words_of(each.readings) for each in near[:NAMED])
    more = f"; {len(near) - NAMED} more" if len(near) > NAMED else ""
    return [
        Remark(
            topic="these logs do not tell",
            seen=f"{words}{more}",
            grade=Grade.WEAK,
            advice="check them by hand, or add a recording with a payload",
        )
    ]


def _joint(each: Alternative) -> int:
    return int(np.argmax(each.gain))


def _share(found: Comparison, each: Alternative) -> str:
    """How much less it leaves of the current that shows it most."""
    joint = _joint(each)
    given = 100.0 * found.given.left[joint]
    return f"unexplained of v{joint + 1} {given * np.exp(-each.gain[joint]):.2g} instead of {given:.2g} %"
