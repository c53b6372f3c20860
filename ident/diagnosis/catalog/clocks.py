"""Clocks with a wrong rate, of all logs or of one."""

from collections.abc import Iterator

import numpy as np

from ident.diagnosis.alternative import Alternative, Direction, in_logs, in_rows, scopes
from ident.diagnosis.fitted_currents import Reference
from ident.diagnosis.logs import Logs

FACTORS = (0.5, 2.0)
"""Tested factors: half or twice the sampling rate of the stamps; others are found by first-order steps."""
LARGEST = 0.2
"""Largest relative change for which the first order is valid."""


def alternatives(logs: Logs) -> Iterator[Alternative]:
    """Clocks that run twice or half as fast, and those that make the sampling rates of two logs equal."""
    rates = [1.0 / each.period for each in logs.recordings]
    for scope in scopes(len(rates)):
        factors = set(FACTORS)
        if len(scope) == 1 and len(rates) > 1:
            factors |= {round(rates[scope[0]] / other, 6) for k, other in enumerate(rates) if k not in scope}
        for factor in sorted(factors):
            if abs(factor - 1.0) > 0.01:
                yield timed(logs, scope, factor)


def directions(reference: Reference, logs: Logs) -> Iterator[Direction]:
    """Clocks that run slightly slower."""
    parts = [motion.rows(motion.hurried()[..., None]) for motion in reference.motions]
    for scope in scopes(len(parts)):
        yield Direction(
            family="clock", joints=(), logs=scope, columns=in_rows(parts, scope),
            alternative=lambda value, scope=scope: timed(logs, scope, 1.0 + float(value[0])),
            unit="%", scale=100.0, largest=LARGEST,
        )  # fmt: skip


def timed(logs: Logs, scope: tuple[int, ...], factor: float) -> Alternative:
    """Return logs with time multiplied by a factor."""
    return Alternative(
        family="clock",
        words=in_logs(f"the clock is wrong: t must be multiplied by {factor:.4g}", scope, logs.names),
        joints=(),
        logs=scope,
        hypothesis=logs.given.changed(scope, clock=factor),
        advice="log the controller's own time, in seconds",
        value=100.0 * (factor - 1.0),
        unit="%",
        refined=lambda more: timed(logs, scope, factor * float(np.exp(more[0]))),
    )
