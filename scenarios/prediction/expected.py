"""The logs of a scenario's motions under perfect control, without noise, and what noise adds to them."""

from dataclasses import dataclass, replace

import numpy as np

from ident.numerics.filters import filtered
from ident.preparation import SIMULATED, Prepared, prepare
from ident.recordings.motion import Motion
from ident.recordings.recording import Recording
from ident.support.arrays import Array
from scenarios.experiments.build import Setup
from scenarios.experiments.files.mountings import grouped
from sim.experiment import Experiment
from sim.feedforward_currents import feedforward_currents, states_of
from sim.sensors import SensorOptions, logged_without_noise, noises, without_spectrum
from sim.sensors.effect import Log, Noise

NOISE_SEED = 0
"""Of the noise that one expected recording is given."""
RATE = 16.0
"""Rate that is enough, in cut-offs of identification's filters: what is faster is noise, and its spectrum is known."""


@dataclass(frozen=True, slots=True, eq=False)
class Expected:
    """What is logged of one motion, at a rate that is enough.

    Attributes:
        log: Without what is drawn.
        noises: What is drawn, as strong as at the real rate in the band that counts.
        unknown: Streams of what is drawn too, and has no spectrum.
    """

    log: Log
    noises: tuple[Noise, ...]
    unknown: tuple[str, ...]


def expected_logs(setup: Setup, every: int) -> tuple[Expected, ...]:
    """The expected log of each motion, in order of time.

    Raises:
        PlantError: If a plant cannot be built.
    """
    rate_hz = setup.scenario.table.experiment.controller.rate_hz / every
    needed = feedforward_currents(setup.experiments, rate_hz)
    return tuple(_expected(each, v, every, rate_hz) for each, v in zip(setup.experiments, needed, strict=True))


def expected_preparation(setup: Setup, every: int) -> Prepared:
    """The expected logs as identification prepares them, each with one realisation of its noise.

    Methods that weigh rows, or choose a model, by the residual need the noise.

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
    """Samples of the controller to one that is enough for identification."""
    observe = setup.scenario.table.identification.observe
    rate_hz = RATE * max(observe.cutoff_hz, observe.decimation_cutoff_hz)
    return max(1, int(setup.scenario.table.experiment.controller.rate_hz / rate_hz))


def _noisy_recording(each: Expected, experiment: Experiment, rng: np.random.Generator) -> Recording:
    """The expected log with one realisation of what noise adds to the currents."""
    v = each.log.v.copy()
    for noise in each.noises:
        drawn = rng.standard_normal((1 if noise.lasting else len(v), 1 if noise.shared else v.shape[1]))
        v += noise.v * (drawn if noise.sos is None else filtered(noise.sos, drawn))
    return Recording(each.log.t, each.log.q, v, experiment.name)


def louder(quiet: Expected, sensors: SensorOptions, every: int) -> list[str]:
    """Streams of noise that other sensors would make of another strength, or have besides, in the very same log."""
    other = _drawn(quiet.log, sensors, every)
    before = {noise.stream: noise for noise in quiet.noises}
    changed = [noise.stream for noise in other.noises if not _same(noise, before.get(noise.stream))]
    return changed + [stream for stream in other.unknown if stream not in quiet.unknown]


def _same(one: Noise, other: Noise | None) -> bool:
    return other is not None and np.array_equal(one.q, other.q) and np.array_equal(one.v, other.v)


def _expected(experiment: Experiment, v: Array, every: int, rate_hz: float) -> Expected:
    q = states_of(experiment.trajectory, rate_hz).q
    return _drawn(logged_without_noise(q, v, rate_hz, experiment.sensors), experiment.sensors, every)


def _drawn(log: Log, sensors: SensorOptions, every: int) -> Expected:
    """White noise of fewer samples keeps its spectral density; the variance of all other is in the band."""
    share, found = 1.0 / np.sqrt(every), noises(log, sensors)
    white = [noise.sos is None and not noise.lasting for noise in found]
    thinned = (replace(x, q=share * x.q, v=share * x.v) if thin else x for x, thin in zip(found, white, strict=True))
    return Expected(log, tuple(thinned), without_spectrum(log, sensors))
