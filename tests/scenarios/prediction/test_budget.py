from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from printed import printed
from quick import SENSORS, quick_scenario
from scipy import stats

from scenarios.cli import main
from scenarios.experiments.scenario import load_scenario, with_settings
from scenarios.experiments.schema import DrawTable, Scenario, SourceTable
from scenarios.prediction.budget import OTHER, PredictedBudget, moments, predicted_budget
from scenarios.support.errors import ScenarioError

FRICTION, DRIFT = "plant.errors.load_friction", "plant.errors.coulomb_drift"
WHITE = f"{SENSORS}current_white"


def sourced(scenario: Scenario, **sources: SourceTable) -> Scenario:
    return replace(scenario, table=scenario.table.model_copy(update={"sources": sources}))


def drawn(target, **more) -> SourceTable:
    return SourceTable(target=target, distribution=more.pop("distribution", "norm"), **more)


def even(target: str, scale: float) -> SourceTable:
    return drawn(target, distribution="uniform", parameters={"scale": scale})


def cost_of(budget: PredictedBudget, source: str) -> SimpleNamespace:
    costs = [next(cost for cost in joint.costs if cost.source == source) for joint in budget.joints]
    return SimpleNamespace(**{k: np.array([getattr(cost, k) for cost in costs]) for k in ("bias", "std", "rms")})


@pytest.fixture(scope="module")
def budget(quick) -> PredictedBudget:
    whole = ["plant.payload.mass", *(f"plant.payload.inertia.{axis}" for axis in ("ixx", "iyy", "izz"))]
    tenth = {"parameters": {"loc": 1.0, "scale": 0.1}}
    sources = {
        "heavy": drawn(whole, parameters={"loc": 1.04, "scale": 0.01}, apply="multiply", shared=True),
        "gains": drawn("plant.gain", apply="multiply", **tenth),
        "gains as believed": drawn(["plant.gain", "belief.controller_gain"], apply="multiply", shared=True, **tenth),
        "centre": drawn("plant.payload.com", parameters={"loc": 0.0, "scale": 0.002}, apply="add"),
        "cut": drawn("identification.observe.cutoff_hz", parameters={"loc": 15.0, "scale": 1.0}),
        "load": even(FRICTION, 0.04),
        "drift": drawn(DRIFT, parameters={"loc": 0.01, "scale": 0.02}),
        "one": SourceTable(target=FRICTION, choice=(0.03,)),
        "three": SourceTable(target=FRICTION, choice=(0.0, 0.03, 0.03)),
        "white": SourceTable(target=WHITE, stream="white", off=0.0),
        "loop": drawn("experiment.controller.bandwidth_hz", parameters={"loc": 8.0, "scale": 1.0}),
        "wild": drawn(DRIFT, distribution="cauchy", parameters={"scale": 0.01}),
    }
    return predicted_budget(sourced(quick, **sources))


def test_errors_of_a_payload_of_gains_and_of_beliefs_are_those_of_closed_forms(budget):
    heavy = cost_of(budget, "heavy")
    # g_estimate / g = 1 / share; the filters and splines of the expected motion leave 1e-4 of an effect.
    np.testing.assert_allclose(heavy.bias, 1.0 / 1.04 - 1.0, rtol=2e-4)
    np.testing.assert_allclose(heavy.std, 1.0 / 1.04 - 1.0 / 1.05, rtol=2e-4)
    for name in ("gains", "gains as believed"):  # an estimate follows its currents
        np.testing.assert_allclose(cost_of(budget, name).rms, 0.0, atol=1e-4)
    cut, white = (cost_of(budget, name) for name in ("cut", "white"))
    assert ((cut.std > 0.0) & (cut.std < 4e-3)).all()  # other rows are left out near reversals
    assert ((white.std > 0.0) & (white.bias == 0.0) & (cut.bias == 0.0)).all()
    assert (cost_of(budget, "centre").std > 4e-3).any()
    single, three, load = (cost_of(budget, name) for name in ("one", "three", "load"))
    np.testing.assert_allclose(single.std, 0.0, atol=1e-12)
    np.testing.assert_allclose(three.bias, 2.0 / 3.0 * single.bias, rtol=1e-9)
    np.testing.assert_allclose(three.std, np.sqrt(2.0) / 3.0 * np.abs(single.bias), rtol=1e-9)
    # Mean and deviation of an even draw up to 4 % are 2 and 4 / sqrt(12) %. The effect is in proportion but for the
    # share of friction that friction itself asks for, some per cent.
    np.testing.assert_allclose(load.std / np.abs(load.bias), 1.0 / np.sqrt(3.0), rtol=0.1)


