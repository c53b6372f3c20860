"""A comparison of methods as a study: trials of a Monte Carlo study, simulated once, given to every method; its bound.

A row per trial, method and joint; a failed call has rows with its failure, which are neither gains nor refusals.
"""

import tempfile
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
from scipy import signal

from ident.estimation.problem import ObservedMotion, Problem
from ident.estimation.rows import Columns, SharedParameters
from ident.observation.observation import observe
from ident.support.arrays import Array
from scenarios.benchmark.methods import Limits, Method, call
from scenarios.experiments.draws import places_of
from scenarios.experiments.judge import Claim, judge_claims
from scenarios.experiments.run import Failure, Simulated, as_identified, motion_streams
from scenarios.experiments.scenario import Setup
from scenarios.experiments.schema import Scenario, grouped
from scenarios.experiments.study import Study, monte_carlo
from scenarios.experiments.trials import Rows, common_columns, judged_rows, trial_schema
from scenarios.results.problem_folder import write_problem
from scenarios.results.run_folder import simulated_problem
from scenarios.support.errors import ScenarioError
from sim.record import record
from sim.sensors import SensorOptions

METHOD = "method"
COLUMNS = (("expected", pa.bool_()), ("seconds", pa.float64()))
"""Additional columns: whether the data should identify the gain, and the time of the call [s]."""
RANK_TOL = 1e-9
"""Relative singular value of the scaled columns below which a direction is neglected."""
FREQUENCIES = 1 << 14
"""Number of frequencies of a spectrum, up to half the sampling rate."""


def comparison(scenario: Scenario, methods: Sequence[Method], limits: Limits, count: int, seed: int) -> Study:
    """Return the study of `count` trials of one scenario, those of `monte_carlo`; the scenario's method is not run.

    Raises `ScenarioError` if a method is given twice; as `monte_carlo`.
    """
    texts = [method.text for method in methods]
    twice = next((text for text in texts if texts.count(text) > 1), None)
    if twice is not None:
        raise ScenarioError(f"method {twice!r} is given twice; give each method once")
    schema = trial_schema(scenario, places_of(scenario.table.random), (METHOD,))
    return replace(
        monte_carlo(scenario, count, seed),
        kind="comparison",
        schema=pa.schema([*schema, *(pa.field(name, kind) for name, kind in COLUMNS)]),
        identity={
            "seed": seed,
            "methods": [{"text": method.text, "files": dict(method.digests)} for method in methods],
            "limits": asdict(limits),
        },
        rows=partial(_answered, tuple(methods), limits),
        rows_per_joint=len(methods),
    )


def write_trial(simulated: Simulated, folder: Path) -> None:
    """Write the problem of a trial, without true values, scenario and seed."""
    write_problem(folder, simulated_problem(simulated.setup, simulated.recordings))


def _answered(methods: tuple[Method, ...], limits: Limits, scenario: Scenario, outcome: Simulated | Failure) -> Rows:
    """Return the rows of a trial; each method has a copy of the folder of its own."""
    rows, wanted = list[dict[str, object]](), scenario.table.tolerance.identifiable
    if isinstance(outcome, Failure):  # it reached no method
        failed = list(zip(judged_rows(scenario, outcome), wanted, strict=True))
        return [{**row, METHOD: each.text, "expected": expected} for each in methods for row, expected in failed]
    setup, common = outcome.setup, common_columns(outcome)
    tolerance, joints = setup.scenario.table.tolerance, setup.structure.arm.n
    for method in methods:
        with tempfile.TemporaryDirectory(prefix="rx90-problem-") as place:
            write_trial(outcome, Path(place))
            called = call(method, Path(place), joints, limits)
        answer, lost = called.outcome, dict[str, object]()
        if isinstance(answer, ScenarioError):
            lost = {"failure": answer.kind, "reason": str(answer), "passed": False}
            answer = (Claim(None, None, None),) * joints
        verdict = judge_claims(answer, outcome.truth.gain, tolerance, expectation=setup.scenario.expectation)
        called_once = {**common, METHOD: method.text, "seconds": called.seconds}
        for gain, expected in zip(verdict.gains, tolerance.identifiable, strict=True):
            rows.append({**called_once, "expected": expected, **asdict(gain), **lost})
    return rows


