"""A joint whose positions have another zero, the opposite sign, or both."""

from collections.abc import Iterator
from itertools import product

import numpy as np

from ident.diagnosis.alternative import Alternative, Direction, in_logs, in_rows, scopes
from ident.diagnosis.fitted_currents import Reference
from ident.diagnosis.logs import Logs

TURNS = (0, 90, 180, 270)
"""Differences of zeros between conventions [degrees]; others are found from the nearest one."""
LARGEST = np.deg2rad(15.0)
"""Largest error of a zero for which the first order is valid [rad]."""


def alternatives(logs: Logs) -> Iterator[Alternative]:
    """Each joint negated, offset by quarter turns, or both; a prismatic joint is only negated."""
    arm = logs.structure.arm
    for j, (turn, sign) in product(range(arm.n), product(TURNS, (1.0, -1.0))):
        if (turn or sign < 0.0) and (arm.revolute[j] or not turn):
            for scope in scopes(len(logs.recordings)):
                yield turned(logs, j, scope, sign, np.deg2rad(turn))
    if len(logs.recordings) > 1:  # in all logs: a negated position and a negative gain
        yield from (reversed_joint(logs, j, (k,)) for j in range(arm.n) for k in range(len(logs.recordings)))


def directions(reference: Reference, logs: Logs) -> Iterator[Direction]:
    """A small error of each joint's zero."""
    arm = logs.structure.arm
    parts = [motion.rows(motion.displaced()) for motion in reference.motions]
    for scope, k in product(scopes(len(logs.recordings)), range(arm.n)):
        yield Direction(
            family="zero",
            joints=(k,),
            logs=scope,
            columns=in_rows([[each[:, k : k + 1] for each in part] for part in parts], scope),
            alternative=lambda value, k=k, scope=scope: turned(logs, k, scope, 1.0, float(value[0])),
            unit="degrees" if arm.revolute[k] else "mm",
            scale=180.0 / np.pi if arm.revolute[k] else 1e3,
            largest=LARGEST,
        )


def turned(logs: Logs, joint: int, scope: tuple[int, ...], sign: float, zero: float) -> Alternative:
    """Return a joint with the position `sign q + zero` in some logs."""
    arm = logs.structure.arm
    own = np.arange(arm.n) == joint
    revolute = bool(arm.revolute[joint])
    size = float(np.rad2deg((zero + np.pi) % (2.0 * np.pi) - np.pi)) if revolute else 1e3 * zero
    size_text = f"{abs(size):.3g} {'degrees' if revolute else 'mm'}"
    way = "plus" if size > 0.0 else "minus"
    # the fault of the log is the inverse of the correction
    if sign < 0.0:
        words = f"q{joint + 1} is negated" + (f" and its zero off by {size_text}" if abs(size) > 1e-9 else "")
    else:
        words = f"the zero of q{joint + 1} is off by {size_text}"
    mended = (f"-q{joint + 1}" if sign < 0.0 else f"q{joint + 1}") + (f" {way} {size_text}" if abs(size) > 1e-9 else "")
    return Alternative(
        family="sign" if sign < 0.0 else "zero",
        words=in_logs(words, scope, logs.names),
        joints=(joint,),
        logs=scope,
        hypothesis=logs.given.changed(scope, q_factor=np.where(own, sign, 1.0), zero=np.where(own, zero, 0.0)),
        advice=f"use {mended}, or correct the model",
        value=size,
        unit="degrees" if revolute else "mm",
        refined=lambda more: turned(logs, joint, scope, sign, zero + float(more[0])),
    )


def reversed_joint(logs: Logs, joint: int, scope: tuple[int, ...]) -> Alternative:
    """Return a joint whose position and current both have the opposite sign in some logs."""
    own = np.where(np.arange(logs.structure.arm.n) == joint, -1.0, 1.0)
    return Alternative(
        family="joint reversed",
        words=in_logs(f"q{joint + 1} and v{joint + 1} are negated", scope, logs.names),
        joints=(joint,),
        logs=scope,
        hypothesis=logs.given.changed(scope, q_factor=own, v_factor=own),
        advice=f"negate q{joint + 1} and v{joint + 1} in these logs",
    )
