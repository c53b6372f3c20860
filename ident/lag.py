"""What currents that are logged late do to the gains: which it moves, so much that it is said or that they are refused.

What a delay does to a gain follows from the influence of each row. Motions that are late alike cost little, motions
that are not cost much.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.arrays import Array
from ident.delay import Delay, common_delay, joint_delay
from ident.errors import NotIdentifiable
from ident.estimate import GainEstimate, IdentifiedGain, RefusedGain
from ident.gain_system import joint_rows
from ident.problem import Problem
from ident.rows import Rows

SEEN, MOST = 0.01, 0.05
"""Relative changes of a gain by it that are not worth a word, and that no gain survives."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lag:
    """A gain that a delay moves.

    Attributes:
        joint: The joint, from 0.
        change: Relative change of the gain that it makes.
        words: How late which motion is.
    """

    joint: int
    change: float
    words: str


def lags(problem: Problem, estimate: GainEstimate) -> tuple[Lag, ...]:
    """The gains that sure delays move by more than `SEEN`.

    The delay is that of all joints together: the log of a controller is late as a whole.
    """
    if not problem.payloads:
        return ()
    found = {joint: joint_delay(problem, joint_rows(problem, joint)) for joint in estimate.solution.rows.unknowns}
    own = {joint: delay for joint, delay in found.items() if delay is not None}
    late = _late(own)
    solution = estimate.solution
    change = -(solution.influence @ _correction(problem, solution.rows, late)) / solution.inverse
    return tuple(
        Lag(joint=joint, change=float(moved), words=_words(problem, estimate, late, k))
        for k, (joint, moved) in enumerate(zip(solution.joints.tolist(), change, strict=True))
        if estimate.identifiable[joint] and abs(moved) > SEEN
    )


def in_time(estimate: GainEstimate, found: Sequence[Lag]) -> GainEstimate:
    """The estimate without the gains that a delay moves too much.

    Raises:
        NotIdentifiable: If no gain is left.
    """
    joints = list(estimate.joints)
    for each in found:
        gain = joints[each.joint]
        if abs(each.change) > MOST and isinstance(gain, IdentifiedGain):
            joints[each.joint] = RefusedGain(
                joint=gain.joint, reason=_sentence(each), predicted_rel_std=gain.predicted_rel_std
            )
    if found and not any(isinstance(joint, IdentifiedGain) for joint in joints):
        raise NotIdentifiable(f"no drive gain can be identified; joint {found[0].joint + 1}: {_sentence(found[0])}")
    return replace(estimate, joints=tuple(joints))


def lag_notes(found: Sequence[Lag]) -> tuple[str, ...]:
    """A note on every gain that a delay moves, though not so much that it is refused."""
    return tuple(f"joint {each.joint + 1}: {_sentence(each)}" for each in found if abs(each.change) <= MOST)


def with_suspects(message: str, found: Sequence[Lag]) -> str:
    """A complaint about data that contradict themselves, with the delay that may be why."""
    late = [each for each in found if abs(each.change) > MOST]
    return f"{message}; or else, on joint {late[0].joint + 1}, {_sentence(late[0])}" if late else message


def _late(own: Mapping[int, Delay]) -> dict[int, Delay]:
    """The delay of all joints together for each of them, if it is sure.

    A delay of one joint alone is not believed: a friction law or a compliance that its model lacks looks like one.
    """
    if not own:
        return {}
    common = common_delay(list(own.values()))
    return dict.fromkeys(own, common) if common.sure else {}


def _correction(problem: Problem, rows: Rows, late: Mapping[int, Delay]) -> Array:
    """What the currents of each row change by if they are moved to where they belong, shape (r,)."""
    correction = np.zeros(len(rows.V))
    for run in rows.runs():
        joint, motion = int(rows.joint[run.start]), int(rows.motion[run.start])
        if joint in late:
            observed = problem.motions[motion].observation.joints[joint]
            at = np.searchsorted(observed.position, rows.position[run])
            correction[run] = late[joint].value[motion] * observed.V_rate[at]
    return correction


def _words(problem: Problem, estimate: GainEstimate, late: Mapping[int, Delay], k: int) -> str:
    """How late the currents that gain k rests on are, motion by motion; of its own joint if that one is late."""
    joint = int(estimate.solution.joints[k])
    worst = late[joint] if joint in late else next(iter(late.values()))
    pair = [motion.payload is None for motion in problem.motions] == [True, False]
    names = ("the bare motion", "the loaded motion") if pair else [f"motion {m + 1}" for m in range(len(worst.value))]
    return " and ".join(
        f"{1e3 * value:.2g} ms in {name}" for value, name in zip(worst.value.tolist(), names, strict=True)
    )


def _sentence(each: Lag) -> str:
    return (
        f"the currents come later than the positions, by {each.words} (less than 0: earlier), which moves this gain by "
        f"{100.0 * abs(each.change):.2g} %; shift v against q in the logs, or log both with one clock"
    )