def gain_bound(setup: Setup) -> Array | None:
    """Return the Cramer-Rao bound: the smallest relative standard deviation of each gain with the injected noise.

    The motions are simulated without noise, with the values in the scenario's file. The noise of a row is that of the
    currents, white, and coloured below a cut-off, at its mean level in the band of the rows, in proportion to the rms
    current of each joint and motion; noise of a one-sided spectral density S, sampled without aliasing every T, has the
    variance S / (2 T). Encoder noise, uncertainty of the payload and model errors are not included.

    Returns:
        Shape (n,), infinite for a joint that is not identifiable; None if no current noise is injected.

    Raises:
        SimulationError: If a motion cannot be carried out.
    """
    sensors, chosen = setup.experiments[0].sensors, setup.scenario.table.identification
    if not sensors.current_white and not sensors.current_coloured:
        return None
    silent = [replace(experiment, sensors=SensorOptions()) for experiment in setup.experiments]
    recordings = record(silent, motion_streams(0, {}, len(silent)), threads=1)
    every = replace(chosen.observe, reversal_speed=0.0)  # all rows, also at velocity reversals
    motions = as_identified(setup, recordings)
    observed = tuple(ObservedMotion(observe(each.recording, setup.structure, every), each.payload) for each in motions)
    problem = Problem(setup.structure, observed, chosen.gains)
    rate = 1.0 / recordings[0].period
    filtered = signal.butter(2, sensors.coloured_cutoff_hz, fs=rate, output="sos")
    f, H = signal.sosfreqz(filtered, worN=FREQUENCIES, fs=rate)
    in_band = np.mean(np.abs(H[f <= chosen.observe.decimation_cutoff_hz]) ** 2) / np.mean(np.abs(H) ** 2)
    share = (sensors.current_white**2 + sensors.current_coloured**2 * in_band) / (rate * problem.row_period)
    level = [np.sqrt(share * np.mean(recordings[k].v ** 2, axis=0)) for k in grouped(setup.protocol)]
    columns = Columns.of(problem.motions)
    sigma = np.array(level)[columns.motion, columns.joint]
    return bound_of(columns, SharedParameters.of(problem).columns(columns), 1.0 / setup.true_gain, sigma)


def bound_of(columns: Columns, shared: tuple[Array, Array], h: Array, sigma: Array) -> Array:
    """Return the bound of a system of all joints.

    With the injected gains V_j = h_j (A_j theta + k_j) + F_j phi_j is linear in the other unknowns, so torques and the
    derivatives with respect to each log|g_j|, theta and phi are known. M is the part of the derivatives with respect to
    the logarithms that is orthogonal to those of the other unknowns, weighted by the noise of its rows. (M^T M)^-1
    bounds the covariance of any unbiased estimate.

    The `columns` have rows without noise; `shared` is A and k; `h` is the true 1/g, shape (n,); `sigma` is the standard
    deviation of the noise of each row [drive units], shape (r,).

    Returns:
        Relative standard deviation of each gain, shape (n,), infinite if not identifiable.
    """
    _, own = columns.friction(per_motion=False)
    of_joint = columns.joint[:, None] == np.arange(len(h))  # (r, n)
    F = (of_joint[:, :, None] * own[:, None]).reshape(len(own), -1)
    A, known = h[columns.joint, None] * shared[0], h[columns.joint] * shared[1]
    N = np.hstack((A, F)) / sigma[:, None]  # of every other unknown
    x = np.linalg.lstsq(N, (columns.V - known) / sigma)[0]
    driven = (A @ x[: A.shape[1]] + known) / sigma  # derivative of -V by log|g|: torque of links and payload
    L = np.where(of_joint, driven[:, None], 0.0)
    size = np.linalg.norm(N, axis=0)
    U, s, _ = np.linalg.svd(N[:, size > 0.0] / size[size > 0.0], full_matrices=False)
    U = U[:, s > RANK_TOL * s[0]]
    _, s, Vt = np.linalg.svd(L - U @ (U.T @ L), full_matrices=False)
    with np.errstate(divide="ignore"):
        return np.linalg.norm(Vt.T / s, axis=1)
