"""Times of samples: a slower log, jitter of the stamps, clocks of the drives, lost and repeated samples."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np
from annotated_types import Interval, Unit

from sim.errors import PlantError
from sim.sensors.sensor import Log, Noise, NoiseStreams, Sensor

ROUNDING = 1e-6
"""Largest deviation of the log's period from a multiple of the controller's period, as a share of the former."""


@dataclass(frozen=True, kw_only=True)
class LogRate(Sensor):
    """Rate of a log that may be slower than the controller: every k-th sample is kept, without filtering.

    Attributes:
        log_rate_hz: Rate of the log [Hz], the controller's rate divided by a whole number; 0 for the controller's rate.
    """

    log_rate_hz: Annotated[float, Interval(ge=0.0, le=1e5), Unit("Hz")] = 0.0

    def fits(self, rate_hz: float) -> None:
        every = _every(self, rate_hz)
        if self.log_rate_hz and abs(every * self.log_rate_hz / rate_hz - 1.0) > ROUNDING:
            raise PlantError(
                f"sensors: log_rate_hz = {self.log_rate_hz:g} at {rate_hz:g} Hz: expected 0, or the controller's rate "
                "divided by a whole number"
            )

    def logs(self, log: Log, streams: NoiseStreams) -> Log:
        k = _every(self, log.rate_hz)
        return log if k == 1 else replace(log, t=log.t[::k], q=log.q[::k], v=log.v[::k], rate_hz=log.rate_hz / k)


def _every(values: LogRate, rate_hz: float) -> int:
    """Return the number of controller periods per period of the log."""
    return max(1, round(rate_hz / values.log_rate_hz)) if values.log_rate_hz else 1


@dataclass(frozen=True, kw_only=True)
class Clock(Sensor):
    """Jitter of time stamps; the samples themselves are taken on time.

    Attributes:
        clock_jitter: Standard deviation of the uniformly distributed error of a time stamp [s]; at most a quarter of
            the period, so that time increases. The samples themselves are taken on time.
    """

    streams: ClassVar[tuple[str, ...]] = ("clock",)
    clock_jitter: Annotated[float, Interval(ge=0.0, le=10.0), Unit("s")] = 0.0

    def fits(self, rate_hz: float) -> None:
        if self.clock_jitter > 0.25 / rate_hz:
            raise PlantError(
                f"sensors: clock_jitter = {self.clock_jitter:g} s at {rate_hz:g} Hz: expected a quarter of the period, "
                f"{0.25 / rate_hz:g} s, at most"
            )

    def logs(self, log: Log, streams: NoiseStreams) -> Log:
        if not self.clock_jitter:
            return log
        even = streams["clock"].uniform(-np.sqrt(3.0), np.sqrt(3.0), len(log.t))  # of unit deviation
        return replace(log, t=log.t + self.clock_jitter * even)

    def noise(self, log: Log) -> Sequence[Noise]:
        """The equivalent position error: minus speed times the error of the stamp, equal for all joints."""
        if not self.clock_jitter:
            return []
        q, v = (-self.clock_jitter * np.gradient(x, 1.0 / log.rate_hz, axis=0) for x in (log.q, log.v))
        return [Noise(stream="clock", q=q, v=v, shared=True)]


@dataclass(frozen=True, kw_only=True)
class DriveClocks(Sensor):
    """Drives with separate clocks: samples of joint j are stamped t but taken at `(1 + r_j) t + o_j`.

    r and o are drawn for each motion and joint. Position and current of one drive are sampled together. Values between
    samples of the loop are linearly interpolated, and held at the ends.
    """

    streams: ClassVar[tuple[str, ...]] = ("drive_clocks",)
    clock_offset: Annotated[float, Interval(ge=0.0, le=1.0), Unit("s")] = 0.0  # standard deviation of o [s]
    clock_rate: Annotated[float, Interval(ge=0.0, le=0.01)] = 0.0  # standard deviation of r

    def logs(self, log: Log, streams: NoiseStreams) -> Log:
        if not (self.clock_offset or self.clock_rate):
            return log
        rate, offset = streams["drive_clocks"].standard_normal((2, log.v.shape[1]))
        even = np.arange(len(log.v)) / log.rate_hz
        taken = np.outer(even, 1.0 + self.clock_rate * rate) + self.clock_offset * offset  # (N, n)
        q, v = (
            np.stack([np.interp(at, even, column) for at, column in zip(taken.T, columns.T, strict=True)], axis=1)
            for columns in (log.q, log.v)
        )
        return replace(log, q=q, v=v)


@dataclass(frozen=True, kw_only=True)
class Samples(Sensor):
    """Lost and repeated samples, except the first and the last.

    A lost sample is not in the log. A repeated sample has its own time, but the positions and currents of the last
    sample that is not a repetition.
    """

    streams: ClassVar[tuple[str, ...]] = ("samples",)
    samples_lost: Annotated[float, Interval(ge=0.0, le=0.5)] = 0.0  # share of lost samples
    samples_repeated: Annotated[float, Interval(ge=0.0, le=0.5)] = 0.0  # share of samples that repeat the preceding one

    def logs(self, log: Log, streams: NoiseStreams) -> Log:
        if not (self.samples_lost or self.samples_repeated):
            return log
        lost, repeated = streams["samples"].random((2, len(log.t))) < [[self.samples_lost], [self.samples_repeated]]
        lost[[0, -1]] = repeated[[0, -1]] = False
        source = np.maximum.accumulate(np.where(repeated, 0, np.arange(len(log.t))))  # the last that is its own
        return replace(log, t=log.t[~lost], q=log.q[source][~lost], v=log.v[source][~lost])
