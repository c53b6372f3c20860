"""Currents that are logged later than positions, or smoothed, which is late as well."""

from collections.abc import Iterator

import numpy as np

from ident.arrays import Array
from ident.diagnosis.alternative import Alternative, Direction, in_logs, in_rows, scopes, two_digits
from ident.diagnosis.logs import Logs
from ident.diagnosis.reading import as_logged
from ident.diagnosis.reference import Reference

LARGEST = 0.03
"""Delay up to which the rate of the currents says its size [s]."""
ADVICE = "log both with one clock, unfiltered"


def alternatives(logs: Logs) -> Iterator[Alternative]:
    """None: what is long is found from what is short, step by step."""
    return iter(())


def directions(reference: Reference, logs: Logs) -> Iterator[Direction]:
    """Currents a little late: of all joints together, and of each alone."""
    n = logs.structure.arm.n
    parts = [[-each for each in motion.rows(motion.rate()[..., None])] for motion in reference.motions]
    for scope in scopes(len(parts)):
        for joints in ((), *((j,) for j in range(n))):

            def alternative(
                value: Array, scope: tuple[int, ...] = scope, joints: tuple[int, ...] = joints
            ) -> Alternative:
                return late(logs, scope, joints, float(value[0]))

            yield Direction(
                family="delay", joints=joints, logs=scope, columns=in_rows(parts, scope, joints or None),
                alternative=alternative, unit="ms", scale=1e3, largest=LARGEST,
            )  # fmt: skip


def late(logs: Logs, scope: tuple[int, ...], joints: tuple[int, ...], delay: float) -> Alternative:
    """Currents of some joints, of all if none is named, that are logged late by a time [s]."""
    n = logs.structure.arm.n
    given = as_logged(logs.structure.arm, len(logs.recordings))
    what = "the currents are" if not joints else f"v{joints[0] + 1} is"
    way = "later" if delay > 0.0 else "earlier"
    smoothed = f" (or smoothed by a filter of {two_digits(abs(1.0 / (2.0 * np.pi * delay)))} Hz)" if delay > 0.0 else ""
    return Alternative(
        family="delay",
        words=in_logs(f"{what} logged {1e3 * abs(delay):.2g} ms {way} than the positions{smoothed}", scope, logs.names),
        joints=joints,
        logs=scope,
        reading=given.changed(scope, delay=np.where(np.isin(np.arange(n), joints) | (not joints), delay, 0.0)),
        advice=ADVICE if joints or len(scope) < len(logs.recordings) else f"{ADVICE}, or give --current-delay auto",
        value=1e3 * delay,
        unit="ms",
        refined=lambda more: late(logs, scope, joints, delay + float(more[0])),
    )
