"""Seconds that are not seconds: the clock of all logs, or of one, runs at another rate."""

from collections.abc import Iterator

import numpy as np

from ident.diagnosis.alternative import Alternative, Direction, in_logs, in_rows, scopes
from ident.diagnosis.fitted_currents import Reference
from ident.diagnosis.logs import Logs

FACTORS = (0.5, 2.0)
"""That are tried: samples logged half or twice as often as the stamps say; others are found from the derivative."""
LARGEST = 0.2
"""Relative change up to which the derivative says its size."""


def alternatives(logs: Logs) -> Iterator[Alternative]:
    """Clocks that run twice or half as fast, and those that make the rates of two logs equal."""
    rates = [1.0 / each.period for each in logs.recordings]
    for scope in scopes(len(rates)):
        factors = set(FACTORS)
        if len(scope) == 1 and len(rates) > 1:
            factors |= {round(rates[scope[0]] / other, 6) for k, other in enumerate(rates) if k not in scope}
        for factor in sorted(factors):
            if abs(factor - 1.0) > 0.01:
                yield timed(logs, scope, factor)


def directions(reference: Reference, logs: Logs) -> Iterator[Direction]:
    """Clocks that run a little slower."""
    parts = [motion.rows(motion.hurried()[..., None]) for motion in reference.motions]
    for scope in scopes(len(parts)):
        yield Direction(
            family="clock", joints=(), logs=scope, columns=in_rows(parts, scope),
            alternative=lambda value, scope=scope: timed(logs, scope, 1.0 + float(value[0])),
            unit="%", scale=100.0, largest=LARGEST,
        )  # fmt: skip


def timed(logs: Logs, scope: tuple[int, ...], factor: float) -> Alternative:
    """Logs whose seconds are a factor of those that they say."""
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
