"""Currents that are logged later than positions, or smoothed, which also delays them."""

from collections.abc import Iterator

import numpy as np

from ident.diagnosis.alternative import Alternative, Direction, in_logs, in_rows, scopes, two_digits
from ident.diagnosis.fitted_currents import Reference
from ident.diagnosis.logs import Logs
from ident.support.arrays import Array

LARGEST = 0.03
"""Largest delay for which the first order is valid [s]."""
ADVICE = "log both with one clock, unfiltered"


def alternatives(logs: Logs) -> Iterator[Alternative]:
    """None: long delays are found by first-order steps."""
    return iter(())


def directions(reference: Reference, logs: Logs) -> Iterator[Direction]:
    """Currents with a small delay: of all joints together, of each alone, and in one log different for each joint.

    In all logs, different delays would imitate backlash and presliding friction.
    """
    n = logs.structure.arm.n
    parts = [[-each for each in motion.rows(motion.rate()[..., None])] for motion in reference.motions]
    each_own = [[each * (np.arange(n) == j) for j, each in enumerate(part)] for part in parts]
    every = tuple(range(n))
    for scope in scopes(len(parts)):
        apart = (every,) if n > 1 and len(scope) < len(parts) else ()
        for joints in ((), *((j,) for j in range(n)), *apart):
            yield Direction(
                family="delay", joints=joints, logs=scope,
                columns=in_rows(each_own if len(joints) > 1 else parts, scope, joints or None),
                alternative=lambda value, scope=scope, joints=joints: late(logs, scope, joints, value),
                unit="ms", scale=1e3, largest=LARGEST,
            )  # fmt: skip


def late(logs: Logs, scope: tuple[int, ...], joints: tuple[int, ...], delays: Array) -> Alternative:
    """Return currents that are logged late.

    Args:
        logs: The observed logs.
        scope: Logs concerned, from 0.
        joints: Joints concerned, from 0; empty for all together.
        delays: One delay per joint, or one for all together [s], shape (1,) or (joints,).
    """
    of_joints = np.zeros(logs.structure.arm.n)
    of_joints[list(joints) if joints else slice(None)] = delays
    return Alternative(
        family="delay",
        words=in_logs(_delays_message(joints, delays), scope, logs.names),
        joints=joints,
        logs=scope,
        hypothesis=logs.given.changed(scope, delay=of_joints),
        advice=ADVICE if joints or len(scope) < len(logs.recordings) else f"{ADVICE}, or give --current-delay auto",
        value=1e3 * float(delays[0]) if len(delays) == 1 else None,
        unit="ms",
        parameters=len(delays),
        refined=lambda more: late(logs, scope, joints, delays + more),
    )


def _delays_message(joints: tuple[int, ...], delays: Array) -> str:
    if len(delays) > 1:
        each = ", ".join(f"{1e3 * delay + 0.0:.1f} (v{j + 1})" for j, delay in zip(joints, delays, strict=True))
        return f"the currents lag the positions by different delays: {each} ms"
    delay = float(delays[0])
    what = "the currents are" if not joints else f"v{joints[0] + 1} is"
    way = "later" if delay > 0.0 else "earlier"
    smoothed = f" (or smoothed by a filter of {two_digits(abs(1.0 / (2.0 * np.pi * delay)))} Hz)" if delay > 0.0 else ""
    return f"{what} logged {1e3 * abs(delay):.2g} ms {way} than the positions{smoothed}"
