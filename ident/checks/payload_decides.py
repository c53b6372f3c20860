"""What the torque of a known payload says of readings that no bare motion can tell apart.

The zero of a last joint turns the payload's centre with it: whatever the arm's own parameters are, they absorb that,
but a payload that was drawn does not. Here the payload is taken as described, with one unknown, 1/g.
"""

from collections.abc import Sequence

import numpy as np
from scipy import linalg

from ident.arrays import Array, Indices, readonly
from ident.checks.comparison import Logs
from ident.checks.remark import Grade, Remark
from ident.evidence import convincing, evidence_of, gain_over
from ident.explanation import DRIFTING, Explanation, Unknowns, reading_columns, regressor_as_read, shares_left
from ident.instants import Instants
from ident.parameters import STANDARD
from ident.payload import KnownPayload, Payload
from ident.readings import Reading, as_it_is
from ident.regressor import regressor
from ident.structure import PROBE_SEED, Structure

STATES = 60
"""Random states a joint that torques are compared on."""
TOPIC = "payload as drawn"
MOST_OF = 0.7
"""Share that a reading explains of what a payload of any parameters does, in logarithms, to be its name.

A zero or a sign that is mended explains nearly all; a centre that is off makes another zero a little better.
"""
SAME = 1e-6
"""Share of a torque that rounding leaves."""


def payload_remarks(logs: Logs, carrying: Sequence[bool], payload: Payload, same: Sequence[Reading]) -> list[Remark]:
    """What a payload says of readings that explain the same of bare motions.

    Args:
        logs: The logs.
        carrying: Which of them carry the payload.
        payload: Known with its centre, or nothing is said.
        same: The readings, beside the log as it is.
    """
    known = payload.known_part()
    if payload.known not in ("all", "com"):
        return []
    moving = [(each, moved_gains(logs.structure, logs.unknowns, each, known)) for each in same]
    moving = [(each, moved) for each, moved in moving if moved]
    if not moving:
        return []
    words = ", ".join(each.words for each, _ in moving)
    joints = ", ".join(str(j + 1) for j in sorted({j for _, moved in moving for j in moved}))
    matter = f"{words} would change the gains of joints {joints}"
    if not any(carrying) or all(carrying):
        return [Remark(topic=TOPIC, seen=f"{matter}; a bare and a loaded recording with this payload tell")]
    given = explained_with_payload(logs, carrying, known, as_it_is(logs.arm))
    (free,) = logs.explained((as_it_is(logs.arm),))
    excess = float(gain_over(given.left, free.left).sum())
    doubts = list[Remark]()
    for each, _ in moving:
        other = explained_with_payload(logs, carrying, known, each)
        gain = gain_over(given.column_left, other.column_left)
        if convincing(gain, evidence_of(gain, given.column_freedom, other.column_freedom), each):
            if gain.sum() < MOST_OF * excess:
                doubts.append(_not_as_drawn(each))
                continue
            return [
                Remark(
                    topic=TOPIC,
                    joint=int(np.argmax(gain)),
                    seen=f"{each.words} fits the payload's torque better (residuals smaller by "
                    f"{100.0 * (1.0 - float(np.exp(-gain.max()))):.3g} %), as another centre of the payload may",
                    grade=Grade.WRONG,
                    advice="mend the zero, or the payload's description",
                )
            ]
    return doubts[:1] or [Remark(topic=TOPIC, seen=f"{matter}; the payload's torque is no better explained so")]


def _not_as_drawn(other: Reading) -> Remark:
    """What a reading that is better, and not good, says of the payload."""
    return Remark(
        topic=TOPIC,
        seen=f"the payload's torque is not as described: {other.words} fits it better, but not well",
        grade=Grade.WEAK,
        advice="measure the payload's centre of mass; mind axes and units",
    )


def moved_gains(structure: Structure, unknowns: Unknowns, reading: Reading, known: KnownPayload) -> tuple[int, ...]:
    """Joints, from 0, whose gain depends on whether the log is read as it is or otherwise, by the kinematics.

    Args:
        structure: Of the arm.
        unknowns: What is solved for.
        reading: One that explains the same of bare motions.
        known: What is known of the payload.
    """
    arm = structure.arm
    rng = np.random.default_rng(PROBE_SEED)
    q, dq, ddq = rng.uniform(-np.pi, np.pi, (3, STATES * arm.n, arm.n))
    as_is = regressor(arm, q, dq, ddq)
    other = regressor_as_read(arm, reading, q, dq, ddq)
    moved: list[int] = []
    for joint in range(arm.n):
        mine = _torque_left(as_is[:, joint], structure, unknowns, joint, known)
        theirs = _torque_left(other[:, joint], structure, unknowns, joint, known)
        scale = max(float(np.linalg.norm(mine)), float(np.linalg.norm(theirs)))
        if scale > SAME and float(np.linalg.norm(mine - theirs)) > SAME * scale:
            moved.append(joint)
    return tuple(moved)


def _torque_left(own: Array, structure: Structure, unknowns: Unknowns, joint: int, known: KnownPayload) -> Array:
    """The payload's torque less what the arm's own columns, there in both motions, can be of it."""
    torque = own[:, structure.payload_columns[known.mask]] @ known.chi[known.mask]
    again = own[:, len(STANDARD) * joint + DRIFTING]
    half = np.arange(len(own)) % 2
    W = np.hstack((own[:, unknowns.arm[joint]], again * half[:, None]))
    Q = linalg.qr(W / np.linalg.norm(W, axis=0), mode="economic")[0]
    loaded = torque * half
    return readonly(loaded - Q @ (Q.T @ loaded))


def explained_with_payload(logs: Logs, loaded: Sequence[bool], known: KnownPayload, reading: Reading) -> Explanation:
    """What a reading explains of the currents, the payload as described.

    Args:
        logs: Bare and loaded.
        loaded: Which of them carry the payload.
        known: What is known of it; what is not is left out.
        reading: The reading.
    """
    columns = reading_columns(logs.arm, logs.seen, reading)
    motion = np.repeat(np.arange(len(logs.seen)), [len(each.v) for each in logs.seen])
    moving, v = _stacked(logs.seen)
    carries = np.array(loaded, dtype=np.float64)[motion]
    left, freedom = np.empty(logs.arm.n), np.empty(logs.arm.n, dtype=np.intp)
    for joint in range(logs.arm.n):
        kept = moving[:, reading.q_order[joint]] > 0.0
        own = columns[kept, joint]
        torque = own[:, logs.structure.payload_columns[known.mask]] @ known.chi[known.mask] * carries[kept]
        W = np.column_stack((own[:, logs.unknowns.arm[joint]], _again(own, joint, motion[kept]), torque))
        left[joint] = shares_left(W, v[kept][:, [reading.v_order[joint]]])[0]
        freedom[joint] = W.shape[0] - W.shape[1]
    return Explanation(reading, left, freedom)


def _again(own: Array, joint: int, motion: Indices) -> Array:
    drifting = own[:, len(STANDARD) * joint + DRIFTING]
    others = range(1, int(motion.max(initial=0)) + 1)
    return np.hstack([np.zeros((len(own), 0)), *(drifting * (motion == each)[:, None] for each in others)])


def _stacked(seen: Sequence[Instants]) -> tuple[Array, Array]:
    return np.vstack([each.moving for each in seen]).astype(np.float64), np.vstack([each.v for each in seen])
