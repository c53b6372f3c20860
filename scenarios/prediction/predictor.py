"""Errors of the gains to first order, without simulation: several questions to one linearised estimate.

The expected logs have perfect control, the effects of the plant, and noise of known spectrum. The change of 1/g_j is
the sum over rows of their influence times the change of each row's current, which is masked near reversals and
decimated like the current. For noise of known spectrum,

    var(1/g) = sum of squares of h * (K_v s_v + K_q s_q)

where K_v has the weights of a log's currents, s is the standard deviation of the noise, and h its filter. Noise q of
the position of joint l acts like currents -h_j M_jl d^2 q / dt^2, with the low-pass of the identification. Its effect
through speed and gravity is less than a hundredth of that.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from ident.estimation.estimate import GainEstimate
from ident.estimation.estimators import estimator
from ident.numerics.filters import filtered
from ident.numerics.signals import delayed, smooth_motion
from ident.observation.full_rate import FullRate
from ident.preparation import SIMULATED, Prepared, prepare
from ident.recordings.recording import Motion, Recording
from ident.support.arrays import Array
from scenarios.experiments.run import as_identified
from scenarios.experiments.scenario import Setup
from scenarios.experiments.schema import grouped
from sim.experiment import Experiment
from sim.feedforward_currents import feedforward_currents, inertia_along, of_motors, states_of
from sim.sensors import SensorOptions, logged, noises, without_spectrum
from sim.sensors.sensor import Log, Noise


@dataclass(frozen=True, eq=False)
class Expected:
    """The expected log of one motion at a sufficient rate, without random effects."""

    log: Log
    sensors: SensorOptions
    every: int  # ratio of the controller's rate to that of the log

    @cached_property
    def noises(self) -> tuple[Noise, ...]:
        """Models of the noise: at this rate, white noise keeps its spectral density, other noise its variance."""
        share = 1.0 / np.sqrt(self.every)
        return tuple(
            replace(x, q=share * x.q, v=share * x.v) if x.sos is None and not x.lasting else x
            for x in noises(self.log, self.sensors)
        )

    @cached_property
    def unknown(self) -> tuple[str, ...]:
        """Streams of random effects without a known spectrum."""
        return without_spectrum(self.log, self.sensors)

    def recording(self, name: str, rng: np.random.Generator) -> Recording:
        """Return the log with one realisation of the noise of the currents."""
        v = self.log.v.copy()
        for noise in self.noises:
            drawn = rng.standard_normal((1 if noise.lasting else len(v), 1 if noise.shared else v.shape[1]))
            v += noise.v * (drawn if noise.sos is None else filtered(noise.sos, drawn))
        return Recording(self.log.t, self.log.q, v, name)

    def louder(self, sensors: SensorOptions) -> list[str]:
        """Return noise streams that differ with other settings of sensors and the same log."""
        if sensors == self.sensors:
            return []
        other, own = replace(self, sensors=sensors), {x.stream: (x.q, x.v) for x in self.noises}
        differing = [
            x.stream
            for x in other.noises
            if x.stream not in own or not all(map(np.array_equal, own[x.stream], (x.q, x.v)))
        ]
        return differing + [stream for stream in other.unknown if stream not in self.unknown]


def enough(setup: Setup) -> int:
    """Return the ratio of the controller's to the sufficient rate; faster components are noise of known spectrum."""
    observe = setup.scenario.table.identification.observe
    rate_hz = 16.0 * max(observe.cutoff_hz, observe.decimation_cutoff_hz)
    return max(1, int(setup.scenario.table.experiment.controller.rate_hz / rate_hz))


def expected_logs(setup: Setup, every: int) -> tuple[Expected, ...]:
    """Return the expected log of each motion, in order of time; raises `PlantError` if a plant cannot be built."""
    rate_hz = setup.scenario.table.experiment.controller.rate_hz / every
    found: list[Expected] = []
    for each, v in zip(setup.experiments, feedforward_currents(setup.experiments, rate_hz), strict=True):
        motion = of_motors(states_of(each.trajectory, rate_hz), each.plant.robot.motors)
        found.append(Expected(logged(motion.q, v, rate_hz, each.sensors, None), each.sensors, every))
    return tuple(found)


def expected_preparation(setup: Setup, every: int, motions: Sequence[Motion] = ()) -> Prepared:
    """Return the expected logs, or known motions, as prepared for identification; some methods need their noise."""
    rng, chosen = np.random.default_rng(0), setup.scenario.table.identification
    if not motions:
        logs = zip(expected_logs(setup, every), setup.experiments, strict=True)
        motions = as_identified(setup, [log.recording(experiment.name, rng) for log, experiment in logs])
    return prepare(motions, setup.structure, observing=chosen.observe, gains=chosen.gains, policy=SIMULATED)