def test_the_budget_is_charted_and_framed_by_source(budget):
    frame, (axes,) = budget.to_frame().set_index("Source"), budget.plot().axes
    largest = [cost.source for cost in budget.joints[0].costs][:4]
    assert [bars.get_label() for bars in axes.containers] == largest
    for bars in axes.containers:
        heights = [bar.get_height() for bar in bars]
        np.testing.assert_allclose(heights, 100.0 * cost_of(budget, bars.get_label()).rms, rtol=1e-12)
        np.testing.assert_allclose(heights, frame.loc[bars.get_label()].astype(float), rtol=1e-12)
    assert frame.columns.tolist() == [f"Joint {each.joint} [%]" for each in budget.joints]


def test_sources_add_by_sign_and_by_variance_and_the_largest_is_first(budget):
    names = [cost.source for cost in budget.joints[0].costs]
    each = [cost_of(budget, name) for name in names]
    bias, std = (np.array([getattr(joint.together, name) for joint in budget.joints]) for name in ("bias", "std"))
    np.testing.assert_allclose(bias, sum(cost.bias for cost in each), rtol=1e-12)
    np.testing.assert_allclose(std**2, sum(cost.std**2 for cost in each), rtol=1e-12)
    tolerance = np.array([joint.tolerance for joint in budget.joints])
    upper, lower = ((sign * tolerance - bias) / std for sign in (1.0, -1.0))
    within = [joint.within for joint in budget.joints]
    np.testing.assert_allclose(within, stats.norm.cdf(upper) - stats.norm.cdf(lower), rtol=1e-9)
    worst = [cost.rms.max() for cost in each]
    assert worst == sorted(worst, reverse=True)


def test_a_noise_that_is_not_silent_when_off_costs_what_it_adds(quick):
    sources = (SourceTable(target=WHITE, stream="white", off=off) for off in (0.0, 0.03))
    silent, quiet = (predicted_budget(sourced(quick, white=source)) for source in sources)
    whole, added = (cost_of(each, "white").std for each in (silent, quiet))
    np.testing.assert_allclose(added, 0.8 * whole, rtol=1e-9)  # 0.05^2 - 0.03^2 = (0.8 * 0.05)^2
    others, left = (cost_of(each, OTHER).std for each in (silent, quiet))
    np.testing.assert_allclose(left**2, others**2 + (0.6 * whole) ** 2, rtol=1e-9)


def test_sources_that_cannot_be_predicted_are_named_with_the_reason(budget, quick):
    levels = {name: even(f"{SENSORS}{name}", 0.03) for name in ("current_white", "samples_lost")}
    levels["encoder_noise"] = even(f"{SENSORS}encoder_noise", 3e-5)
    loud = predicted_budget(sourced(quick, load=even(FRICTION, 0.04), **levels))
    assert [cost.source for cost in loud.joints[0].costs] == [OTHER, "load"]
    assert budget.remarks[-1].endswith("(the order bare, loaded, loaded, bare measures a change)")
    reasons = {each["source"]: each["reason"] for each in (*budget.unpredicted, *loud.unpredicted)}
    assert list(reasons) == ["loop", "wild", *levels]
    assert not {*reasons} & {cost.source for cost in budget.joints[0].costs}
    assert reasons["loop"].startswith("experiment.controller.bandwidth_hz: control is assumed perfect")
    assert "distribution cauchy" in reasons["wild"]
    for name, stream in zip(levels, ("white", "samples", "encoder"), strict=True):
        assert reasons[name].startswith(f"it varies the level of a noise, {stream};")
    settings = {f"{SENSORS}clock_offset": 0.002, f"{SENSORS}samples_lost": 0.05}
    unknown = predicted_budget(with_settings(sourced(quick, load=even(FRICTION, 0.04)), settings)).unpredicted
    assert [tuple(each.values()) for each in unknown] == [
        (OTHER, "no first-order model for drive_clocks"),
        (OTHER, "no first-order model for samples"),
    ]
    with pytest.raises(ScenarioError, match="declares no error sources"):
        predicted_budget(sourced(quick))


