"""Faults of the arm's description: its transmission, the orientation of its base, its lengths.

Each kind has large cases, as hypotheses on the arm, or small ones, as columns of currents, or both.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from ident.diagnosis.hypothesis import STILL, Alternative, Hypothesis, Logs, small
from ident.diagnosis.models import LARGEST_ANGLE, Reference
from ident.model.displacement import Dynamics, across
from ident.recordings.description import line_of
from ident.support.arrays import Array
from ident.support.naming import enumerated

TURNING = (
    ((1.0, 0.0), (1.0, 1.0)),
    ((1.0, 0.0), (-1.0, 1.0)),
    ((1.0, 1.0), (0.0, 1.0)),
    ((1.0, -1.0), (0.0, 1.0)),
    *(((share, sign * share), (share, -sign * share)) for share in (1.0, 0.5) for sign in (1.0, -1.0)),
)
"""Motions of the motors of two neighbouring joints by these: a parallelogram or a wrist, from either side, and both
differentials, with the sum of the joints' angles or half of it."""


def transmissions(logs: Logs) -> Iterator[Alternative]:
    """Two neighbouring motors of which one or both turn by the sum or difference of both joints.

    The logged positions are those of the motors too, or still those of the joints.
    """
    arm = logs.structure.arm
    pairs = range(arm.n - 1) if arm.transmission is None and not arm.couplings else ()
    for j, own in product(pairs, TURNING):
        A = np.eye(arm.n)
        A[j : j + 2, j : j + 2] = own
        if arm.revolute[j] == arm.revolute[j + 1]:
            turns = enumerated([f"motor {j + k + 1} turns by {_sum(row, j)}" for k, row in enumerate(own) if all(row)])
            advice = f"state {_stated(A)} in the robot.toml (rx90 new-robot writes one)"
            yield _turned(logs, A, f"{turns}, and q and v are those of the motors", (j, j + 1), advice)
            mixing = A - np.eye(arm.n)
            if np.count_nonzero(mixing) == 1:
                ((motor, joint),) = np.argwhere(mixing).tolist()
                coupling = f"coupling = [[{motor + 1}, {round(mixing[motor, joint]) * (joint + 1)}]]"
                advice += f" and {coupling} in [q] of a log description"
                read = logs.given.changed(logs.every, q_mixing=mixing)
                yield _turned(logs, A, f"{turns}, and v alone is that of the motors", (j, j + 1), advice, read)


def misstated_transmissions(logs: Logs) -> Iterator[Alternative]:
    """No motor turns with the joints of others, or each against them, although the robot's description states it."""
    A = logs.structure.arm.transmission
    if A is None:
        return
    own = np.diag(np.diag(A))
    joints = tuple(np.flatnonzero((own != A).any(axis=0) | (own != A).any(axis=1)).tolist())
    for other, words in ((own, "each motor turns one joint alone"), (2.0 * own - A, "motors turn the other way")):
        if joints and np.linalg.matrix_rank(other) == len(A):
            advice = f"state {_stated(other) if (other != np.eye(len(A))).any() else 'none'}"
            yield _turned(logs, other, f"{words}, against the stated transmission", joints, f"{advice} in robot.toml")


def small_ratios(reference: Reference, logs: Logs) -> Iterator[Alternative]:
    """A motor that also turns by a small share of a neighbouring joint's angle, or has a slightly different ratio."""
    arm = logs.structure.arm
    if arm.couplings:  # which a matrix cannot have beside it
        return
    neighbours = (-1, 0, 1)
    moved = [np.hsplit(each, 3) for each in reference.change(lambda along: along.turned(neighbours))]
    for number, beside in enumerate(neighbours):
        for j in range(max(0, -beside), arm.n - max(0, beside)):
            if arm.revolute[j] == arm.revolute[j + beside]:
                reach = max(float(np.abs(log.q[:, j + beside]).max()) for log in logs.recordings)
                columns = [each[number][:, j : j + 1] for each in moved]
                largest = LARGEST_ANGLE / max(reach, STILL)
                yield small(shared(logs, j, j + beside, 0.0), columns, scale=100.0, largest=largest)


def shared(logs: Logs, motor: int, joint: int, share: float) -> Alternative:
    """Return a motor that also turns by a share of the angle of a joint, from 0, which the model does not state."""
    A, added = logs.structure.arm.transmission, np.eye(logs.structure.arm.n)
    added[motor, joint] += share
    A = added if A is None else added @ A
    words = f"motor {motor + 1} also turns by {share:.3g} times the angle of joint {joint + 1}"
    if motor == joint:
        words = f"motor {motor + 1} turns by {1.0 + share:.4g} times the stated angle"
    remedy = f"state {_stated(A, 4)} in robot.toml"
    if motor == joint and logs.structure.arm.transmission is None:
        remedy = f"add {line_of('q.factor', 1.0 / np.diag(A))}"
    advice = f"measure it, and {remedy}"
    found = replace(_turned(logs, A, words, (motor,) if motor == joint else (motor, joint), advice), family="ratio")
    step = 1.0 + share if motor == joint else 1.0
    return found.of_size(100.0 * share, "%", lambda more: shared(logs, motor, joint, share + step * float(more[0])))


def _turned(
    logs: Logs, A: Array, words: str, joints: tuple[int, ...], advice: str, read: Hypothesis | None = None
) -> Alternative:
    return Alternative(
        family="transmission", words=words, joints=joints, logs=logs.every,
        hypothesis=replace(read or logs.given, transmission=A), advice=advice,
    )  # fmt: skip