@dataclass(frozen=True, eq=False)
class Linearised:
    """An estimate and its derivatives."""

    setup: Setup
    expected: Prepared
    estimate: GainEstimate  # the estimate, with k solved gains and the influence of each row
    behind: tuple[FullRate, ...]  # derivatives of motion of the rows, motions in order of time
    places: tuple[int, ...]  # index of each motion of the estimate in order of time
    every: int  # ratio of the controller's sampling rate to that of the expected logs

    @classmethod
    def of(cls, setup: Setup, every: int, motions: Sequence[Motion] = ()) -> "Linearised":
        """Estimate the gains of a prepared scenario as `expected_preparation`; raises as preparation and estimator."""
        chosen, places = setup.scenario.table.identification, grouped(setup.protocol)
        expected = expected_preparation(setup, every, motions)
        parts = [expected.parts[k] for k in np.argsort(places)]
        behind = tuple(full for part in parts if (full := part.observation.full_rate) is not None)
        estimate = estimator(chosen.method).estimate(expected.problem, chosen.method_options)
        return cls(setup, expected, estimate, behind, places, every)

    @property
    def true_gain(self) -> Array:
        """The true gains under the currents of the expected logs [N m / drive unit], shape (n,)."""
        return self.setup.gain_under([self.expected.motions[k].recording.v for k in np.argsort(self.places)])

    def change(self, logs: Sequence[Expected], base: Sequence[Expected]) -> Array:
        """Return the change of each 1/g between two sets of logs of the same motions, in order of time, (k,)."""
        table = self.setup.scenario.table
        later = table.identification.observe.current_delay * table.experiment.controller.rate_hz / self.every
        changed = zip(self.weights, logs, base, strict=True)
        parts = [np.einsum("tkj,tj->k", K, delayed(log.log.v - own.log.v, later)) for K, log, own in changed]
        return np.sum(parts, axis=0)

    @cached_property
    def weights(self) -> tuple[Array, ...]:
        """Derivatives of each 1/g with respect to each sample of each motion in order of time, each (samples, k, n).

        A compensated delay of the currents is omitted, as it does not affect noise.
        """
        solution, k, n = self.estimate.solution, len(self.estimate.solution.joints), self.setup.structure.arm.n
        rows, found = solution.rows, tuple(np.zeros((len(each.recording.t), k, n)) for each in self.behind)
        for (number, place), joint in product(enumerate(self.places), range(n)):
            of = (rows.joint == joint) & (rows.motion == number)
            at, share = rows.position[of], solution.influence[:, of]
            for i in np.flatnonzero(share.any(axis=1)):
                weights = np.zeros(int(at[-1]) + 1)
                weights[at] = share[i]
                found[place][:, i, joint] = self.behind[place].spread(weights, joint, len(found[place]))
        return found

    def noise_variances(self, logs: Sequence[Expected]) -> dict[str, Array]:
        """Variance of each 1/g from each active noise stream, (k,) by name."""
        variances: dict[str, Array] = {}
        cutoff_hz = self.setup.scenario.table.identification.observe.cutoff_hz
        for each, K, experiment in zip(logs, self.weights, self.setup.experiments, strict=True):
            moved = any(noise.q.any() for noise in each.noises)
            by_position = _by_position(K, experiment, each.log.rate_hz, cutoff_hz) if moved else np.zeros_like(K)
            for noise in each.noises:
                variance = _variance(noise, K, by_position)
                variances[noise.stream] = variances.get(noise.stream, 0.0) + variance
        return variances


def _variance(noise: Noise, K: Array, by_position: Array) -> Array:
    """Return the variance of each 1/g from one noise of one motion, shape (k,)."""
    q, v = (np.atleast_2d(size)[:, None] for size in (noise.q, noise.v))  # of all samples, or of each
    total = K * v + by_position * q
    if noise.lasting:
        total = total.sum(axis=0, keepdims=True)
    if noise.shared:
        total = total.sum(axis=2, keepdims=True)
    if noise.sos is not None:  # backwards in time: effect of a number on all later samples
        backwards = total[::-1].reshape(len(total), -1)
        settled = filtered(noise.sos, np.concatenate((backwards, np.zeros_like(backwards))))
        total = settled.reshape(-1, *total.shape[1:])
    return np.sum(total**2, axis=(0, 2))


def _by_position(K: Array, experiment: Experiment, rate_hz: float, cutoff_hz: float) -> Array:
    """Return the derivative of each 1/g with respect to each logged position, shape (N, k, n)."""
    moved = np.einsum("tkj,tjl->tkl", K / experiment.plant.drives.gain, inertia_along(experiment, rate_hz))
    return -smooth_motion(moved.reshape(len(K), -1), 1.0 / rate_hz, cutoff_hz)[2].reshape(K.shape)
