from dataclasses import replace

import numpy as np
import pytest
from printed import printed
from quick import quick_scenario
from scipy import stats

from ident.diagnosis.diagnose import horizon
from ident.estimation.estimators.ls_2011 import JointByJointOptions, joint_by_joint_gains
from ident.estimation.problem import ObservedMotion, Problem
from ident.observation.observation import observe
from ident.preparation import SIMULATED, prepare
from ident.support.errors import OptionError
from scenarios.cli import main
from scenarios.experiments.build import setup_of
from scenarios.experiments.files.loading import load_scenario
from scenarios.experiments.files.motions import write_motion
from scenarios.experiments.files.schema import DrawTable, Scenario, SourceTable
from scenarios.experiments.files.settings import with_method, with_settings
from scenarios.experiments.run import Trial, motion_streams, ready_trial, simulate, simulate_batch
from scenarios.prediction.budget import OTHER, PredictedBudget
from scenarios.prediction.budget import predicted_budget as budget_and_horizon
from scenarios.prediction.expected import enough, expected_logs, expected_preparation
from scenarios.prediction.linear import linearised
from scenarios.prediction.moments import Moments, points_of
from scenarios.reports.content import Mood
from scenarios.reports.predict import _within
from scenarios.support.errors import StudyError
from sim.sensors import logged
from sim.trajectory import at_rest

SENSORS = "experiment.sensors."
QUIET = {f"{SENSORS}{name}": 0.0 for name in ("encoder_quantum", "encoder_noise", "current_white", "current_coloured")}
COMPLIANCE = [1.3e-5, 1.4e-5, 3.5e-5, 5.2e-5, 7.8e-5, 1.6e-4]
ANY = "plant.payload.mass"


@pytest.fixture(scope="module")
def quick(tmp_path_factory) -> Scenario:
    return load_scenario(str(quick_scenario(tmp_path_factory.mktemp("quick"))))


@pytest.fixture(scope="module")
def rich(tmp_path_factory):
    """Without noise, with a motion of 10 s that shows every parameter of every joint."""
    folder = tmp_path_factory.mktemp("rich")
    rng = np.random.default_rng(8)
    sine, cosine = 0.3 / np.sqrt(np.arange(1.0, 9.0)) * rng.normal(size=(2, 6, 8))
    path = quick_scenario(folder)
    write_motion(at_rest(np.array([0.2, 0.1, 1.0, 0.1, 0.4, -0.2]), sine, cosine, 10.0), folder / "short.toml", [])
    return setup_of(with_settings(load_scenario(str(path)), QUIET))


@pytest.fixture(scope="module")
def quiet(quick):
    return setup_of(with_settings(quick, QUIET))


def sourced(scenario: Scenario, **sources: SourceTable) -> Scenario:
    return replace(scenario, table=scenario.table.model_copy(update={"sources": sources}))


def drawn(target, **more) -> SourceTable:
    return SourceTable(target=target, distribution=more.pop("distribution", "norm"), **more)


def predicted_budget(scenario: Scenario) -> PredictedBudget:
    budget, _ = budget_and_horizon(scenario)
    return budget


def cost_of(budget: PredictedBudget, source: str) -> Moments:
    costs = [next(cost for cost in joint.costs if cost.source == source) for joint in budget.joints]
    found = Moments(np.array([cost.bias for cost in costs]), np.array([cost.std for cost in costs]))
    np.testing.assert_allclose([cost.rms for cost in costs], found.rms, rtol=1e-15)
    return found


def sources_of_budget(budget: PredictedBudget) -> list[str]:
    (names,) = {tuple(cost.source for cost in joint.costs) for joint in budget.joints}
    return list(names)


def test_the_change_of_an_estimate_is_what_estimating_again_gives(quiet, quick):
    # Least squares are linear in the currents, and expected motions are the same: only rounding is between.
    settings = {
        "plant.errors.load_friction": 0.03,
        "plant.payload.mass": 7.3,
        "plant.gain": [-0.7, 1.1, 0.9, 1.3, 1, 2],
    }
    other = setup_of(with_settings(quick, {**QUIET, **settings}))
    one, two = linearised(quiet, 4), linearised(other, 4)
    found = one.change(expected_logs(other, 4), expected_logs(quiet, 4))
    expected = two.estimate.solution.inverse - one.estimate.solution.inverse
    assert np.abs(expected).min() > 1e-3
    np.testing.assert_allclose(found, expected, rtol=1e-8)


