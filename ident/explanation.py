"""How well some arm of given kinematics explains the currents of motions, whatever its parameters are.

Each joint is solved alone, with all its own base parameters, friction and offset of each motion, and all of a
payload's in every motion but the first. Nothing is known of the payload here, so that no gain, no error of the
payload's description and no drift of friction matters: what is left of the currents is noise, friction of another
shape, and a wrong arm. Rows are single instants.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from ident.arm import Arm
from ident.arrays import Array, Indices
from ident.base import independent_columns
from ident.instants import Instants
from ident.parameters import STANDARD
from ident.readings import Reading
from ident.regressor import regressor
from ident.structure import Structure, structure_of

DRIFTING = np.array([STANDARD.index(name) for name in ("Fv", "Fc", "off")])
"""What a joint may have anew in a later motion, among its own columns."""
ASLANT = np.array([3.6, -4.8, 8.0])
"""Gravity [m/s^2] along no axis: what no torque shows under it, none shows under any."""


@dataclass(frozen=True, slots=True, eq=False)
class Unknowns:
    """Columns of the standard regressor that are solved for on each joint.

    Attributes:
        arm: Of the arm itself, n index arrays.
        payload: Of a payload, n index arrays.
    """

    arm: tuple[Indices, ...]
    payload: tuple[Indices, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Explanation:
    """What a reading explains.

    Attributes:
        reading: The reading.
        left: Standard deviation of each joint's residual over its rms current, shape (n,); infinite where there are too
            few instants.
        freedom: Instants more than unknowns of each joint, shape (n,).
    """

    reading: Reading
    left: Array
    freedom: Indices

    @property
    def column_left(self) -> Array:
        """What is left of each column of currents instead of each joint's, shape (n,)."""
        return self.left[np.argsort(self.reading.v_order)]

    @property
    def column_freedom(self) -> Indices:
        """Instants more than unknowns of each column of currents instead of each joint, shape (n,)."""
        return self.freedom[np.argsort(self.reading.v_order)]


def unknowns_of(structure: Structure) -> Unknowns:
    """Base columns of each joint alone, and those of the payload that it can tell apart."""
    ten = np.arange(len(structure.payload_columns))
    return Unknowns(
        arm=tuple(structure.base.columns[chosen] for chosen in structure.joint_independent),
        payload=tuple(
            structure.payload_columns[independent_columns(probes, [ten])] for probes in structure.payload_probes
        ),
    )


def unknowns_under_any(structure: Structure) -> Unknowns:
    """As `unknowns_of`, under whatever gravity a reading has; weightless arms have none to turn."""
    if not structure.arm.gravity.any():
        return unknowns_of(structure)
    return unknowns_of(structure_of(replace(structure.arm, gravity=ASLANT)))


def explanations(
    arm: Arm, unknowns: Unknowns, motions: Sequence[Instants], same_states: Sequence[Reading]
) -> list[Explanation]:
    """What readings explain of the currents.

    Args:
        arm: The arm.
        unknowns: Of it under the readings' gravity.
        motions: The first one, with whatever it carries, and others, each of which may carry something else.
        same_states: Readings that differ in the order of the currents only.
    """
    columns = reading_columns(arm, motions, same_states[0])
    moving = np.vstack([each.moving for each in motions])[:, same_states[0].q_order]
    v = np.vstack([each.v for each in motions])
    motion = np.repeat(np.arange(len(motions)), [len(each.v) for each in motions])
    left, freedom = np.empty((arm.n, arm.n)), np.empty(arm.n, dtype=np.intp)
    for joint in range(arm.n):
        kept = moving[:, joint]
        W = joint_columns(columns[kept, joint], unknowns, joint, motion[kept])
        left[joint] = shares_left(W, v[kept])
        freedom[joint] = W.shape[0] - W.shape[1]
    each_joint = np.arange(arm.n)
    return [Explanation(each, left[each_joint, each.v_order], freedom) for each in same_states]


def joint_columns(own: Array, unknowns: Unknowns, joint: int, motion: Indices) -> Array:
    """What a joint's currents are explained by, (r, u).

    Args:
        own: The joint's rows of the standard regressor, shape (r, p).
        unknowns: Columns to take of it.
        joint: The joint, from 0.
        motion: Motion of each row, the first is 0, shape (r,).
    """
    again = own[:, np.concatenate((unknowns.payload[joint], len(STANDARD) * joint + DRIFTING))]
    others = range(1, int(motion.max(initial=0)) + 1)
    return np.hstack((own[:, unknowns.arm[joint]], *(again * (motion == each)[:, None] for each in others)))


def reading_columns(arm: Arm, motions: Sequence[Instants], reading: Reading) -> Array:
    """The standard regressor at the states that a reading makes of a log, motion after motion, shape (N, n, p)."""
    q, dq, ddq = (np.vstack(each) for each in zip(*((at.q, at.dq, at.ddq) for at in motions), strict=True))
    return regressor_as_read(arm, reading, q, dq, ddq)


def regressor_as_read(arm: Arm, reading: Reading, q: Array, dq: Array, ddq: Array) -> Array:
    """The standard regressor of the arm that a reading describes; states as the log has them, each of shape (N, n)."""
    stands = replace(arm, gravity=reading.gravity, translation=reading.stretch[:, None] * arm.translation)
    q, dq, ddq = (reading.factor * each[:, reading.q_order] for each in (q, dq, ddq))
    return regressor(stands, q + reading.zero, dq, ddq)


def shares_left(W: Array, V: Array) -> Array:
    """Standard deviation of what W leaves of each column of V, over the column's rms, shape (n,)."""
    rows, unknowns = W.shape
    if rows <= unknowns:
        return np.full(V.shape[1], np.inf)
    size = np.linalg.norm(W, axis=0)
    unit = W / np.where(size > 0.0, size, 1.0)
    R = linalg.qr(np.hstack((unit, V)), mode="r", check_finite=False)[0]  # its last rows are what V has besides W
    left = np.linalg.norm(R[unknowns:rows, unknowns:], axis=0)
    return left / np.linalg.norm(V, axis=0) * np.sqrt(rows / (rows - unknowns))
