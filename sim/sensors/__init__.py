"""Sensors: effects between the plant and its log.

A new one needs its class and, here, the first place among the base classes of `SensorOptions`: it then acts last, and
the others keep their random numbers.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ident.support.arrays import Array
from sim.sensors.readings import CurrentNoise, CurrentSensor, Delay, Encoder
from sim.sensors.sensor import Log, Noise, NoiseStreams, Sensor
from sim.sensors.timing import Clock, DriveClocks, LogRate, Samples


@dataclass(frozen=True, kw_only=True)
class SensorOptions(  # sensors act, and their keys are listed, from last to first
    Samples, DriveClocks, CurrentSensor, Clock, CurrentNoise, LogRate, Delay, Encoder
):
    """Values of all sensors, keys of `[experiment.sensors]`; zero switches a sensor effect off."""


SENSORS: Mapping[str, type[Sensor]] = {
    each.__name__: each for each in reversed(SensorOptions.__bases__) if issubclass(each, Sensor)
}
"""The sensors, in the order in which they act."""

STREAMS = tuple(name for sensor in SENSORS.values() for name in sensor.streams)
"""Names of all noise streams."""


def noise_streams(rng: np.random.Generator) -> NoiseStreams:
    """Return the streams of one generator: a child generator for every sensor that draws random numbers."""
    drawing = [sensor for sensor in SENSORS.values() if sensor.streams]
    children = zip(drawing, rng.spawn(len(drawing)), strict=True)
    return {name: child for sensor, child in children for name in sensor.streams}


def check_rate(options: SensorOptions, rate_hz: float) -> None:
    """Check that the values of sensors fit their sampling rate [Hz]; raises `PlantError` if one does not."""
    for sensor in SENSORS.values():
        sensor.fits(options, rate_hz)
        if sensor is LogRate:
            rate_hz = options.log_rate_hz or rate_hz  # later sensors act on the samples of the log


def logged(q: Array, v: Array, rate_hz: float, options: SensorOptions, streams: NoiseStreams | None) -> Log:
    """Return the log of readings and current references, (N, n), at a rate [Hz]; without streams nothing is random."""
    log = Log(t=np.arange(len(q)) / rate_hz, q=q, v=v, rate_hz=rate_hz)
    for sensor in SENSORS.values():
        if streams is not None or not sensor.streams:
            log = sensor.logs(options, log, streams or {})
    return log


def noises(log: Log, options: SensorOptions) -> list[Noise]:
    """Return the noise that sensors add to a log, to first order."""
    return [noise for sensor in SENSORS.values() for noise in sensor.noise(options, log)]


def without_spectrum(log: Log, options: SensorOptions) -> tuple[str, ...]:
    """Return names of the streams that change a log but have no first-order model in `noises`."""
    drawn = noise_streams(np.random.default_rng(0))  # any numbers: what is asked is whether there are some
    return tuple(
        name
        for sensor in SENSORS.values()
        if sensor.streams and sensor.noise is Sensor.noise and sensor.logs(options, log, drawn) is not log
        for name in sensor.streams
    )
