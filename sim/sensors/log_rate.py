"""A log that is slower than the controller: every k-th sample is kept, without filtering."""

from dataclasses import dataclass, replace
from typing import Annotated

from annotated_types import Interval, Unit

from sim.errors import SensorError
from sim.sensors.effect import Log, NoiseStreams, SensorEffect, Values

ROUNDING = 1e-6
"""Largest deviation of the log's period from a multiple of the controller's period, as a share of the former."""


@dataclass(frozen=True, kw_only=True)
class LogRate(Values):
    """Rate of the log.

    Attributes:
        log_rate_hz: Rate of the log [Hz], the controller's rate divided by a whole number; 0 for the controller's rate.
    """

    log_rate_hz: Annotated[float, Interval(ge=0.0, le=1e5), Unit("Hz")] = 0.0


def _every(values: LogRate, rate_hz: float) -> int:
    """Return the number of controller periods per period of the log."""
    return max(1, round(rate_hz / values.log_rate_hz)) if values.log_rate_hz else 1


def _fits(values: LogRate, rate_hz: float) -> None:
    if values.log_rate_hz and abs(_every(values, rate_hz) * values.log_rate_hz / rate_hz - 1.0) > ROUNDING:
        raise SensorError(
            f"sensors: log_rate_hz = {values.log_rate_hz:g} at {rate_hz:g} Hz: expected 0, or the controller's rate "
            "divided by a whole number"
        )


def _thinned(values: LogRate, log: Log, streams: NoiseStreams) -> Log:
    k = _every(values, log.rate_hz)
    return log if k == 1 else replace(log, t=log.t[::k], q=log.q[::k], v=log.v[::k], rate_hz=log.rate_hz / k)


EFFECT = SensorEffect[LogRate](fits=_fits, logs=_thinned)