def test_a_delay_that_identification_undoes_is_undone_of_what_changes_too(quick):
    delay = {**QUIET, "identification.observe.current_delay": 0.0127}  # 12.7 samples of the controller, 3.2 of a log
    gains = {"plant.gain": [-0.7, 1.1, 0.9, 1.3, 1.7, 2.0]}
    one, other = (setup_of(with_settings(quick, each)) for each in (delay, {**delay, **gains}))
    linear = linearised(one, 4)
    found = linear.change(expected_logs(other, 4), expected_logs(one, 4))
    expected = linearised(other, 4).estimate.solution.inverse - linear.estimate.solution.inverse
    np.testing.assert_allclose(found, expected, rtol=1e-8)


def test_weights_are_the_change_of_an_estimate_by_each_sample(quiet, rng):
    linear = linearised(quiet, 4)
    logs = expected_logs(quiet, 4)
    added = [rng.normal(size=log.log.v.shape) for log in logs]
    weights = linear.weights(len(added[0]))
    found = sum(np.einsum("ktj,tj->k", K, dv) for K, dv in zip(weights, added, strict=True))
    changed = [replace(each, log=replace(each.log, v=each.log.v + dv)) for each, dv in zip(logs, added, strict=True)]
    np.testing.assert_allclose(found, linear.change(changed, logs), rtol=1e-9)  # rounding


def test_motions_that_are_estimated_in_another_order_than_that_of_time_are_changed_each_by_its_own(tmp_path, rng):
    path = quick_scenario(tmp_path)
    protocol = 'protocol = ["loaded", "bare", "bare", "loaded"]'
    path.write_text(path.read_text().replace("[experiment]", f"[experiment]\n{protocol}"))
    drift = {**QUIET, "plant.errors.coulomb_drift": -0.06, "plant.gain": [-0.7, 1.1, 0.9, 1.3, 1.7, 2.0]}
    one, other = (setup_of(with_settings(load_scenario(str(path)), each)) for each in (QUIET, drift))
    linear, logs = linearised(one, 4), expected_logs(one, 4)
    assert linear.places == (0, 3, 1, 2)
    expected = linearised(other, 4).estimate.solution.inverse - linear.estimate.solution.inverse
    np.testing.assert_allclose(linear.change(expected_logs(other, 4), logs), expected, rtol=1e-8)
    added = [rng.normal(size=log.log.v.shape) for log in logs]
    weights = linear.weights(len(added[0]))
    found = sum(np.einsum("ktj,tj->k", K, dv) for K, dv in zip(weights, added, strict=True))
    changed = [replace(each, log=replace(each.log, v=each.log.v + dv)) for each, dv in zip(logs, added, strict=True)]
    np.testing.assert_allclose(found, linear.change(changed, logs), rtol=1e-9)  # rounding


EFFECTS = {
    "load_friction": ({"load_friction": 0.03}, 0.05),
    "coulomb_drift": ({"coulomb_drift": -0.06}, 0.05),
    "viscous_drift": ({"viscous_drift": 0.07}, 0.05),
    "frames": ({"d3_error": 0.004, "r4_error": -0.006}, 0.05),
    "tilt": ({"base_tilt_x": 0.011, "base_tilt_y": -0.007}, 0.2),
    "elasticity": ({"joint_compliance": COMPLIANCE}, 0.25),
}
"""Sizes, and how far prediction and simulation may be apart as a share of the effect on the joint that it costs most;
more where the difference between real and perfect control matters."""


def inverse_gains(setup, recordings) -> np.ndarray:
    """1/g of simulated recordings, whatever contradicts itself in them."""
    table = setup.scenario.table.identification
    motions = [
        ObservedMotion(observe(each, setup.structure, table.observe), payload)
        for each, payload in zip(recordings, setup.mounted, strict=True)
    ]
    problem = Problem(setup.structure, tuple(motions), table.gains)
    return joint_by_joint_gains(problem, JointByJointOptions()).solution.inverse


