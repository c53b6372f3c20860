"""What one log of several may mean instead of what it says: a joint's sign or zero that is right in the others.

The arm's own parameters are one set for all logs (`ident.explanation`), so that positions or currents that one log
alone counts otherwise leave more of all currents than the right reading of that log. Nothing is looked for unless a
set of its own for each log explains the currents better: under the right reading it has nothing to add.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations, product
from typing import TypeVar

import numpy as np
from scipy import optimize

from ident.arm import Arm
from ident.arrays import Array
from ident.column_space import column_space
from ident.evidence import NOTHING, gain_over
from ident.explanation import Explanation, Unknowns, joint_columns, reading_columns, shares_left
from ident.instants import Instants, thinned
from ident.parameters import STANDARD
from ident.rates import DIFFERENT, hertz_of
from ident.readings import Reading, as_it_is
from ident.recording import Recording

APART = 0.03
"""Sum of logarithms by which sets of their own must explain logs better for their readings to be looked at."""
LOOKS_BETTER = 0.02
"""Sum of logarithms by which a reading must be better on few instants to be looked at again."""
SMALL = 2.0
"""Zero [degrees] that is not worth a word beside a sign."""
BRAKES = np.array([STANDARD.index(name) for name in ("Fv", "Fc")])
"""Friction among a joint's own columns."""
FEW = 100
"""Instants of each motion that zeros are searched on."""
GRID = np.arange(0.0, 360.0, 15.0)
"""Zeros that are tried [degrees]; the best is refined."""

T = TypeVar("T")


def one_log_explanations(
    arm: Arm, unknowns: Unknowns, motions: Sequence[Instants], recordings: Sequence[Recording], given: Explanation
) -> list[Explanation]:
    """What readings explain that differ from the log as it is in one log; none where the logs agree about the arm.

    Args:
        arm: The arm.
        unknowns: Of it.
        motions: The first one, with whatever it carries, and others, each of which may carry something else.
        recordings: Their logs, at least two.
        given: What the logs as they are explain, on the same instants.
    """
    if agree(arm, unknowns, motions, as_it_is(arm)):
        return []
    names = [each.name for each in recordings]
    own = [reading_columns(arm, [each], as_it_is(arm)) for each in motions]
    found = [_backward(arm, unknowns, motions, own, names, given, joint) for joint in range(arm.n)]
    few = [thinned(each, FEW) for each in motions]
    own_few = [reading_columns(arm, [each], as_it_is(arm)) for each in few]
    given_few = _explained(arm, unknowns, few, own_few, as_it_is(arm))
    found += _exchanged(arm, unknowns, motions, own, names)
    found += _clocks(arm, unknowns, motions, recordings)
    for k, joint, sign in product(range(len(motions)), range(arm.n), (1.0, -1.0)):
        reading = _best_zero(arm, unknowns, few, own_few, (k, joint, sign), names[k])
        again = _explained(arm, unknowns, few, _with(arm, few, own_few, k, reading), reading)
        if gain_over(given_few.left, again.left).sum() > LOOKS_BETTER:
            found.append(_explained(arm, unknowns, motions, _with(arm, motions, own, k, reading), reading))
    return found


def _exchanged(
    arm: Arm, unknowns: Unknowns, motions: Sequence[Instants], own: Sequence[Array], names: Sequence[str]
) -> list[Explanation]:
    """Columns of two joints exchanged in one motion, of positions, currents or both."""
    found = list[Explanation]()
    for k, (i, j) in product(range(len(motions)), combinations(range(arm.n), 2)):
        order = np.arange(arm.n)
        order[[i, j]] = j, i
        each, tail = motions[k], f"{j + 1} exchanged in {names[k]} alone"
        moved = Instants(each.q[:, order], each.dq[:, order], each.ddq[:, order], each.v, each.moving[:, order])
        columns = _replaced(own, k, reading_columns(arm, [moved], as_it_is(arm)))
        for words, at, logs in (
            (f"columns v{i + 1} and v{tail}", own, replace(each, v=each.v[:, order])),
            (f"columns q{i + 1} and q{tail}", columns, moved),
            (f"joints {i + 1} and {tail}", columns, replace(moved, v=each.v[:, order])),
        ):
            reading = replace(as_it_is(arm), words=words)
            found.append(_explained(arm, unknowns, _replaced(motions, k, logs), at, reading))
    return found


def _clocks(
    arm: Arm, unknowns: Unknowns, motions: Sequence[Instants], recordings: Sequence[Recording]
) -> list[Explanation]:
    """The clock of one motion that counts otherwise, so that it was sampled at the rate of another.

    No other factor is tried: a coarse encoder makes some factor fit better on any log.
    """
    found = list[Explanation]()
    for k, one in enumerate(recordings):
        c = hertz_of(one) / hertz_of(recordings[1 if k == 0 else 0])
        if abs(c - 1.0) > DIFFERENT:
            timed = _replaced(motions, k, _timed(motions[k], c))
            columns = [reading_columns(arm, [each], as_it_is(arm)) for each in timed]
            reading = replace(as_it_is(arm), words=f"t times {c:.3g} in {one.name} alone")
            found.append(_explained(arm, unknowns, timed, columns, reading))
    return found


def _timed(each: Instants, c: float) -> Instants:
    """Instants of a motion whose seconds count c times."""
    return replace(each, dq=each.dq / c, ddq=each.ddq / c**2)


