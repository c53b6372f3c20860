"""An estimate from expected logs, linearised: what a change, or noise, of any logged current does to each gain.

The change of 1/g_j is the sum over rows of their influence times the change of each row's current, which is cleared of
reversals and decimated as the current was. Noise of known spectrum follows sample by sample,

    var(1/g) = sum of squares of h * (K_v s_v + K_q s_q)

K_v are the weights of a log's currents, s what a number of unit variance adds to the log, h the filter that shapes the
numbers. Positions are differentiated: noise q of joint l acts like currents -h_j M_jl d^2 q / dt^2, low-passed as
identification does it. What it adds to speeds and to gravity is less than a hundredth of that.
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
from scenarios.experiments.build import Setup
from scenarios.experiments.files.mountings import grouped
from scenarios.prediction.expected import Expected, expected_preparation
from scenarios.support.errors import StudyError
from sim.experiment import Experiment
from sim.feedforward_currents import inertia_along
from sim.sensors.effect import Noise

NOT_LINEAR = ("ols", "tls-2014")
"""Methods in which noise of the currents stands in the matrix: their errors are of second order."""


@dataclass(frozen=True, slots=True, eq=False)
class Linearised:
    """An estimate and how it moves.

    Attributes:
        setup: What it was made from.
        expected: Its logs.
        estimate: Its k solved gains come with the influence of each row.
        behind: The motion behind the rows, motions in order of time.
        places: Place of each motion of the estimate in order of time.
        every: Samples of the controller to one of the expected logs.
    """

    setup: Setup
    expected: Prepared
    estimate: GainEstimate
    behind: tuple[FullRate, ...]
    places: tuple[int, ...]
    every: int

    def change(self, logs: Sequence[Expected], base: Sequence[Expected]) -> Array:
        """Change of each 1/g from one set of logs, in order of time, to another of the same motions, shape (k,)."""
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
        """Derivative of each 1/g by each sample of each motion in order of time, each (k, samples, n).

        A delay that identification gives the currents is left out: noise does not care.
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
        """Variance of each 1/g from each noise stream that is on, (k,) by name."""
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
        StudyError: If the scenario's method has no first order.
        IdentificationError: If there is nothing to identify.
        PlantError: If a plant cannot be built.
    """
    chosen = setup.scenario.table.identification
    if chosen.method in NOT_LINEAR:
        raise StudyError(
            f"{setup.scenario.name}: method {chosen.method}: its second-order bias from noise is not "
            "predicted; simulate it with rx90 sensitivity, or choose another --method"
        )
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
    """Variance of each 1/g from one noise of one motion, shape (k,)."""
    total = K * noise.v
    if by_position is not None:
        total = total + by_position * noise.q
    if noise.lasting:
        total = total.sum(axis=1, keepdims=True)
    if noise.shared:
        total = total.sum(axis=2, keepdims=True)
    if noise.sos is not None:  # backwards in time: what a number does to all later samples
        k, samples, n = total.shape
        backwards = total[:, ::-1].transpose(1, 0, 2).reshape(samples, k * n)
        settled = filtered(noise.sos, np.concatenate((backwards, np.zeros_like(backwards))))
        total = settled.reshape(2 * samples, k, n).transpose(1, 0, 2)
    return np.sum(total**2, axis=(1, 2))


def _by_position(K: Array, experiment: Experiment, rate_hz: float, cutoff_hz: float) -> Array:
    """Derivative of each 1/g by each logged position, shape (k, N, n)."""
    force = K / experiment.plant.drives.gain  # (k, N, n)
    moved = np.einsum("ktj,tjl->ktl", force, inertia_along(experiment, rate_hz))
    k, samples, n = moved.shape
    flat = moved.transpose(1, 0, 2).reshape(samples, k * n)
    twice = smooth_motion(flat, 1.0 / rate_hz, cutoff_hz)[2]
    return -twice.reshape(samples, k, n).transpose(1, 0, 2)