def test_each_effect_biases_a_simulated_pair_by_what_is_predicted(rich):
    settings = {name: {f"plant.errors.{k}": v for k, v in errors.items()} for name, (errors, _) in EFFECTS.items()}
    settings["payload"] = {"plant.payload.mass": 7.14, "plant.payload.com": [0.004, -0.003, 0.147]}
    setups = {name: setup_of(with_settings(rich.scenario, each)) for name, each in settings.items()}
    linear, base = linearised(rich, 4), expected_logs(rich, 4)
    trials = [ready_trial(each, Trial(seed=k)) for k, each in enumerate((rich, *setups.values()))]
    outcomes = dict(simulate_batch(trials, threads=1))
    inverse = [inverse_gains(rich, outcomes[k].recordings)[:5] for k in range(len(outcomes))]
    for (name, each), simulated in zip(setups.items(), inverse[1:], strict=True):
        relative = simulated / inverse[0] - 1.0
        found = linear.change(expected_logs(each, 4), base)[:5] * rich.true_gain[:5]
        share = EFFECTS[name][1] if name in EFFECTS else 0.05
        assert np.abs(relative).max() > 2e-3, name
        atol = 5e-4 + share * np.abs(relative).max()
        np.testing.assert_allclose(found, relative, rtol=0, atol=atol, err_msg=name)


@pytest.mark.parametrize("stream", ["white", "coloured", "current_sensor"])
def test_the_predicted_deviation_is_that_of_drawn_noise(quick, stream):
    # At the full rate and at one in four; 300 draws, deviations of the deviation 4 %, bounds at four of them.
    sizes = {
        "current_sensor": {f"{SENSORS}current_gain_error": 0.005, f"{SENSORS}current_offset": 0.003},
    }.get(stream, {f"{SENSORS}current_{stream}": 0.07})
    settings = {**QUIET, **sizes, f"{SENSORS}coloured_cutoff_hz": 13.0}
    loud = setup_of(with_settings(quick, settings))
    linear, logs = linearised(loud, 1), expected_logs(loud, 1)
    predicted = np.sqrt(linear.noise_variances(logs)[stream])
    coarse = linearised(loud, 4)
    rtol = 0.1 if stream == "current_sensor" else 0.03  # what lasts is the sum of all weights, of either sign
    np.testing.assert_allclose(np.sqrt(coarse.noise_variances(expected_logs(loud, 4))[stream]), predicted, rtol=rtol)
    weights = linear.weights(len(logs[0].log.t))
    changes = []
    for seed in range(300):
        drawn = [
            logged(each.log.q, each.log.v, 1000.0, loud.experiments[0].sensors, noise).v - each.log.v
            for each, noise in zip(logs, motion_streams(seed, {}, 2), strict=True)
        ]
        changes.append(sum(np.einsum("ktj,tj->k", K, dv) for K, dv in zip(weights, drawn, strict=True)))
    np.testing.assert_allclose(np.std(changes, axis=0), predicted, rtol=0.17)


def test_a_delay_and_noise_are_both_seen_where_logs_are_thinned(quick):
    assert enough(setup_of(quick)) == 4  # 16 times 15 Hz from 1 kHz
    slow = setup_of(with_settings(quick, {"experiment.controller.rate_hz": 200.0}))
    assert enough(slow) == 1


def test_a_payload_heavier_by_a_share_than_believed_makes_every_gain_as_much_smaller(quick):
    body = "plant.payload.inertia."
    whole = drawn(
        ["plant.payload.mass", f"{body}ixx", f"{body}iyy", f"{body}izz"],
        parameters={"loc": 1.04, "scale": 0.01},
        apply="multiply",
        shared=True,
    )
    cost = cost_of(predicted_budget(sourced(quick, heavy=whole)), "heavy")
    # g_estimate / g = 1 / share; the filters and splines of the expected motion leave 1e-4 of an effect.
    np.testing.assert_allclose(cost.bias, 1.0 / 1.04 - 1.0, rtol=2e-4)
    np.testing.assert_allclose(cost.std, 1.0 / 1.04 - 1.0 / 1.05, rtol=2e-4)
    np.testing.assert_allclose(cost.rms, np.hypot(1.0 - 1.0 / 1.04, 1.0 / 1.04 - 1.0 / 1.05), rtol=2e-4)