def agree(arm: Arm, unknowns: Unknowns, motions: Sequence[Instants], reading: Reading) -> bool:
    """Whether logs agree about the arm under a reading of all of them: sets of their own explain hardly more.

    Args:
        arm: The arm.
        unknowns: Of it under the reading's gravity.
        motions: Of each log.
        reading: How all logs are read.
    """
    columns = [reading_columns(arm, [each], reading) for each in motions]
    read = [replace(each, v=each.v[:, reading.v_order], moving=each.moving[:, reading.q_order]) for each in motions]
    together, apart = (_explained(arm, unknowns, read, columns, reading, apart=each) for each in (False, True))
    return bool(gain_over(together.left, apart.left).sum() < APART)


def _best_zero(
    arm: Arm,
    unknowns: Unknowns,
    motions: Sequence[Instants],
    own: Sequence[Array],
    which: tuple[int, int, float],
    name: str,
) -> Reading:
    """The zero of a joint in one motion that explains the currents best; which: motion, joint, sign of the joint."""
    k, joint, sign = which

    def left(zero: float) -> float:
        reading = _turned(arm, joint, sign, zero, name)
        found = _explained(arm, unknowns, motions, _with(arm, motions, own, k, reading), reading).left
        return float(np.log(np.maximum(found, NOTHING)).sum())

    if not arm.revolute[joint]:
        return _turned(arm, joint, sign, 0.0, name)
    best = float(GRID[int(np.argmin([left(float(zero)) for zero in GRID]))])
    step = float(GRID[1])
    near = optimize.minimize_scalar(
        left, bounds=(best - step, best + step), method="bounded", options={"xatol": 0.1, "maxiter": 12}
    )
    return _turned(arm, joint, sign, float(near.x), name)


def _turned(arm: Arm, joint: int, sign: float, zero: float, name: str) -> Reading:
    """A joint's positions with another sign and zero [degrees]."""
    own = np.arange(arm.n) == joint
    turn = (zero + 180.0) % 360.0 - 180.0
    words = f"q{joint + 1}" + (" negated" if sign < 0.0 else "")
    if sign > 0.0 or abs(turn) > SMALL:
        words += f" {'plus' if turn >= 0.0 else 'minus'} {abs(turn):.3g} degrees"
    return replace(
        as_it_is(arm),
        words=f"{words} in {name} alone",
        factor=np.where(own, sign, 1.0),
        zero=np.where(own, np.deg2rad(zero), 0.0),
    )


def _replaced(given: Sequence[T], k: int, other: T) -> list[T]:
    return [other if m == k else each for m, each in enumerate(given)]


def _with(arm: Arm, motions: Sequence[Instants], own: Sequence[Array], k: int, reading: Reading) -> list[Array]:
    """Columns of each motion, that of one of them as a reading has it."""
    return _replaced(own, k, reading_columns(arm, [motions[k]], reading))


def _explained(
    arm: Arm,
    unknowns: Unknowns,
    motions: Sequence[Instants],
    columns: Sequence[Array],
    reading: Reading,
    *,
    apart: bool = False,
) -> Explanation:
    """What columns of each motion, (N, n, p), explain together; or apart, each with its own set of parameters."""
    left, freedom = np.empty(arm.n), np.empty(arm.n, dtype=np.intp)
    for joint in range(arm.n):
        W, v = _joint(unknowns, motions, columns, joint, apart=apart)
        left[joint], freedom[joint] = shares_left(W, v[:, None])[0], W.shape[0] - W.shape[1]
    return Explanation(reading, left, freedom)


def _backward(
    arm: Arm,
    unknowns: Unknowns,
    motions: Sequence[Instants],
    own: Sequence[Array],
    names: Sequence[str],
    given: Explanation,
    joint: int,
) -> Explanation:
    """A joint's currents of the first motion negated; which of the logs it is, only friction tells."""
    W, v = _joint(unknowns, motions, own, joint)
    first = int(motions[0].moving[:, joint].sum())
    left = given.left.copy()
    left[joint] = shares_left(W, np.where(np.arange(len(v)) < first, -v, v)[:, None])[0]
    drives = [name for k, name in enumerate(names) if _friction(unknowns, own[k], motions[k], joint) < 0.0]
    words = f"v{joint + 1} negated in {drives[0] if len(drives) == 1 else 'one of the logs'} alone"
    return Explanation(replace(as_it_is(arm), words=words), left, given.freedom)


def _friction(unknowns: Unknowns, own: Array, motion: Instants, joint: int) -> float:
    """Friction of a joint at usual speed in one motion [drive units], whatever is mounted: more of its links."""
    chosen, kept = unknowns.arm[joint], motion.moving[:, joint]
    W = own[kept, joint][:, chosen]
    size = np.linalg.norm(W, axis=0)
    found = np.linalg.lstsq(W / np.where(size > 0.0, size, 1.0), motion.v[kept, joint], rcond=1e-9)[0]
    return float(found[np.isin(chosen, len(STANDARD) * joint + BRAKES)].sum())


def _joint(
    unknowns: Unknowns, motions: Sequence[Instants], columns: Sequence[Array], joint: int, *, apart: bool = False
) -> tuple[Array, Array]:
    """What explains a joint's currents, (r, u), and those, (r,)."""
    kept = [each.moving[:, joint] for each in motions]
    motion = np.repeat(np.arange(len(motions)), [int(each.sum()) for each in kept])
    own = np.vstack([each[rows, joint] for each, rows in zip(columns, kept, strict=True)])
    v = np.concatenate([each.v[rows, joint] for each, rows in zip(motions, kept, strict=True)])
    W = joint_columns(own, unknowns, joint, motion)
    if apart:
        arm = own[:, unknowns.arm[joint]]
        known = column_space(W)
        W = np.hstack((W, *(column_space(arm * (motion == k)[:, None], known) for k in range(1, len(motions)))))
    return W, v
