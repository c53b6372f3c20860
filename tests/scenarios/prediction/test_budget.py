"""The predicted error budget: what each source costs, all together, what is not predicted; and its command."""

from dataclasses import replace

import numpy as np
import pytest
from printed import printed
from quick import SENSORS, quick_scenario
from scipy import stats

from ident.diagnosis.diagnose import horizon
from ident.preparation import SIMULATED, prepare
from scenarios.cli import main
from scenarios.experiments.run import simulate
from scenarios.experiments.scenario import load_scenario, with_settings
from scenarios.experiments.schema import Scenario, SourceTable
from scenarios.experiments.setup import setup_of
from scenarios.prediction.budget import OTHER, PredictedBudget
from scenarios.prediction.budget import predicted_budget as budget_and_horizon
from scenarios.prediction.expected import enough, expected_preparation
from scenarios.prediction.moments import Moments
from scenarios.support.errors import StudyError


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


def test_a_noise_costs_what_it_has_beyond_that_which_is_left_when_it_is_off(quick):
    level = quick.table.experiment.sensors.current_white
    target = f"{SENSORS}current_white"
    whole, part = (
        cost_of(predicted_budget(sourced(quick, white=SourceTable(target=target, stream="white", off=off))), "white")
        for off in (0.0, 0.6 * level)
    )
    np.testing.assert_allclose(part.std, 0.8 * whole.std, rtol=1e-9)  # 1 - 0.6^2 of the variance


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


def test_scenarios_without_sources_are_refused(quick):
    with pytest.raises(StudyError, match="declares no error sources"):
        predicted_budget(sourced(quick))


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
