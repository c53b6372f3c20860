"""Whether more than one thing is wrong with logs: what explains them better is mended, and they are looked at again.

With two mistakes the single change that explains most need not be one of them: it may be the best that one change can
do. Where a second look still finds something that surely explains more, no change is therefore named as sure; which
joint to begin with is told, and what may be wrong.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.arrays import Mask
from ident.checks.arm_remarks import MEND, NAMED, TOPIC, better_readings
from ident.checks.comparison import Alternative, Logs, compared, prepared
from ident.checks.gear_ratio import motor_side
from ident.checks.remark import Grade, Remark
from ident.observation import ObserveOptions
from ident.readings import Reading
from ident.recording import Recording
from ident.structure import structure_of


@dataclass(frozen=True, slots=True, eq=False)
class Several:
    """More than one mistake.

    Attributes:
        first: The single change that explains most; it need not undo one of them.
        second: What explains most after it.
    """

    first: Reading
    second: Reading


def several_mistakes(logs: Logs, sure: Sequence[Alternative], options: ObserveOptions) -> Several | None:
    """What a second look finds; None if a single change is enough.

    Args:
        logs: As they are.
        sure: Changes that surely explain them better, equally good, the best one first.
        options: Filters.
    """
    found = list[Several]()
    for each in sure[:NAMED]:
        first = each.readings[0]
        after = mended(logs, first, options)
        second = better_readings(compared(after, motor_side(after)))
        if not second:
            return None
        found.append(Several(first, second[0].readings[0]))
    return found[0] if found else None


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
            each.t,
            reading.factor * each.q[:, reading.q_order] + reading.zero,
            each.v[:, reading.v_order],
            each.name,
        )
        for each in logs.recordings
    ]
    return prepared(structure, recordings, options)


def several_remark(found: Several) -> Remark:
    """The line on more than one mistake."""
    joints = np.flatnonzero(touched(found.first))
    named = " and ".join(str(j + 1) for j in joints)
    where = f"joint{'' if len(joints) == 1 else 's'} {named}" if 0 < len(joints) <= 2 else "order, base and units"
    return Remark(
        topic=TOPIC,
        joint=int(joints[0]) if len(joints) else None,
        seen=f"more than one thing is wrong; perhaps {found.first.words}, and then {found.second.words}",
        grade=Grade.WRONG,
        advice=f"begin with {where}, {MEND}, and check again",
    )


def touched(reading: Reading) -> Mask:
    """Joints whose columns a reading changes, shape (n,)."""
    own = np.arange(len(reading.factor))
    return (reading.factor != 1.0) | (reading.zero != 0.0) | (reading.q_order != own) | (reading.v_order != own)
