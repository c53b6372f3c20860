from dataclasses import replace

import numpy as np
import pytest
from quick import FULL_RATE, QUIET, SENSORS, quick_scenario

from ident.estimation.joint_by_joint import joint_by_joint_gains
from ident.estimation.problem import ObservedMotion, Problem
from ident.observation.observation import observe
from ident.recordings.recording import Recording
from scenarios.experiments.motions import write_motion
from scenarios.experiments.run import motion_streams
from scenarios.experiments.scenario import load_scenario, setup_of, with_settings
from scenarios.prediction.predictor import Linearised, _by_position, _variance, enough, expected_logs
from sim.sensors import logged
from sim.sensors.sensor import Noise
from sim.trajectory import at_rest


@pytest.fixture(scope="module")
def rich(tmp_path_factory):
    """Without noise, with a motion of 10 s that shows every parameter of every joint."""
    folder = tmp_path_factory.mktemp("rich")
    rng = np.random.default_rng(8)
    sine, cosine = 0.3 / np.sqrt(np.arange(1.0, 9.0)) * rng.normal(size=(2, 6, 8))
    path = quick_scenario(folder)
    write_motion(at_rest(np.array([0.2, 0.1, 1.0, 0.1, 0.4, -0.2]), sine, cosine, 10.0), folder / "short.toml", [])
    return setup_of(with_settings(load_scenario(str(path)), {**QUIET, **FULL_RATE}))


GAINS = {"plant.gain": [-0.7, 1.1, 0.9, 1.3, 1.7, 2.0]}
CHANGES = {
    "payload": ({}, {"plant.errors.load_friction": 0.03, "plant.payload.mass": 7.3}, "bare loaded"),
    "compensated delay": ({"identification.observe.current_delay": 0.0127}, {}, "bare loaded"),  # 3.2 samples of a log
    "order": ({}, {"plant.errors.coulomb_drift": -0.06}, "loaded bare bare loaded"),
}
"""Settings of the scenario, settings of what changes, and protocol: estimated bare motions first."""


@pytest.mark.parametrize("name", CHANGES)
def test_changes_of_an_estimate_are_those_of_estimating_again(quick, name):
    # Least squares are linear in the currents, and expected motions are the same: only rounding is between.
    own, change, protocol = CHANGES[name]
    experiment = quick.table.experiment.model_copy(update={"protocol": tuple(protocol.split())})
    scenario = replace(quick, table=quick.table.model_copy(update={"experiment": experiment}))
    own = {**QUIET, **own}
    one, other = (setup_of(with_settings(scenario, each)) for each in (own, {**own, **GAINS, **change}))
    linear, logs = Linearised.of(one, 4), expected_logs(one, 4)
    expected = Linearised.of(other, 4).estimate.solution.inverse - linear.estimate.solution.inverse
    assert np.abs(expected).min() > 1e-3
    np.testing.assert_allclose(linear.change(expected_logs(other, 4), logs), expected, rtol=1e-8)
    if name == "order":
        assert linear.places == (0, 3, 1, 2)


def inverse_gains(setup, recordings) -> np.ndarray:
    """1/g of simulated recordings, whatever contradicts itself in them."""
    table = setup.scenario.table.identification
    motions = [
        ObservedMotion(observe(each, setup.structure, table.observe), payload)
        for each, payload in zip(recordings, setup.mounted, strict=True)
    ]
    problem = Problem(setup.structure, tuple(motions), table.gains)
    return joint_by_joint_gains(problem).solution.inverse


@pytest.mark.parametrize("stream", ["white", "coloured"])
def test_the_predicted_deviation_is_that_of_drawn_noise(quick, stream):
    # At the full rate and at one in four; 120 draws, deviations of the deviation 6.5 %, bounds at four of them.
    settings = {**QUIET, f"{SENSORS}current_{stream}": 0.07, f"{SENSORS}coloured_cutoff_hz": 13.0}
    loud = setup_of(with_settings(quick, settings))
    linear, logs = Linearised.of(loud, 1), expected_logs(loud, 1)
    predicted = np.sqrt(linear.noise_variances(logs)[stream])
    coarse = Linearised.of(loud, 4)
    np.testing.assert_allclose(np.sqrt(coarse.noise_variances(expected_logs(loud, 4))[stream]), predicted, rtol=0.03)
    # 16 times 15 Hz from 1 kHz, and from 200 Hz.
    assert (enough(loud), enough(setup_of(with_settings(quick, {"experiment.controller.rate_hz": 200.0})))) == (4, 1)
    if stream == "white":  # whose draws are those of the coloured one without its filter
        return
    changes = []
    for seed in range(120):
        drawn = [
            logged(each.log.q, each.log.v, 1000.0, loud.experiments[0].sensors, noise).v - each.log.v
            for each, noise in zip(logs, motion_streams(seed, {}, 2), strict=True)
        ]
        changes.append(sum(np.einsum("tkj,tj->k", K, dv) for K, dv in zip(linear.weights, drawn, strict=True)))
    np.testing.assert_allclose(np.std(changes, axis=0), predicted, rtol=0.26)


@pytest.mark.parametrize(("lasting", "shared"), [(False, True), (True, False)])
def test_what_lasts_or_joints_share_is_one_draw_with_all_its_weights(rng, lasting, shared):
    K, by_position = rng.normal(size=(2, 5, 2, 3))
    q, v = rng.normal(size=(2, 3))
    noise = Noise(stream="new", q=q, v=v, lasting=lasting, shared=shared)
    shape = (-1, 1 if lasting else 5, 1, 1 if shared else 3)
    draws = np.eye((1 if lasting else 5) * (1 if shared else 3)).reshape(shape)
    found = [np.sum((K * v + by_position * q) * draw, axis=(0, 2)) for draw in draws]
    np.testing.assert_allclose(_variance(noise, K, by_position), np.sum(np.square(found), axis=0), rtol=1e-12)


def test_waves_of_positions_act_by_the_torque_of_their_accelerations(rich):
    linear, logs = Linearised.of(rich, 4), expected_logs(rich, 4)
    t, size = logs[0].log.t, 1e-6 * np.array([0.9, 0.4, 0.7, 1.3, 1.1, 0.6])
    waves = [size * np.sin(np.outer(t, 2.0 * np.pi * (f + np.arange(6))) + f) for f in (6.1, 7.3)]  # [Hz]
    moved = [
        [Recording(t, a.log.q + by * dq, a.log.v) for a, dq in zip(logs, waves, strict=True)] for by in (-1.0, 1.0)
    ]
    ends = [inverse_gains(rich, recordings) for recordings in moved]
    found = sum(
        np.einsum("tkj,tj->k", _by_position(K, experiment, logs[0].log.rate_hz, 15.0), dq)
        for K, experiment, dq in zip(linear.weights, rich.experiments, waves, strict=True)
    )
    expected = 0.5 * (ends[1] - ends[0])
    # Friction and gravity add up to a fifth at these frequencies; joint 6 carries next to no load.
    np.testing.assert_allclose(found[:5], expected[:5], rtol=0.25)
