"""Faults of the columns of logs: zeros, signs, delays, order, clocks and scales.

Each kind has large cases, as hypotheses on the logs, or small ones, as columns of currents, or both.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations, product

import numpy as np

from ident.diagnosis.diagnosis import two_digits
from ident.diagnosis.hypothesis import (
    Alternative,
    Logs,
    in_logs,
    names_apart,
    scopes,
    small,
)
from ident.diagnosis.models import LARGEST_ANGLE, Reference
from ident.model.displacement import Dynamics
from ident.recordings.description import line_of
from ident.support.arrays import Array, Indices

TURNS = (0, 90, 180, 270)
"""Differences of zeros between conventions [degrees]; others are found from the nearest one."""


def zeros(logs: Logs) -> Iterator[Alternative]:
    """Each joint negated, offset by quarter turns, or both; a prismatic joint is only negated."""
    arm, every = logs.structure.arm, scopes(len(logs.recordings))
    for j, (turn, sign), scope in product(range(arm.n), product(TURNS, (1.0, -1.0)), every):
        if (turn or sign < 0.0) and (arm.revolute[j] or not turn):
            yield turned(logs, j, scope, sign, np.deg2rad(turn))
    for j, scope in product(range(arm.n), every[1:]):  # in all logs: a negated position and a negative gain
        own, q = np.where(np.arange(arm.n) == j, -1.0, 1.0), f"q{j + 1} and v{j + 1}"
        yield Alternative(
            family="joint reversed", words=in_logs(f"{q} are negated", scope, logs.names), joints=(j,), logs=scope,
            hypothesis=logs.given.changed(scope, q_factor=own, v_factor=own),
            advice=f"{remedy(logs, scope, 'q.factor', own)} {line_of('v.factor', own)}",
        )  # fmt: skip


def remedy(logs: Logs, scope: Sequence[int], key: str, values: Array) -> str:
    """What to do about some logs: the line of a description that corrects them."""
    if len(scope) == len(logs.names):
        return f"add {line_of(key, values)}"
    short = names_apart(logs.names)
    return f"rx90 convert {' and '.join(short[k] for k in scope)} with {line_of(key, values)}"


def small_zeros(reference: Reference, logs: Logs) -> Iterator[Alternative]:
    """A small error of each joint's zero."""
    arm = logs.structure.arm
    moved = reference.change(lambda along: -along.by(Dynamics.misplaced)[:, :, : arm.n])
    for scope, k in product(scopes(len(logs.recordings)), range(arm.n)):
        yield small(
            turned(logs, k, scope, 1.0, 0.0), reference.within([each[:, k : k + 1] for each in moved], scope),
            scale=180.0 / np.pi if arm.revolute[k] else 1e3, largest=LARGEST_ANGLE,
        )  # fmt: skip


def turned(logs: Logs, joint: int, scope: tuple[int, ...], sign: float, zero: float) -> Alternative:
    """Return a joint with the position `sign q + zero` in some logs."""
    own, revolute = np.arange(logs.structure.arm.n) == joint, bool(logs.structure.arm.revolute[joint])
    size = float(np.rad2deg((zero + np.pi) % (2.0 * np.pi) - np.pi)) if revolute else 1e3 * zero
    size_text, q = f"{abs(size):.3g} {'degrees' if revolute else 'mm'}", f"q{joint + 1}"
    off = abs(size) > 1e-9
    # the fault of the log is the inverse of the correction
    words, corrected = f"the zero of {q} is off by {size_text}", q
    if sign < 0.0:
        words, corrected = f"{q} is negated" + (f" and its zero off by {size_text}" if off else ""), f"-{q}"
    if off:
        corrected += f" {'plus' if size > 0.0 else 'minus'} {size_text}"
    factor = np.where(own, sign, 1.0)
    advice = f"use {corrected}" if off else remedy(logs, scope, "q.factor", factor)
    return Alternative(
        family="sign" if sign < 0.0 else "zero", parameter="zero", words=in_logs(words, scope, logs.names),
        joints=(joint,), logs=scope,
        hypothesis=logs.given.changed(scope, q_factor=factor, zero=np.where(own, zero, 0.0)),
        advice=f"{advice}, or correct the model", value=size, unit="degrees" if revolute else "mm",
        refined=lambda more: turned(logs, joint, scope, sign, zero + float(more[0])),
    )  # fmt: skip