def test_what_is_believed_is_estimated_again_and_gives_the_opposite(quick):
    parameters = {"loc": 0.0, "scale": 0.002}
    truth = drawn("plant.payload.com", parameters=parameters, apply="add")
    budget = predicted_budget(
        sourced(
            quick, truth=truth, cut=drawn("identification.observe.cutoff_hz", parameters={"loc": 15.0, "scale": 1.0})
        )
    )
    assert (cost_of(budget, "cut").bias == 0.0).all()
    assert (cost_of(budget, "cut").std > 0.0).all()
    assert (cost_of(budget, "cut").std < 4e-3).all()  # other rows are left out near reversals
    assert (cost_of(budget, "truth").std > 4e-3).any()


def test_true_gains_that_differ_cost_nothing(quick):
    gains = drawn("plant.gain", parameters={"loc": 1.0, "scale": 0.1}, apply="multiply")
    cost = cost_of(predicted_budget(sourced(quick, gains=gains)), "gains")
    np.testing.assert_allclose(cost.rms, 0.0, atol=1e-4)  # an estimate follows its currents; filters leave 1e-5


def test_sources_add_by_sign_and_by_variance_and_noise_that_is_none_is_told(quick):
    load = drawn("plant.errors.load_friction", distribution="uniform", parameters={"scale": 0.04})
    drift = drawn("plant.errors.coulomb_drift", parameters={"loc": 0.01, "scale": 0.02})
    white = SourceTable(target=f"{SENSORS}current_white", stream="white", off=0.0)
    budget = predicted_budget(sourced(quick, load=load, drift=drift, white=white))
    assert set(sources_of_budget(budget)) == {"load", "drift", "white", OTHER}
    a, b, c, d = (cost_of(budget, name) for name in ("load", "drift", "white", OTHER))
    bias, std = (np.array([getattr(joint.together, name) for joint in budget.joints]) for name in ("bias", "std"))
    np.testing.assert_allclose(bias, a.bias + b.bias, rtol=1e-12)
    total = a.std**2 + b.std**2 + c.std**2 + d.std**2
    np.testing.assert_allclose(std**2, total, rtol=1e-12)
    assert (c.bias == 0.0).all()
    assert (c.std > 0.0).all()
    # Mean and deviation of an even draw up to 4 % are 2 and 4 / sqrt(12) %. The effect is in proportion but for the
    # share of friction that friction itself asks for, some per cent.
    np.testing.assert_allclose(a.std / np.abs(a.bias), 1.0 / np.sqrt(3.0), rtol=0.1)
    tolerance = np.array([joint.tolerance for joint in budget.joints])
    upper, lower = ((sign * tolerance - bias) / std for sign in (1.0, -1.0))
    within = [joint.within for joint in budget.joints]
    np.testing.assert_allclose(within, stats.norm.cdf(upper) - stats.norm.cdf(lower), rtol=1e-9)
    worst = [cost_of(budget, name).rms.max() for name in sources_of_budget(budget)]
    assert worst == sorted(worst, reverse=True)


def test_a_choice_counts_each_of_its_values_alike(quick):
    one, both = (
        SourceTable(target="plant.errors.load_friction", choice=choice) for choice in ((0.03,), (0.0, 0.03, 0.03))
    )
    budget = predicted_budget(sourced(quick, one=one, both=both))
    single, three = cost_of(budget, "one"), cost_of(budget, "both")
    np.testing.assert_allclose(single.std, 0.0, atol=1e-12)
    np.testing.assert_allclose(three.bias, 2.0 / 3.0 * single.bias, rtol=1e-9)
    np.testing.assert_allclose(three.std, np.sqrt(2.0) / 3.0 * np.abs(single.bias), rtol=1e-9)


def test_what_cannot_be_predicted_is_named_with_the_reason(quick):
    loop = drawn("experiment.controller.bandwidth_hz", parameters={"loc": 8.0, "scale": 1.0})
    wild = drawn("plant.errors.coulomb_drift", distribution="cauchy", parameters={"scale": 0.01})
    budget = predicted_budget(sourced(quick, loop=loop, wild=wild))
    told = {each["source"]: each["reason"] for each in budget.unpredicted}
    assert told["loop"].startswith("experiment.controller.bandwidth_hz: control is assumed perfect")
    assert "distribution cauchy with these parameters has no finite mean or standard deviation" in told["wild"]
    assert sources_of_budget(budget) == [OTHER]


