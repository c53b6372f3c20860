"""Whether the log as it is does as badly as it would if another reading of it were true.

A reading may explain currents better for no merit of its own: under backlash, elastic joints or an encoder coarser than
the accelerations, other lengths make columns that imitate a little of what every reading leaves. With y a joint's
currents, e what the other reading leaves of them, and M the residual maker of the log as it is,

    d = M (y - e)

is what the log as it is would miss if the other reading were true, and d' e / (s |d|) has a deviation of 1 at most, s
that of e: what a true reading leaves has nothing of it. What a false one leaves has.
"""

from collections.abc import Sequence

import numpy as np

from ident.arm import Arm
from ident.arrays import Array
from ident.explanation import Unknowns, joint_columns, reading_columns
from ident.instants import Instants
from ident.readings import Reading, as_it_is

CLEAR = 1.0
"""Sum of logarithms from which a reading needs no proof: real residuals are not white, and show it where d is large."""
SQUARE = 3.0
"""Mean square of the deviations of all joints up to which a reading is borne out; right ones have 1.

Beyond it are 1 in 300 right readings of six joints, if what they leave is white.
"""


def borne_out(arm: Arm, unknowns: tuple[Unknowns, Unknowns], motions: Sequence[Instants], reading: Reading) -> bool:
    """Whether what a reading of all logs leaves has nothing of what the log as it is would miss.

    Args:
        arm: The arm.
        unknowns: Of it as it is, and under the reading's gravity.
        motions: Of each log.
        reading: The reading.
    """
    columns = reading_columns(arm, motions, as_it_is(arm)), reading_columns(arm, motions, reading)
    return mean_square(arm, unknowns, motions, columns, reading) < SQUARE


def mean_square(
    arm: Arm,
    unknowns: tuple[Unknowns, Unknowns],
    motions: Sequence[Instants],
    columns: tuple[Array, Array],
    reading: Reading,
) -> float:
    """Mean square over the currents of the deviations to which what a reading leaves has what the log as it is misses.

    Args:
        arm: The arm.
        unknowns: Of it as it is, and under the reading's gravity.
        motions: Of each log.
        columns: The standard regressor of all instants as the log is and as it is read, each of shape (N, n, p).
        reading: The reading, by which currents and positions are ordered.
    """
    v = np.vstack([each.v for each in motions])
    moving = np.vstack([each.moving for each in motions])
    motion = np.repeat(np.arange(len(motions)), [len(each.v) for each in motions])
    squares: list[float] = []
    for joint, column in enumerate(reading.v_order):
        kept = moving[:, column] & moving[:, reading.q_order[joint]]
        own = joint_columns(columns[0][kept, column], unknowns[0], int(column), motion[kept])
        other = joint_columns(columns[1][kept, joint], unknowns[1], joint, motion[kept])
        if min(own.shape[0] - own.shape[1], other.shape[0] - other.shape[1]) > 0:
            squares.append(_deviation(own, other, v[kept, column]) ** 2)
    return float(np.mean(squares)) if squares else 0.0


def _deviation(own: Array, other: Array, v: Array) -> float:
    """Deviations to which what other columns (r, u) leave has what own ones would miss if the others were true."""
    Q0, Q1 = _orthonormal(own), _orthonormal(other)
    e = v - Q1 @ (Q1.T @ v)
    d = v - e - Q0 @ (Q0.T @ (v - e))
    scale = np.linalg.norm(e) / np.sqrt(len(v) - other.shape[1]) * np.linalg.norm(d)
    return float(d @ e / scale) if scale > 0.0 else 0.0


def _orthonormal(W: Array) -> Array:
    """Of a matrix's columns, shape (r, u)."""
    size = np.linalg.norm(W, axis=0)
    return np.linalg.qr(W / np.where(size > 0.0, size, 1.0))[0]