LARGEST_DELAY = 0.03
"""Largest delay for which the first order is valid [s]."""


def delays(reference: Reference, logs: Logs) -> Iterator[Alternative]:
    """Currents with a small delay: of all joints together, of each alone, and in one log different for each joint."""
    n, every = logs.structure.arm.n, tuple(range(logs.structure.arm.n))
    together = [-each for each in reference.change(reference.rate)]
    each_own = [each * (np.arange(n) == j) for j, each in enumerate(together)]
    for scope in scopes(len(logs.recordings)):
        # in all logs, different delays would imitate backlash and presliding friction
        apart = (every,) if n > 1 and len(scope) < len(logs.recordings) else ()
        for joints in ((), *((j,) for j in range(n)), *apart):
            yield small(
                late(logs, scope, joints, np.zeros(max(1, len(joints)))),
                reference.within(each_own if len(joints) > 1 else together, scope, joints or None),
                scale=1e3, largest=LARGEST_DELAY,
            )  # fmt: skip


def late(logs: Logs, scope: tuple[int, ...], joints: tuple[int, ...], delay: Array) -> Alternative:
    """Return currents logged late by a delay per joint, or one for all (no joints) [s], shape (1,) or (joints,)."""
    of_joints = np.zeros(logs.structure.arm.n)
    of_joints[list(joints) if joints else slice(None)] = delay
    first = float(delay[0])
    if len(delay) > 1:
        each = ", ".join(f"{1e3 * own + 0.0:.1f} (v{j + 1})" for j, own in zip(joints, delay, strict=True))
        words = f"the currents lag the positions by different delays: {each} ms"
    else:
        what = f"v{joints[0] + 1} is" if joints else "the currents are"
        words = f"{what} logged {1e3 * abs(first):.2g} ms {'later' if first > 0.0 else 'earlier'} than the positions"
        if first > 0.0:
            words += f" (or smoothed by a filter of {two_digits(1.0 / (2.0 * np.pi * first))} Hz)"
    common = not joints and len(scope) == len(logs.recordings)
    return Alternative(
        family="delay", words=in_logs(words, scope, logs.names), joints=joints, logs=scope,
        hypothesis=logs.given.changed(scope, delay=of_joints),
        advice="log both with one clock, unfiltered" + (", or give --current-delay auto" if common else ""),
        value=1e3 * first if len(delay) == 1 else None, unit="ms", parameters=len(delay),
        refined=lambda more: late(logs, scope, joints, delay + more),
    )  # fmt: skip


def orders(logs: Logs) -> Iterator[Alternative]:
    """Exchanges of positions, currents or both of two joints, in all logs or one; other orders in all logs."""
    arm, (every, *each) = logs.structure.arm, scopes(len(logs.recordings))
    usual = np.arange(arm.n)
    for i, j in combinations(range(arm.n), 2):
        order = usual.copy()
        order[[i, j]] = j, i
        for scope in (every, *each):
            yield _ordered(logs, scope, order, f"joints {i + 1} and {j + 1} are exchanged", "qv", (i, j))
            for kind in "qv":
                words = f"columns {kind}{i + 1} and {kind}{j + 1} are exchanged"
                yield _ordered(logs, scope, order, words, kind, (i, j))
    by_name, known = sorted(range(arm.n), key=lambda j: arm.joint_names[j]), {tuple(usual.tolist())}
    for words, order in (
        ("in alphabetical order of the joints' names", np.argsort(by_name)),  # column of joint j
        ("in reverse order", usual[::-1]),
        ("shifted by one place, the first joint last", np.roll(usual, 1)),
        ("shifted by one place, the last joint first", np.roll(usual, -1)),
    ):
        if tuple(order.tolist()) not in known and int(np.sum(order != usual)) > 2:
            known.add(tuple(order.tolist()))
            for what, kinds in (("columns q", "q"), ("columns v", "v"), ("the joints", "qv")):
                yield _ordered(logs, every, order, f"{what} are {words}", kinds, ())