def test_a_source_that_is_not_predicted_at_its_median_leaves_the_others(quick):
    soft = even("plant.errors.joint_compliance", 0.01)  # of springs that the payload brings near the motion
    mass = drawn("plant.payload.mass", parameters={"loc": 1.03, "scale": 0.01}, apply="multiply")
    found = predicted_budget(sourced(quick, soft=soft, mass=mass))
    assert [each["source"] for each in found.unpredicted] == ["soft"]
    assert "near its resonance" in found.unpredicted[0]["reason"]
    np.testing.assert_allclose(cost_of(found, "mass").bias, 1.0 / 1.03 - 1.0, atol=3e-3)


def test_the_command_prints_table_and_json(tmp_path, capsys, monkeypatch):
    path, predicted = quick_scenario(tmp_path), list[PredictedBudget]()
    path.write_text(path.read_text().replace("step = 0.002", "step = 0.001"))  # for its elastic transmissions

    def once(scenario: Scenario) -> PredictedBudget:
        predicted.extend(() if predicted else [predicted_budget(scenario)])
        return predicted[0]

    monkeypatch.setattr("scenarios.prediction.budget.predicted_budget", once)
    words = ["predict", str(path), "--method", "nls", "--option", "friction=viscous-coulomb"]
    found = printed(capsys, "predict", [*words])
    assert found["method"] == "nls"
    assert [joint["joint"] for joint in found["joints"]] == [1, 2, 3, 5]
    without = {"clocks of drives", "lost and repeated samples"}
    assert {each["source"] for each in found["unpredicted"]} == without
    costs = {cost["source"] for cost in found["joints"][1]["costs"]}
    assert costs == set(load_scenario("nominal").table.sources) - without
    assert main([*words, "--format", "markdown"]) == 0
    rows = capsys.readouterr().out
    assert all(f"| {each['sentence']} | excluded |" in rows for each in found["excluded"])
    assert all(f"| {each} | not revealed |" in rows for each in found["untold"])
    assert main(words) == 0
    text = capsys.readouterr().out
    count = len(found["excluded"]) + len(found["untold"])
    assert f"{count} kinds of faults that logs of these motions exclude or cannot reveal" in text
    (row,) = [line.split() for line in text.splitlines() if line.strip().startswith("payload mass ")]
    (k,) = [k for k, cost in enumerate(found["joints"][0]["costs"]) if cost["source"] == "payload mass"]
    rms = [np.hypot(joint["costs"][k]["bias"], joint["costs"][k]["std"]) for joint in found["joints"]]
    assert row == ["payload", "mass", *(f"{100 * each:.3f}" for each in rms)]


def test_each_number_of_a_draw_moves_by_itself_one_deviation_from_its_mean(quick):
    com = {"target": "plant.payload.com", "distribution": "norm", "parameters": {"loc": 0.01, "scale": 0.002}}
    seen = list[np.ndarray]()

    def error(settings) -> np.ndarray:
        seen.append(np.array(settings["plant.payload.com"]))
        return np.array([3.0, -7.0, 2.0]) * (seen[-1] - seen[0]) + 0.3

    bias, std = moments(DrawTable(**com, apply="add"), quick.table, error)
    np.testing.assert_allclose(seen[0], [0.01, 0.01, 0.142776 + 0.01], rtol=1e-12)
    np.testing.assert_allclose(np.array(seen[1:]) - seen[0], 0.002 * np.eye(3), atol=1e-15)
    np.testing.assert_allclose(bias, 0.3, rtol=1e-12)
    np.testing.assert_allclose(std, 0.002 * np.array([3.0, 7.0, 2.0]), rtol=1e-9)