def test_noise_that_is_on_and_has_neither_source_nor_spectrum_is_named(quick):
    load = drawn("plant.errors.load_friction", distribution="uniform", parameters={"scale": 0.04})
    settings = {f"{SENSORS}clock_offset": 0.002, f"{SENSORS}samples_lost": 0.05}
    budget = predicted_budget(with_settings(sourced(quick, load=load), settings))
    assert [tuple(each.values()) for each in budget.unpredicted] == [
        (OTHER, "no first-order model for drive_clocks"),
        (OTHER, "no first-order model for samples"),
    ]


def test_a_source_that_draws_how_strong_a_noise_is_costs_something_unknown_and_not_nothing(quick):
    load = drawn("plant.errors.load_friction", distribution="uniform", parameters={"scale": 0.04})
    white = drawn(f"{SENSORS}current_white", distribution="uniform", parameters={"scale": 0.03})
    lost = drawn(f"{SENSORS}samples_lost", distribution="uniform", parameters={"scale": 0.03})
    encoder = drawn(f"{SENSORS}encoder_noise", distribution="uniform", parameters={"scale": 3e-5})
    budget = predicted_budget(sourced(quick, load=load, white=white, lost=lost, encoder=encoder))
    assert sources_of_budget(budget) == [OTHER, "load"]
    reason = "it varies the level of a noise, {}; declare the noise itself as a source (key stream)"
    assert [tuple(each.values()) for each in budget.unpredicted] == [
        ("white", reason.format("white")),
        ("lost", reason.format("samples")),
        ("encoder", reason.format("encoder")),
    ]


def test_options_overlay_a_scenario_s_own_and_are_checked_together(quick):
    stated = with_method(quick, "nls", ["gain-joint=2", "gain_value=0.7", "friction=viscous-coulomb"])
    other = with_method(stated, None, ["gain-joint=3"]).table.identification
    assert other.options == {"gain_joint": 3, "gain_value": 0.7, "friction": "viscous-coulomb"}
    assert with_method(stated, "nls", ["friction=cbrt"]).table.identification.options == {"friction": "cbrt"}
    with pytest.raises(OptionError, match="unknown option 'gain_joints'"):
        with_method(stated, None, ["gain-joints=3"])


def test_scenarios_without_sources_or_first_order_are_refused(quick):
    with pytest.raises(StudyError, match="declares no error sources"):
        predicted_budget(sourced(quick))
    with pytest.raises(StudyError, match="method tls-2014: its second-order bias from noise is not predicted"):
        predicted_budget(with_method(quick, "tls-2014", []))


def test_the_points_of_a_draw_are_at_its_mean_and_one_deviation_from_there(quick):
    table = quick.table

    def points(**draw):
        return points_of(DrawTable(**draw), table)

    even = points(target="plant.errors.stribeck", distribution="uniform", parameters={"loc": 0.1, "scale": 0.3})
    assert even.at[0] == {"plant.errors.stribeck": 0.25}
    np.testing.assert_allclose(even.at[1]["plant.errors.stribeck"], 0.25 + 0.3 / np.sqrt(12.0), rtol=1e-12)
    com = points(target="plant.payload.com", distribution="norm", parameters={"loc": 0.01, "scale": 0.002}, apply="add")
    z = 0.142776
    np.testing.assert_allclose(com.at[0]["plant.payload.com"], [0.01, 0.01, z + 0.01], rtol=1e-12)
    steps = np.array([each["plant.payload.com"] for each in com.at[1:]]) - com.at[0]["plant.payload.com"]
    np.testing.assert_allclose(steps, 0.002 * np.eye(3), atol=1e-15)
    both = points(
        target=["plant.payload.mass", "plant.gain"],
        distribution="norm",
        parameters={"loc": 1.1, "scale": 0.2},
        apply="multiply",
        shared=True,
    )
    (_, step) = both.at
    gain = np.array(table.plant.gain)
    np.testing.assert_allclose(both.at[0]["plant.payload.mass"], 1.1 * 7.025, rtol=1e-12)
    np.testing.assert_allclose(step["plant.payload.mass"], 1.3 * 7.025, rtol=1e-12)
    np.testing.assert_allclose(step["plant.gain"], 1.3 * gain, rtol=1e-12)
    each = points(target="plant.gain", distribution="norm", parameters={"loc": [1, 2, 3, 4, 5, 6], "scale": 0.5})
    np.testing.assert_allclose(each.at[0]["plant.gain"], [1, 2, 3, 4, 5, 6], rtol=1e-12)
    assert len(each.at) == 7
    with pytest.raises(StudyError, match="no finite mean or standard deviation"):
        points(target=ANY, distribution="cauchy")


