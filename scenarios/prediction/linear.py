"""A linearised estimate from expected logs: effect of changes and noise of the logged currents on each gain.

The change of 1/g_j is the sum over rows of their influence times the change of each row's current, which is masked near
reversals and decimated like the current. For noise of known spectrum,

    var(1/g) = sum of squares of h * (K_v s_v + K_q s_q)

where K_v has the weights of a log's currents, s is the standard deviation of the noise, and h its filter. Noise q of
the position of joint l acts like currents -h_j M_jl d^2 q / dt^2, with the low-pass of the identification. Its effect
through speed and gravity is less than a hundredth of that.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.estimation.estimate import GainEstimate
from ident.estimation.estimators import estimator
from ident.numerics.filters import filtered
from ident.numerics.signals import delayed, smooth_motion
from ident.observation.full_rate import FullRate
from ident.preparation import Prepared
from ident.support.arrays import Array
from scenarios.experiments.schema import grouped
from scenarios.experiments.setup import Setup
from scenarios.prediction.expected import Expected, expected_preparation
from sim.experiment import Experiment
from sim.feedforward_currents import inertia_along
from sim.sensors.sensor import Noise


@dataclass(frozen=True, slots=True, eq=False)
class Linearised:
    """An estimate and its derivatives.

    Attributes:
        setup: The setup.
        expected: The expected logs.
        estimate: The estimate, with k solved gains and the influence of each row.
        behind: Derivatives of motion of the rows, motions in order of time.
        places: Index of each motion of the estimate in order of time.
        every: Ratio of the controller's sampling rate to that of the expected logs.
    """

    setup: Setup
    expected: Prepared
    estimate: GainEstimate
    behind: tuple[FullRate, ...]
    places: tuple[int, ...]
    every: int

    def change(self, logs: Sequence[Expected], base: Sequence[Expected]) -> Array:
        """Return the change of each 1/g between two sets of logs of the same motions, in order of time, (k,)."""
        table, solution = self.setup.scenario.table, self.estimate.solution
        later = table.identification.observe.current_delay * table.experiment.controller.rate_hz / self.every
        dV = np.zeros(len(solution.rows.V))
        for number, place in enumerate(self.places):
            behind = self.behind[place]
            sampled = behind.sampled(delayed(logs[place].log.v - base[place].log.v, later))
            for joint in range(sampled.shape[1]):
                of = (solution.rows.joint == joint) & (solution.rows.motion == number)
                dV[of] = behind.decimated(sampled[:, joint], joint)[solution.rows.position[of]]
        return solution.influence @ dV

    def weights(self, samples: int) -> list[Array]:
        """Derivatives of each 1/g with respect to each sample of each motion in order of time, each (k, samples, n).

        A compensated delay of the currents is omitted, as it does not affect noise.
        """
        solution, n = self.estimate.solution, self.setup.structure.arm.n
        found = [np.zeros((len(solution.joints), samples, n)) for _ in self.behind]
        for number, place in enumerate(self.places):
            behind = self.behind[place]
            for joint in range(n):
                of = (solution.rows.joint == joint) & (solution.rows.motion == number)
                at, share = solution.rows.position[of], solution.influence[:, of]
                for k in np.flatnonzero(share.any(axis=1)):
                    rows = np.zeros(int(at[-1]) + 1)
                    rows[at] = share[k]
                    found[place][k, :, joint] = behind.spread(rows, joint, samples)
        return found

    def noise_variances(self, logs: Sequence[Expected]) -> dict[str, Array]:
        """Variance of each 1/g from each active noise stream, (k,) by name."""
        variances: dict[str, Array] = {}
        cutoff_hz = self.setup.scenario.table.identification.observe.cutoff_hz
        weights = self.weights(len(logs[0].log.t))
        for each, K, experiment in zip(logs, weights, self.setup.experiments, strict=True):
            moved = any(noise.q.any() for noise in each.noises)
            by_position = _by_position(K, experiment, each.log.rate_hz, cutoff_hz) if moved else None
            for noise in each.noises:
                variances[noise.stream] = variances.get(noise.stream, 0.0) + _variance(noise, K, by_position)
        return variances


def linearised(setup: Setup, every: int) -> Linearised:
    """Estimate the gains of a prepared scenario from its expected logs.

    Raises:
        IdentificationError: If there is no gain to identify.
        PlantError: If a plant cannot be built.
    """
    chosen = setup.scenario.table.identification
    expected = expected_preparation(setup, every)
    places = grouped(setup.protocol)
    in_time = sorted(zip(places, expected.parts, strict=True), key=lambda pair: pair[0])
    return Linearised(
        setup=setup,
        expected=expected,
        estimate=estimator(chosen.method).estimate(expected.problem, chosen.method_options),
        behind=tuple(behind for _, part in in_time if (behind := part.observation.full_rate) is not None),
        places=places,
        every=every,
    )


def _variance(noise: Noise, K: Array, by_position: Array | None) -> Array:
    """Return the variance of each 1/g from one noise of one motion, shape (k,)."""
    total = K * noise.v
    if by_position is not None:
        total = total + by_position * noise.q
    if noise.lasting:
        total = total.sum(axis=1, keepdims=True)
    if noise.shared:
        total = total.sum(axis=2, keepdims=True)
    if noise.sos is not None:  # backwards in time: effect of a number on all later samples
        k, samples, n = total.shape
        backwards = total[:, ::-1].transpose(1, 0, 2).reshape(samples, k * n)
        settled = filtered(noise.sos, np.concatenate((backwards, np.zeros_like(backwards))))
        total = settled.reshape(2 * samples, k, n).transpose(1, 0, 2)
    return np.sum(total**2, axis=(1, 2))


def _by_position(K: Array, experiment: Experiment, rate_hz: float, cutoff_hz: float) -> Array:
    """Return the derivative of each 1/g with respect to each logged position, shape (k, N, n)."""
    force = K / experiment.plant.drives.gain  # (k, N, n)
    moved = np.einsum("ktj,tjl->ktl", force, inertia_along(experiment, rate_hz))
    k, samples, n = moved.shape
    flat = moved.transpose(1, 0, 2).reshape(samples, k * n)
    twice = smooth_motion(flat, 1.0 / rate_hz, cutoff_hz)[2]
    return -twice.reshape(samples, k, n).transpose(1, 0, 2)