def _ordered(
    logs: Logs, scope: tuple[int, ...], order: Indices, words: str, kinds: str, joints: tuple[int, ...]
) -> Alternative:
    return Alternative(
        family="order", words=in_logs(words, scope, logs.names), joints=joints, logs=scope,
        hypothesis=logs.given.changed(scope, **{f"{kind}_order": order for kind in kinds}),
        advice="put the columns in the order of the model's joints",
    )  # fmt: skip


def couplings(logs: Logs) -> Iterator[Alternative]:
    """A position that includes that of a neighbour in all logs, as controllers tell an elbow against the horizontal."""
    n = logs.structure.arm.n
    for j, beside, share in product(range(n), (-1, 1), (1.0, -1.0)):
        if 0 <= (i := j + beside) < n:
            mixing = np.zeros((n, n))
            mixing[j, i] = -share
            sign, remedy = ("plus", "-") if share > 0.0 else ("minus", "")
            yield Alternative(
                family="coupling", words=f"q{j + 1} is the position of joint {j + 1} {sign} that of joint {i + 1}",
                joints=(j,), logs=logs.every, hypothesis=logs.given.changed(logs.every, q_mixing=mixing),
                advice=f"add --state 'q.coupling = [[{j + 1}, {remedy}{i + 1}]]'",
            )  # fmt: skip


FACTORS_OF_TIME, LARGEST_CLOCK = 2.0 ** np.setdiff1d(np.arange(-6.0, 7.0), 0.0), 0.2
"""Powers of two, others are found by first-order steps, and largest relative change for which these are valid."""


def clocks(logs: Logs) -> Iterator[Alternative]:
    """Clocks that run up to sixty times as fast or slow, and those that make the sampling rates of two logs equal."""
    rates = [1.0 / each.period for each in logs.recordings]
    for scope in scopes(len(rates)):
        factors = {*FACTORS_OF_TIME.tolist()}
        if len(scope) == 1 and len(rates) > 1:
            factors |= {round(rates[scope[0]] / other, 6) for k, other in enumerate(rates) if k not in scope}
        found = (timed(logs, scope, factor) for factor in sorted(factors) if abs(factor - 1.0) > 0.01)
        yield from (replace(each, searched=True) for each in found)


def small_clocks(reference: Reference, logs: Logs) -> Iterator[Alternative]:
    """Clocks that run slightly slower."""
    slower = reference.change(lambda along: along.slowed_down())
    for scope in scopes(len(logs.recordings)):
        columns = reference.within(slower, scope)
        yield small(timed(logs, scope, 1.0), columns, scale=100.0, largest=LARGEST_CLOCK)


def timed(logs: Logs, scope: tuple[int, ...], factor: float) -> Alternative:
    """Return logs with time multiplied by a factor."""
    words = f"the clock is wrong: t must be multiplied by {factor:.4g}"
    line = remedy(logs, scope, "t.factor", np.array([factor]))
    return Alternative(
        family="clock", words=in_logs(words, scope, logs.names), joints=(), logs=scope,
        hypothesis=logs.given.changed(scope, clock=factor),
        advice=f"log the controller's own time, in seconds, or {line}, with the exact factor",
        value=100.0 * (factor - 1.0), unit="%",
        refined=lambda more: timed(logs, scope, factor * float(np.exp(more[0]))),
    )  # fmt: skip


SIGN = "current sign"
"""Family of negated currents of one log."""
SCALES = np.concatenate([sign * np.geomspace(1e-4, 1e4, 97) for sign in (1.0, -1.0)])
"""Grid of scales, in steps of a fifth; every twelfth one is a power of ten."""
NATURAL = (*(10.0**k for k in range(-6, 7) if k), *(2.0**k for k in (-0.5, 0.5)))
"""Scales by another unit, or by peaks instead of rms."""
SCALE_STD = 0.05
"""Difference from these that friction, which differs between logs, may cause in a scale found without a payload."""
LARGEST_SCALE = 0.3
"""Largest relative change for which the first order is valid."""


