"""The expected logs of a scenario's motions with perfect control, and a model of their noise."""

from dataclasses import dataclass, replace

import numpy as np

from ident.numerics.filters import filtered
from ident.preparation import SIMULATED, Prepared, prepare
from ident.recordings.motion import Motion
from ident.recordings.recording import Recording
from ident.support.arrays import Array
from scenarios.experiments.schema import grouped
from scenarios.experiments.setup import Setup
from sim.experiment import Experiment
from sim.feedforward_currents import feedforward_currents, states_of
from sim.sensors import SensorOptions, logged, noises, without_spectrum
from sim.sensors.sensor import Log, Noise

NOISE_SEED = 0
"""Seed of the noise of an expected recording."""
RATE = 16.0
"""Sufficient sampling rate, relative to the cut-offs; faster components are noise with known spectrum."""


@dataclass(frozen=True, slots=True, eq=False)
class Expected:
    """The expected log of one motion, at a sufficient rate.

    Attributes:
        log: The log without random effects.
        noises: Models of the noise, with the spectral density at the real rate.
        unknown: Streams of random effects without a known spectrum.
    """

    log: Log
    noises: tuple[Noise, ...]
    unknown: tuple[str, ...]


def expected_logs(setup: Setup, every: int) -> tuple[Expected, ...]:
    """Return the expected log of each motion, in order of time.

    Raises:
        PlantError: If a plant cannot be built.
    """
    rate_hz = setup.scenario.table.experiment.controller.rate_hz / every
    needed = feedforward_currents(setup.experiments, rate_hz)
    return tuple(_expected(each, v, every, rate_hz) for each, v in zip(setup.experiments, needed, strict=True))


def expected_preparation(setup: Setup, every: int) -> Prepared:
    """Return the expected logs as prepared for identification, each with one realisation of its noise.

    Methods that weight rows or select a model by the residual need the noise.

    Raises:
        RecordingError: If one cannot be filtered.
        PlantError: If a plant cannot be built.
    """
    rng = np.random.default_rng(NOISE_SEED)
    logs = zip(expected_logs(setup, every), setup.experiments, strict=True)
    recordings = [_noisy_recording(log, experiment, rng) for log, experiment in logs]
    motions = [Motion(recordings[place], setup.mounted[place]) for place in grouped(setup.protocol)]
    chosen = setup.scenario.table.identification
    return prepare(motions, setup.structure, observing=chosen.observe, gains=chosen.gains, policy=SIMULATED)


def enough(setup: Setup) -> int:
    """Return the ratio of the controller's to the sufficient sampling rate."""
    observe = setup.scenario.table.identification.observe
    rate_hz = RATE * max(observe.cutoff_hz, observe.decimation_cutoff_hz)
    return max(1, int(setup.scenario.table.experiment.controller.rate_hz / rate_hz))


def _noisy_recording(each: Expected, experiment: Experiment, rng: np.random.Generator) -> Recording:
    """Return the expected log with one realisation of the noise of the currents."""
    v = each.log.v.copy()
    for noise in each.noises:
        drawn = rng.standard_normal((1 if noise.lasting else len(v), 1 if noise.shared else v.shape[1]))
        v += noise.v * (drawn if noise.sos is None else filtered(noise.sos, drawn))
    return Recording(each.log.t, each.log.q, v, experiment.name)


def louder(quiet: Expected, sensors: SensorOptions, every: int) -> list[str]:
    """Return noise streams that differ between two settings of sensors with the same expected log."""
    other = _drawn(quiet.log, sensors, every)
    before = {noise.stream: noise for noise in quiet.noises}
    changed = [noise.stream for noise in other.noises if not _same(noise, before.get(noise.stream))]
    return changed + [stream for stream in other.unknown if stream not in quiet.unknown]


def _same(one: Noise, other: Noise | None) -> bool:
    return other is not None and np.array_equal(one.q, other.q) and np.array_equal(one.v, other.v)


def _expected(experiment: Experiment, v: Array, every: int, rate_hz: float) -> Expected:
    q = states_of(experiment.trajectory, rate_hz).q
    return _drawn(logged(q, v, rate_hz, experiment.sensors, None), experiment.sensors, every)


def _drawn(log: Log, sensors: SensorOptions, every: int) -> Expected:
    """Return noise at a lower rate: white noise keeps its spectral density, other noise its variance."""
    share, found = 1.0 / np.sqrt(every), noises(log, sensors)
    white = [noise.sos is None and not noise.lasting for noise in found]
    thinned = (replace(x, q=share * x.q, v=share * x.v) if thin else x for x, thin in zip(found, white, strict=True))
    return Expected(log, tuple(thinned), without_spectrum(log, sensors))
