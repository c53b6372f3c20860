"""Faults of how positions are encoded: units, gears and encoders, shares of a range, signs and zeros of a convention.

These are large cases, as hypotheses on the logs. Ratios of gears are found in three steps: signs and one size are
screened on a grid, first-order steps give each joint its own ratio, and equal or whole ones replace ratios that predict
no better.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np

from ident.diagnosis.column_faults import TURNS, remedy
from ident.diagnosis.hypothesis import STILL, Alternative, Logs, beyond_limits, in_logs, scopes, small, within_limits
from ident.diagnosis.models import Reference
from ident.diagnosis.plausibility import friction_z
from ident.estimation.estimate import FRICTION_Z, largest
from ident.model.arm import Arm
from ident.recordings.description import line_of
from ident.support.arrays import Array
from ident.support.naming import enumerated

MOST_JOINTS = 8
"""Largest number of joints of which any may be negated together: all sets of these are compared."""


def conventions(logs: Logs) -> Iterator[Alternative]:
    """Signs and zeros of several joints by another convention in all logs: sets of signs, quarter turns of neighbours.

    Positions alone do not show whether the current is negated too: friction does, which brakes a joint.
    """
    arm = logs.structure.arm
    z = np.array([float(largest(friction_z(logs.problem, j))) for j in range(arm.n)])
    braked = np.where(np.abs(z) > FRICTION_Z, np.sign(z), 0.0)
    for factor in product((1.0, -1.0), repeat=arm.n if arm.n <= MOST_JOINTS else 0):
        if factor.count(-1.0) > 1:
            yield _convention(logs, np.array(factor), np.zeros(arm.n), braked)
    for j, turns, signs in product(range(arm.n - 1), product(TURNS[1:], repeat=2), product((1.0, -1.0), repeat=2)):
        if arm.revolute[j : j + 2].all():
            own, factor, turn = slice(j, j + 2), np.ones(arm.n), np.zeros(arm.n)
            factor[own], turn[own] = signs, (np.array(turns) + 180) % 360 - 180
            yield _convention(logs, factor, turn, braked)


def _convention(logs: Logs, factor: Array, turn: Array, braked: Array) -> Alternative:
    """Return joints at the positions `factor q + turn` [degrees], with the currents that friction then needs."""
    joints = np.flatnonzero((factor < 0.0) | (turn != 0.0)).tolist()
    v_factor = np.where((factor < 0.0) & (braked > 0.0), -1.0, 1.0)
    each = [f"{'-' if factor[j] < 0.0 else ''}q{j + 1}{f' {turn[j]:+g} degrees' if turn[j] else ''}" for j in joints]
    words = f"the positions of joints {enumerated([str(j + 1) for j in joints])} are {enumerated(each)}"
    advice = f"add {line_of('q.factor', factor)}" if (factor < 0.0).any() else "add"
    if (v_factor < 0.0).any():
        words += f", with {enumerated([f'v{j + 1}' for j in joints if v_factor[j] < 0.0])} negated"
        advice += f" {line_of('v.factor', v_factor)}"
    if turn.any():
        advice += f" {line_of('q.zero', turn / factor)} if logged in degrees"
    return Alternative(
        family="convention", words=words, joints=tuple(joints), logs=logs.every,
        hypothesis=logs.given.changed(logs.every, q_factor=factor, zero=np.deg2rad(turn), v_factor=v_factor),
        # the more columns are negated, currents included, the more it must explain:
        advice=advice, parameters=int(np.sum(factor < 0.0) + np.sum(factor * braked < 0.0) + np.sum(turn != 0.0)),
    )  # fmt: skip


ANGLES = {"degrees": np.pi / 180.0, "revolutions": 2.0 * np.pi, "milliradians": 1e-3}
LENGTHS = {"millimetres": 1e-3}
"""Factors from units of angle to radians, and from units of length to metres."""
MOST_RATIO = 500.0
"""Largest plausible ratio of a gear; a planetary stage has 3, a harmonic drive up to 320."""
COUNTS = 2.0 ** np.arange(8, 31) / (2.0 * np.pi)
"""Counts of encoders per radian."""
RATIOS = np.concatenate(
    (np.arange(2.0, MOST_RATIO), np.arange(7.0, MOST_RATIO) / (2.0 * np.pi), COUNTS, np.geomspace(MOST_RATIO, 2e8, 650))
)
"""Ratios of gears, also of motors logged in turns; counts of encoders per radian, and with gears, 2 % apart."""


def units(logs: Logs) -> Iterator[Alternative]:
    """Positions of all joints or of one in another unit, in all logs or one, if they are then within the limits."""
    arm = logs.structure.arm
    for kind, own in ((arm.revolute, ANGLES), (~arm.revolute.astype(bool), LENGTHS)):
        joints = np.flatnonzero(kind).tolist()
        together = [tuple(joints)] if len(joints) > 1 else []
        for (name, factor), which in product(own.items(), [*together, *((j,) for j in joints)]):
            for scope in scopes(len(logs.recordings)):
                yield from _reached(logs, in_unit(logs, scope, which, factor, f"in {name}"))
    turning = tuple(np.flatnonzero(arm.revolute).tolist())
    beyond = tuple(sorted({j for log in logs.recordings for j in beyond_limits(arm, log)} & {*turning}))
    # ratios of several joints are found only if they are equal
    for joints, sign in product({beyond, turning} if len(beyond) == 1 else {turning} if beyond else (), (1.0, -1.0)):
        least = min(float(np.ptp(log.q[:, j])) for log in logs.recordings for j in joints)
        for ratio in (sign * RATIOS[least / STILL >= RATIOS]).tolist():
            yield from _reached(logs, geared(logs, joints, np.full(len(joints), ratio)))
            if len(joints) > 1 and ratio in COUNTS:
                yield from _reached(logs, geared(logs, joints, np.full(len(joints), ratio), -np.pi))


SHARES, STEP = np.geomspace(0.15, 1.0, 9), 0.08
"""Share of their ranges that joints move through, and relative distance of common ratios, from which each joint's own
ratio is found by first-order steps."""


def own_gears(logs: Logs) -> Iterator[Alternative]:
    """Positions of the motors of gears that differ between the joints, of any signs, if some are beyond the limits."""
    arm = logs.structure.arm
    joints = tuple(np.flatnonzero(arm.revolute).tolist())
    moved = np.max([np.ptp(log.q, axis=0) for log in logs.recordings], axis=0)[list(joints)]
    limited = (
        _limited(arm) and 0 < len(joints) <= MOST_JOINTS and any(beyond_limits(arm, log) for log in logs.recordings)
    )
    if not limited or moved.min() < STILL:
        return
    alike = moved / (arm.upper - arm.lower)[list(joints)]
    least, most = np.log((float(alike.max()), float(moved.min()) / STILL))
    common = np.exp(np.arange(least, most, STEP))[:, None] * np.ones(len(joints))
    for ratios, signs in product((*(alike / SHARES[:, None]), *common), product((1.0, -1.0), repeat=len(joints))):
        yield from _reached(logs, geared(logs, joints, ratios * signs))


def _limited(arm: Arm) -> bool:
    return bool(np.isfinite(arm.upper - arm.lower).all() and (arm.upper > arm.lower).all())


def _reached(logs: Logs, found: Alternative) -> Iterator[Alternative]:
    """An alternative, if it moves all joints enough and within their limits."""
    arm, hows = logs.structure.arm, found.hypothesis.logs
    if all(within_limits(arm, logs.recordings[k], hows[k]) for k in found.logs):
        yield found


def normalised(logs: Logs) -> Iterator[Alternative]:
    """Positions of all joints as per cent of each one's range, -100 to 100 or 0 to 100, as logged or from degrees."""
    arm = logs.structure.arm
    if not _limited(arm):
        return
    half, middle = 0.5 * (arm.upper - arm.lower), 0.5 * (arm.upper + arm.lower)
    for (lowest, share), taken_for in product(((-100, 0.01), (0, 0.02)), ("degrees", "")):
        zero, unit = middle if lowest else arm.lower, share * half  # position at a logged 0, and of one per cent
        logged = np.where((taken_for != "") & arm.revolute.astype(bool), 180.0 / np.pi, 1.0)
        words = f"all positions are per cent of each joint's range, {lowest} to 100"
        words += f", taken for {taken_for}" if taken_for else ""
        found = Alternative(
            family="normalised", words=words, joints=(), logs=logs.every,
            hypothesis=logs.given.changed(logs.every, q_factor=unit * logged, zero=zero),
            advice=f"{remedy(logs, logs.every, 'q.factor', unit * logged)} {line_of('q.zero', zero / unit)}",
        )  # fmt: skip
        yield from _reached(logs, found)


