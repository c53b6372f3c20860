"""The Cramer-Rao bound of a scenario: smallest possible standard deviation of a gain with the injected current noise.

The motions are simulated without any noise. With the injected gains V_j = h_j (A_j theta + k_j) + F_j phi_j is linear
in the other unknowns, so torques and the derivatives with respect to each log|g_j|, theta and phi are known. M is the
part of the derivatives with respect to the logarithms that is orthogonal to those of the other unknowns, weighted by
the noise of its rows. (M^T M)^-1 bounds the covariance of any unbiased estimate with this model and all rows, including
velocity reversals.

Noise of a row: injected noise is white, and coloured below a cut-off. Both have their mean level in the band of the
rows, proportional to the rms current of each joint and motion. The bound does not include encoder noise, uncertainty of
the payload, and model errors.
"""

from dataclasses import replace

import numpy as np
from scipy import signal

from ident.estimation.problem import ObservedMotion, Problem
from ident.estimation.rows import Columns, SharedParameters
from ident.observation.observation import observe
from ident.recordings.recording import Recording
from ident.support.arrays import Array
from scenarios.experiments.run import as_identified, motion_streams
from scenarios.experiments.scenario import Setup
from scenarios.experiments.schema import grouped
from sim.record import record
from sim.sensors import SensorOptions

RANK_TOL = 1e-9
"""Relative singular value of the scaled columns below which a direction is neglected."""
FREQUENCIES = 1 << 14
"""Number of frequencies of a spectrum, up to half the sampling rate."""


def gain_bound(setup: Setup) -> Array | None:
    """Return the smallest relative standard deviation of each gain, with the values in the scenario's file.

    Returns:
        Shape (n,), infinite for a joint that is not identifiable; None if no current noise is injected.

    Raises:
        SimulationError: If a motion cannot be carried out.
    """
    sensors = setup.experiments[0].sensors
    if not sensors.current_white and not sensors.current_coloured:
        return None
    silent = [replace(experiment, sensors=SensorOptions()) for experiment in setup.experiments]
    recordings = record(silent, motion_streams(0, {}, len(silent)), threads=1)
    problem = _problem(setup, recordings)
    level = np.array(
        [_row_noise(recordings[k], sensors, setup, problem.row_period) for k in grouped(setup.protocol)]
    )  # (motions, n)
    columns = Columns.of(problem, SharedParameters.of(problem))
    return bound_of(columns, 1.0 / setup.true_gain, level[columns.motion, columns.joint])


def bound_of(columns: Columns, h: Array, sigma: Array) -> Array:
    """Return the bound of a system of all joints.

    The `columns` have rows without noise; `h` is the true 1/g, shape (n,); `sigma` is the standard deviation of the
    noise of each row [drive units], shape (r,).

    Returns:
        Relative standard deviation of each gain, shape (n,), infinite if not identifiable.
    """
    _, own = columns.friction(per_motion=False)
    of_joint = columns.joint[:, None] == np.arange(len(h))  # (r, n)
    F = (of_joint[:, :, None] * own[:, None]).reshape(len(own), -1)
    A = h[columns.joint, None] * columns.shared
    known = h[columns.joint] * columns.known
    N = np.hstack((A, F)) / sigma[:, None]  # of every other unknown
    x = np.linalg.lstsq(N, (columns.V - known) / sigma)[0]
    # derivative of -V with respect to log|g|: the torque of links and payload in drive units
    driven = (A @ x[: A.shape[1]] + known) / sigma
    L = np.where(of_joint, driven[:, None], 0.0)
    U = _basis(N)
    M = L - U @ (U.T @ L)
    _, s, Vt = np.linalg.svd(M, full_matrices=False)
    with np.errstate(divide="ignore"):
        return np.linalg.norm(Vt.T / s, axis=1)


def _basis(N: Array) -> Array:
    """Return orthonormal columns that span those of N, independent of their units."""
    size = np.linalg.norm(N, axis=0)
    U, s, _ = np.linalg.svd(N[:, size > 0.0] / size[size > 0.0], full_matrices=False)
    return U[:, s > RANK_TOL * s[0]]


def _problem(setup: Setup, recordings: list[Recording]) -> Problem:
    """Return all rows of the motions, including velocity reversals."""
    chosen = setup.scenario.table.identification
    every = replace(chosen.observe, reversal_speed=0.0)
    motions = as_identified(setup, recordings)
    observed = tuple(ObservedMotion(observe(each.recording, setup.structure, every), each.payload) for each in motions)
    return Problem(setup.structure, observed, chosen.gains)


def _row_noise(recording: Recording, sensors: SensorOptions, setup: Setup, row_period: float) -> Array:
    """Return the standard deviation of the noise of one motion's rows [drive units], shape (n,).

    Noise of a one-sided spectral density S, sampled without aliasing every T, has the variance S / (2 T).
    """
    rate = 1.0 / recording.period
    band = setup.scenario.table.identification.observe.decimation_cutoff_hz
    coloured = sensors.current_coloured**2 * in_band(sensors.coloured_cutoff_hz, band, rate)
    share = (sensors.current_white**2 + coloured) / (rate * row_period)
    return np.sqrt(share * np.mean(recording.v**2, axis=0))


def in_band(cutoff_hz: float, band_hz: float, rate_hz: float) -> float:
    """Return the mean density of coloured noise in a band from zero, relative to white noise of the same variance."""
    f, H = signal.sosfreqz(signal.butter(2, cutoff_hz, fs=rate_hz, output="sos"), worN=FREQUENCIES, fs=rate_hz)
    power = np.abs(H) ** 2
    return float(np.mean(power[f <= band_hz]) / np.mean(power))