def _stated(A: Array, digits: int = 6) -> str:
    """A matrix as a `robot.toml` states it."""
    rows = (", ".join(f"{each:.{digits}g}" for each in row) for row in A)
    return f"transmission = [{', '.join(f'[{row}]' for row in rows)}]"


def _sum(row: Sequence[float], j: int) -> str:
    """Sum of the positions of a joint, from 0, and the next one, with signs, in words."""
    first, second = (j + 1, j + 2) if row[0] > 0.0 else (j + 2, j + 1)
    half = "half of " if abs(row[0]) < 1.0 and row[1] else ""
    return f"{half}joint {first} {'plus' if row[0] == row[1] else 'minus'} joint {second}"


SAME = 1e-6
"""Difference of unit vectors below which directions of gravity are equal."""


def bases(logs: Logs) -> Iterator[Alternative]:
    """Gravity along the axes of the base frame and halfway between them: a base on a wall, on a ceiling or tilted."""
    arm = logs.structure.arm
    size = float(np.linalg.norm(arm.gravity))
    for corner in product((0.0, 1.0, -1.0), repeat=3) if size else ():
        gravity = np.array(corner) * size / (float(np.linalg.norm(corner)) or 1.0)
        if any(corner) and np.abs(gravity - arm.gravity).max() > SAME * size:
            where = ", ".join(f"{x:g}" for x in corner)
            words = f"the base is oriented differently: gravity points along ({where}) of its frame"
            yield _standing(logs, gravity, words)


def small_tilts(reference: Reference, logs: Logs) -> Iterator[Alternative]:
    """The base tilted slightly about two horizontal axes."""
    if logs.structure.arm.gravity.any():
        columns = reference.change(lambda along: -along.by(Dynamics.tilted))
        yield small(tilted(logs, np.zeros(2)), columns, scale=180.0 / np.pi, largest=LARGEST_ANGLE)


def tilted(logs: Logs, turn: Array) -> Alternative:
    """Return the base rotated about two horizontal axes by angles [rad], shape (2,)."""
    gravity = logs.structure.arm.gravity
    axes, angle = across(logs.structure.arm), float(np.linalg.norm(turn))
    axis = axes.T @ turn / angle if angle > 0.0 else axes[0]
    c, s = np.cos(angle), np.sin(angle)  # Rodrigues
    rotated = c * gravity + s * np.cross(axis, gravity) + (1.0 - c) * float(axis @ gravity) * axis
    degrees, about = float(np.rad2deg(angle)), ", ".join(f"{x:.2g}" for x in axis + 0.0)
    found = _standing(logs, rotated, f"the base is tilted by {degrees:.2g} degrees about ({about})")
    return found.of_size(degrees, "degrees", lambda more: tilted(logs, turn + more))


def _standing(logs: Logs, gravity: Array, words: str) -> Alternative:
    return Alternative(
        family="base", words=words, joints=(), logs=logs.every, hypothesis=replace(logs.given, gravity=gravity),
        advice="correct the orientation of the base in the model (gravity in its frame)",
    )  # fmt: skip


def compensated(logs: Logs) -> Iterator[Alternative]:
    """Links and payload without weight: the controller has subtracted the gravity torque."""
    if logs.structure.arm.gravity.any():
        yield Alternative(
            family="gravity compensation",
            words="v is gravity-compensated: it lacks the weight of links and payload",
            joints=(), logs=logs.every, hypothesis=replace(logs.given, gravity=np.zeros(3)),
            advice="log the motor current, or the whole commanded torque",
        )  # fmt: skip


FACTORS_OF_LENGTH, LARGEST_LENGTH = (0.8, 1.25), 0.2
"""Tested factors, others are found by first-order steps, and largest relative change for which these are valid."""


def lengths(logs: Logs) -> Iterator[Alternative]:
    """Every length, or one between two joints, a fifth shorter or a quarter longer."""
    return (lengthened(logs, which, factor) for factor in FACTORS_OF_LENGTH for which in _lengths_of(logs))


def small_lengths(reference: Reference, logs: Logs) -> Iterator[Alternative]:
    """Every length, or one, slightly longer."""
    longer = reference.change(lambda along: along.by(Dynamics.lengthened))
    for which in _lengths_of(logs):
        own = slice(None) if which is None else slice(which, which + 1)
        columns = [each[:, own].sum(axis=1, keepdims=True) for each in longer]
        yield small(lengthened(logs, which, 1.0), columns, scale=100.0, largest=LARGEST_LENGTH)


def lengthened(logs: Logs, which: int | None, factor: float) -> Alternative:
    """Return every length, or that before a joint, from 0, times a factor."""
    n = logs.structure.arm.n
    what, joints, those = "all lengths are", (), "those"
    if which is not None:
        what, joints, those = f"the length from joint {which} to {which + 1} is", (which,), "that"
    factors = np.where((np.arange(n) == which) | (which is None), factor, 1.0)
    return Alternative(
        family="lengths", words=f"{what} {factor:.3g} times {those} of the model", joints=joints, logs=logs.every,
        hypothesis=replace(logs.given, length_factors=factors),
        advice="use the model of this arm; check units and the variant of the arm",
        value=100.0 * (factor - 1.0), unit="%",
        refined=lambda more: lengthened(logs, which, factor * float(np.exp(more[0]))),
    )  # fmt: skip


def _lengths_of(logs: Logs) -> list[int | None]:
    """All, and each that is not zero, without that before the first joint, which has no effect."""
    long = np.flatnonzero(logs.structure.arm.translation.any(axis=1)).tolist()
    return [None, *(j for j in long if j > 0)] if long else []
