"""The logs of a scenario's motions under perfect control, without noise, and what noise adds to them."""

from dataclasses import dataclass

import numpy as np
from scipy import signal

from ident.arrays import Array
from ident.recording import Recording
from scenarios.build import Bench
from sim.experiment import Experiment
from sim.needed import needed_currents, states_of
from sim.sensors import logged_without_noise, noises
from sim.sensors.effect import Log, Noise

NOISE_SEED = 0
"""Of the noise that one expected recording is given."""


@dataclass(frozen=True, slots=True, eq=False)
class Expected:
    """What is logged of one motion.

    Attributes:
        log: Without what is drawn.
        noises: What is drawn.
    """

    log: Log
    noises: tuple[Noise, ...]


def expected_logs(prepared: Bench) -> tuple[Expected, ...]:
    """The expected log of each motion, in order of time.

    Raises:
        PlantError: If a plant cannot be built.
    """
    return tuple(_expected(experiment) for experiment in prepared.experiments)


def noisy_recording(each: Expected, experiment: Experiment, rng: np.random.Generator) -> Recording:
    """The expected log with one realisation of what noise adds to the currents."""
    v = each.log.v.copy()
    for noise in each.noises:
        drawn = rng.standard_normal((len(v), 1 if noise.shared else v.shape[1]))
        v += noise.v * (drawn if noise.sos is None else signal.sosfilt(noise.sos, drawn, axis=0))
    return Recording(each.log.t, each.log.q, v, experiment.name)


def _expected(experiment: Experiment) -> Expected:
    rate_hz, sensors = experiment.controller.rate_hz, experiment.sensors
    log = logged_without_noise(states_of(experiment).q, needed_currents(experiment), rate_hz, sensors)
    return Expected(log, tuple(noises(log, sensors)))


def added_currents(one: tuple[Expected, ...], other: tuple[Expected, ...]) -> list[Array]:
    """Currents of the first logs less those of the second, motion by motion."""
    return [a.log.v - b.log.v for a, b in zip(one, other, strict=True)]