def test_what_motions_will_exclude_is_what_their_logs_exclude():
    setup = setup_of(load_scenario("nominal"))
    logged = horizon(prepare(simulate(setup, 7).logs, setup.structure, policy=SIMULATED).logs())
    expected = horizon(expected_preparation(setup, enough(setup)).logs())
    assert (
        expected.indistinguishable[:3]
        == logged.indistinguishable[:3]
        == ("zero of q1", "zero of q5 off by half a turn", "sign and zero of q6")
    )
    sizes, found = ({each.family: each for each in one.excluded} for one in (expected, logged))
    assert set(sizes) == set(found)
    assert sizes["sign"].joints == found["sign"].joints == (0, 1, 2, 3, 4)
    for name in ("zero", "lengths", "clock"):
        assert sizes[name].joints == found[name].joints, name
        assert 0.4 < sizes[name].limit / found[name].limit < 2.5, name  # of 240 samples a second, and other noise


@pytest.mark.parametrize(
    ("share", "mood"), [(0.951, Mood.GOOD), (0.949, Mood.DOUBTFUL), (0.501, Mood.DOUBTFUL), (0.499, Mood.BAD)]
)
def test_a_share_of_runs_within_the_tolerance_is_good_from_95_per_cent_and_bad_below_half(share, mood):
    assert _within(share).mood is mood


def test_the_command_tells_table_and_json(tmp_path, capsys, monkeypatch):
    path, predicted = quick_scenario(tmp_path), list[tuple]()

    def once(scenario: Scenario) -> tuple:
        predicted.extend(() if predicted else [budget_and_horizon(scenario)])
        return predicted[0]

    monkeypatch.setattr("scenarios.prediction.budget.predicted_budget", once)
    assert main(["predict", str(path), "--method", "nls", "--option", "friction=viscous-coulomb", "--json"]) == 0
    told = printed(capsys, "predict")
    assert told["method"] == "nls"
    assert [joint["joint"] for joint in told["joints"]] == [1, 2, 3, 5]
    costs = {cost["source"]: cost for cost in told["joints"][1]["costs"]}
    without = {"clocks of drives", "lost and repeated samples"}
    assert {each["source"] for each in told["unpredicted"]} == without
    assert set(costs) == set(load_scenario("nominal").table.sources) - without
    for joint in told["joints"]:
        together = joint["together"]
        np.testing.assert_allclose(together["rms"], np.hypot(together["bias"], together["std"]), rtol=1e-12)
        np.testing.assert_allclose(together["bias"], sum(cost["bias"] for cost in joint["costs"]), rtol=1e-9)
    assert main(["predict", str(path), "--method", "nls", "--option", "friction=viscous-coulomb"]) == 0
    text = capsys.readouterr().out
    assert "Predicted error budget of scenario" in text
    assert f"Logs of these motions will exclude: {'; '.join(each['sentence'] for each in told['excluded'])}." in text
    assert f"They will not determine: {'; '.join(told['untold'])}." in text
    (row,) = [line.split() for line in text.splitlines() if line.strip().startswith("payload mass ")]
    (k,) = [k for k, cost in enumerate(told["joints"][0]["costs"]) if cost["source"] == "payload mass"]
    assert row == ["payload", "mass", *(f"{100 * joint['costs'][k]['rms']:.3f}" for joint in told["joints"])]
    assert "nothing was simulated" in text