def geared(logs: Logs, joints: tuple[int, ...], ratios: Array, zero: float = 0.0) -> Alternative:
    """Return positions of joints on the motor side of gears with these ratios, or as counts of an encoder.

    `zero` is the position at 0 [rad], as of counts that are half of a turn at the zero of the joint.
    """
    own, in_turns = np.unique(ratios), 2.0 * np.pi * ratios
    if np.abs(ratios).min() > MOST_RATIO:
        per_turn = in_turns[:1] if len(own) == 1 else in_turns
        words = f"in counts of an encoder, {', '.join(f'{each:.6g}' for each in per_turn)} per turn"
    else:
        several, each = "a gear of ratio" if len(own) == 1 else "gears of ratios", ratios if len(own) > 1 else own
        words = f"on the motor's side of {several} {', '.join(f'{ratio:.4g}' for ratio in each)}"
        if len(joints) > 1 and (len(own) == 1 or np.allclose(in_turns, np.rint(in_turns), rtol=1e-9)):
            words += f", or of {', '.join(f'{2.0 * np.pi * ratio:.4g}' for ratio in each)} in turns"
    found = in_unit(logs, logs.every, joints, 1.0 / ratios, words)
    if zero:
        at, logged = np.zeros((2, logs.structure.arm.n))
        at[list(joints)], logged[list(joints)] = zero, zero * ratios
        found = replace(
            found, words=f"{found.words}, {np.abs(logged).max():.6g} at zero",
            hypothesis=found.hypothesis.changed(logs.every, zero=at),
            advice=f"{found.advice} {line_of('q.zero', logged)}",
        )  # fmt: skip

    def refined(more: Array) -> Alternative:
        return geared(logs, joints, ratios * (1.0 + more), zero)

    def special(spread: Array) -> Iterator[Alternative]:
        return (geared(logs, joints, each, zero) for each in _special(ratios, spread))

    return replace(
        found, searched=True, parameter="ratio", parameters=len(joints), refined=refined, special=special,
        advice=f"{found.advice}, with the exact ratio{'' if len(own) == 1 else 's instead of these'}",
        value=float(own[0]) if len(own) == 1 else None,
    )  # fmt: skip


