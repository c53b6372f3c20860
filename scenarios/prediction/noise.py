"""Standard deviations of 1/g from noise of known spectrum, sample by sample.

    var(1/g) = sum of squares of h * (K_v s_v + K_q s_q)

K_v are the weights of a log's currents, s what a number of unit variance adds to the log, h the filter that shapes the
numbers. Positions are differentiated: noise q of joint l acts like currents -h_j M_jl d^2 q / dt^2, low-passed as
identification does it. What it adds to speeds and to gravity is less than a hundredth of that.
"""

from collections.abc import Sequence

import numpy as np

from ident.numerics.filters import filtered
from ident.numerics.signals import smooth_motion
from ident.support.arrays import Array
from scenarios.prediction.expected import Expected
from scenarios.prediction.linear import Linearised
from sim.experiment import Experiment
from sim.feedforward_currents import inertia_along
from sim.sensors.effect import Noise


def noise_variances(linear: Linearised, logs: Sequence[Expected]) -> dict[str, Array]:
    """Variance of each 1/g from each noise stream that is on, (k,) by name.

    Args:
        linear: The estimate.
        logs: Of each motion in order of time, with the noises asked for.
    """
    variances: dict[str, Array] = {}
    weights = linear.weights(len(logs[0].log.t))
    for each, K, experiment in zip(logs, weights, linear.setup.experiments, strict=True):
        cutoff_hz = linear.setup.scenario.table.identification.observe.cutoff_hz
        moved = any(noise.q.any() for noise in each.noises)
        by_position = _by_position(K, experiment, each.log.rate_hz, cutoff_hz) if moved else None
        for noise in each.noises:
            found = _variance(noise, K, by_position)
            variances[noise.stream] = variances.get(noise.stream, 0.0) + found
    return variances


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