def scales(logs: Logs) -> Iterator[Alternative]:
    """For every later log, each current and all together, with the scale on the grid that has the smallest residual."""
    n = logs.structure.arm.n
    for k in _later(logs):
        squares = np.array([scale_losses(logs, j, k) for j in range(n)])  # (n, scales)
        for joints, cost in (((), squares.sum(axis=0)), *(((j,), squares[j]) for j in range(n))):
            scale = float(SCALES[int(np.argmin(cost))])
            power = float(np.log10(abs(scale)))  # whole for a unit
            if abs(scale - 1.0) > LARGEST_SCALE:
                yield replace(scaled(logs, (k,), joints, scale), searched=abs(power - round(power)) >= 1e-9)
        yield from (scaled(logs, (k,), (j,), -1.0) for j in range(n))


def small_scales(reference: Reference, logs: Logs) -> Iterator[Alternative]:
    """Currents of one log that are slightly larger, all of them or one: the columns are the fitted currents."""
    for k, joints in product(_later(logs), ((), *((j,) for j in range(logs.structure.arm.n)))):
        columns = reference.within(reference.explained, (k,), joints or None)
        found = scaled(logs, (k,), joints, 1.0)  # in a linear model the factor is exactly 1 + x
        found = found.of_size(1.0, "", lambda x, k=k, own=joints: scaled(logs, (k,), own, 1.0 + float(x[0])))
        yield small(found, columns, largest=LARGEST_SCALE)


def scaled(logs: Logs, scope: tuple[int, ...], joints: tuple[int, ...], scale: float) -> Alternative:
    """Return currents of a log with a factor relative to the unit of the others."""
    own = np.isin(np.arange(logs.structure.arm.n), joints) | (not joints)
    factor = np.where(own, 1.0 / scale, 1.0)
    what = f"v{joints[0] + 1} is" if joints else "all currents are"
    words = f"{what} negated" if scale == -1.0 else f"{what} scaled by {scale:.4g}"
    natural, exact = min(NATURAL, key=lambda each: abs(np.log(abs(scale) / each))), ""
    if abs(np.log(abs(scale) / natural)) > SCALE_STD:
        natural = abs(scale)
    elif abs(scale) != natural:
        exact = f"; {1.0 / scale:.4g} fits best"
    advice = "record with equally warm drives and one unit of the current, or bare, loaded, loaded, bare"
    if abs(scale - 1.0) > LARGEST_SCALE:  # more than magnets weaken, by 0.1 to 0.2 % per K
        line = remedy(logs, scope, "v.factor", np.where(own, np.sign(scale) / natural, 1.0))
        advice = f"use one unit and one sign of the current in all logs: {line}{exact}"
    return Alternative(
        family=SIGN if scale < 0.0 else "current scale", parameter="current scale",
        words=in_logs(words, scope, logs.names), joints=joints, logs=scope,
        hypothesis=logs.given.changed(scope, v_factor=factor), advice=advice, value=scale, unit="",
        refined=lambda more: scaled(logs, scope, joints, scale * float(np.exp(more[0]))),
    )  # fmt: skip


def _later(logs: Logs) -> range:
    """Logs whose currents may have another scale than the others': of two the second, of one none."""
    count = len(logs.recordings)
    return range(0 if count > 2 else 1, count)


def scale_losses(logs: Logs, joint: int, k: int) -> Array:
    """Loss of log-likelihood of a joint's currents by each of `SCALES` of log k, with its own variance for log k.

    The other logs have a common variance: in one sum of squares the part with larger units would dominate.
    """
    held = logs.fits.parts[joint]
    if held is None:
        return np.zeros(len(SCALES))
    own = (logs.rows[joint].motion == k).astype(np.float64)
    V, share = held.V, float(own.mean())
    other, mine = held.without(V * (1.0 - own)), held.without(V * own)
    a, b = other * (1.0 - own), mine * (1.0 - own)  # rows of the other logs: a + b / s
    c, d = other * own, mine * own  # rows of log k: s c + d in its own unit
    losses = np.zeros(len(SCALES))
    for weight, rows, squares in (
        (1.0 - share, V * (1.0 - own), a @ a + 2.0 * (a @ b) / SCALES + (b @ b) / SCALES**2),
        (share, V * own, SCALES**2 * (c @ c) + 2.0 * SCALES * (c @ d) + d @ d),
    ):
        losses += weight * np.log(np.maximum(squares, max(1e-20 * float(rows @ rows), 1e-300)))  # rounding errors
    return 0.5 * held.freedom * losses