ALIKE, NEAR = 3.0, 2.0
"""Standard deviations within which ratios of joints are equal, and within which one of a fit is told as a whole one."""
NOT_BY_CHANCE = 0.25
"""Largest share of all ratios that are within these of one that is whole in turns."""


def _special(ratios: Array, spread: Array) -> Iterator[Array]:
    """Ratios that are all equal, and those that are within relative deviations; whole ones, as `_whole`."""
    size = np.abs(ratios)
    alike = np.abs(size[:, None] / size - 1.0) < ALIKE * np.hypot(spread[:, None], spread)
    for same in (np.ones_like(alike), alike):
        surest = np.argmin(np.where(same, spread, np.inf), axis=1)  # of those that each is equal to
        own = surest == surest[:, None]
        weight = own / spread**2
        yield np.copysign(_whole(weight @ size / weight.sum(axis=1), weight.sum(axis=1) ** -0.5), ratios)


def _whole(size: Array, spread: Array) -> Array:
    """Ratios that are whole, whole in turns, or counts of encoders, powers of two, within relative deviations."""
    near, turns = NEAR * size * spread, 2.0 * np.pi * size
    in_turns = (2.0 * np.pi * near < 0.5 * NOT_BY_CHANCE) & (np.abs(turns - np.rint(turns)) < 2.0 * np.pi * near)
    whole = np.where(in_turns, np.rint(turns) / (2.0 * np.pi), size)
    whole = np.where((np.abs(size - np.rint(size)) < near) & (size > 1.5), np.rint(size), whole)
    power = 2.0 ** np.rint(np.log2(turns))
    of_encoder = (size > MOST_RATIO) & (np.abs(turns / power - 1.0) < ALIKE * spread)
    return np.where(of_encoder, power / (2.0 * np.pi), whole)


LARGEST_RATIO = 0.25
"""Largest relative change of a ratio in one step."""


def own_ratios(reference: Reference, logs: Logs) -> Iterator[Alternative]:
    """Slightly different ratios of all joints, which refine a common one."""
    joints = tuple(np.flatnonzero(logs.structure.arm.revolute).tolist())
    columns = [each[:, joints] for each in reference.change(lambda along: along.turned((0,)))]
    yield small(geared(logs, joints, np.ones(len(joints))), columns, largest=LARGEST_RATIO)


def in_unit(
    logs: Logs, scope: tuple[int, ...], joints: tuple[int, ...], factor: float | Array, words: str
) -> Alternative:
    """Return positions of some joints times a factor, or one each."""
    arm, first, factors = logs.structure.arm, min(joints), np.ones(logs.structure.arm.n)
    factors[list(joints)] = factor
    every = len(joints) == int(np.sum(arm.revolute == arm.revolute[first])) and len(joints) > 1
    what = "all positions are" if every else f"q{first + 1} is"
    return Alternative(
        family="unit", words=in_logs(f"{what} {words}", scope, logs.names), joints=() if every else joints, logs=scope,
        hypothesis=logs.given.changed(scope, q_factor=factors), advice=remedy(logs, scope, "q.factor", factors),
    )  # fmt: skip
