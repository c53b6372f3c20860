"""Sensors: effects between the plant and its log, one file each.

A new one needs a file and, here, a base class of `SensorOptions` and an entry of `SENSOR_EFFECTS`, at the end, so that
the others keep their random numbers.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ident.support.arrays import Array
from sim.sensors import clock, current, current_sensor, delay, drive_clocks, encoder, log_rate, samples
from sim.sensors.effect import Log, Noise, NoiseStreams, SensorEffect, no_noise


@dataclass(frozen=True, kw_only=True)
class SensorOptions(
    log_rate.LogRate,  # the order of keys is from last to first
    samples.Samples,
    drive_clocks.DriveClocks,
    current_sensor.CurrentSensor,
    clock.Clock,
    delay.Delay,
    current.CurrentNoise,
    encoder.Encoder,
):
    """Values of all sensors, keys of `[experiment.sensors]`; zero switches a sensor effect off."""


SENSOR_EFFECTS: Mapping[str, SensorEffect[SensorOptions]] = {
    "encoder": encoder.EFFECT,
    "delay": delay.EFFECT,
    "log_rate": log_rate.EFFECT,
    "current": current.EFFECT,
    "clock": clock.EFFECT,
    "current_sensor": current_sensor.EFFECT,
    "drive_clocks": drive_clocks.EFFECT,
    "samples": samples.EFFECT,
}
"""The effects, in the order in which they act."""

STREAMS = tuple(name for effect in SENSOR_EFFECTS.values() for name in effect.streams)
"""Names of all noise streams."""


def noise_streams(rng: np.random.Generator) -> NoiseStreams:
    """Return the streams of one generator: a child generator for every sensor that draws random numbers."""
    drawing = [effect for effect in SENSOR_EFFECTS.values() if effect.streams]
    children = zip(drawing, rng.spawn(len(drawing)), strict=True)
    return NoiseStreams({name: child for effect, child in children for name in effect.streams})


def check_rate(options: SensorOptions, rate_hz: float) -> None:
    """Check that the values of sensors fit their sampling rate.

    Raises:
        SensorError: If one does not.
    """
    for effect in SENSOR_EFFECTS.values():
        effect.fits(options, rate_hz)
        if effect is log_rate.EFFECT:
            rate_hz = options.log_rate_hz or rate_hz  # later sensors act on the samples of the log


def logged(q: Array, v: Array, rate_hz: float, options: SensorOptions, streams: NoiseStreams) -> Log:
    """Return the log of a motion.

    Args:
        q: Readings of the encoders [rad], shape (N, n).
        v: Current references [drive units], shape (N, n).
        rate_hz: Their rate [Hz].
        options: Values of the sensors.
        streams: Sources of the noise.
    """
    log = Log(t=np.arange(len(q)) / rate_hz, q=q, v=v, rate_hz=rate_hz)
    for effect in SENSOR_EFFECTS.values():
        log = effect.logs(options, log, streams)
    return log


def logged_without_noise(q: Array, v: Array, rate_hz: float, options: SensorOptions) -> Log:
    """Return the log of a motion without random effects; arguments as `logged`."""
    log, silent = Log(t=np.arange(len(q)) / rate_hz, q=q, v=v, rate_hz=rate_hz), NoiseStreams({})
    for effect in SENSOR_EFFECTS.values():
        if not effect.streams:
            log = effect.logs(options, log, silent)
    return log


def noises(log: Log, options: SensorOptions) -> list[Noise]:
    """Return the noise that sensors add to a log, to first order."""
    return [noise for effect in SENSOR_EFFECTS.values() for noise in effect.noise(options, log)]


def without_spectrum(log: Log, options: SensorOptions) -> tuple[str, ...]:
    """Return names of the streams that change a log but have no first-order model in `noises`."""
    drawn = noise_streams(np.random.default_rng(0))  # any numbers: what is asked is whether there are some
    return tuple(
        name
        for effect in SENSOR_EFFECTS.values()
        if effect.streams and effect.noise is no_noise and effect.logs(options, log, drawn) is not log
        for name in effect.streams
    )
