from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from quick import two_sources

from scenarios.experiments.draws import settings_with, sources_of
from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.scenario_files import CATALOG
from scenarios.experiments.study import ALL, ALONE, NONE, SOBOL, sensitivity, study_identity
from scenarios.results.sensitivity import Budget, joint_budget, sobol_indices
from scenarios.support.errors import ScenarioError


def test_a_source_alone_moves_its_own_places_and_no_other(tmp_path):
    sources = sources_of(load_scenario(str(two_sources(tmp_path))))
    off = settings_with(sources, {})[0]
    heavy = settings_with(sources, {"mass": np.array([0.8])})[0]
    assert heavy["plant.payload.mass"] != off["plant.payload.mass"] == 7.025
    assert heavy["experiment.sensors.current_white"] == 0.0
    noisy, streams = settings_with(sources, {"white": np.array([0.25])})
    assert noisy == {"plant.payload.mass": 7.025, "experiment.sensors.current_white": 0.05}
    assert streams == {"white": 2**29}


def test_the_design_is_each_source_alone_then_saltelli_s_matrices(tmp_path):
    study = sensitivity(load_scenario(str(two_sources(tmp_path))), repeats=4, samples=8, seed=3)
    trials = [study.trial(number) for number in range(study.count)]
    labels = pd.DataFrame([trial.labels for trial in trials])
    counts = labels.value_counts(["design", "source"])
    assert [counts[ALONE, source] for source in (NONE, "mass", "white", ALL)] == [1, 4, 4, 16]
    assert [counts[SOBOL, source] for source in ("A", "B", "mass", "white")] == [8] * 4
    assert study.count == 1 + 2 * 4 + 16 + 4 * 8
    rows = {(t.labels["source"], t.labels["sample"]): t for t in trials if t.labels["design"] == SOBOL}
    for sample in map(str, range(8)):
        A, B, mass, white = (rows[source, sample] for source in ("A", "B", "mass", "white"))
        place = "plant.payload.mass"
        assert mass.settings[place] == B.settings[place] != A.settings[place] == white.settings[place]
        assert white.streams == B.streams != A.streams == mass.streams
    drawn = {(ALONE, "mass"), (ALONE, ALL), (SOBOL, "A"), (SOBOL, "B")}  # of which none repeats a number of another
    masses = [t.settings["plant.payload.mass"] for t in trials if (t.labels["design"], t.labels["source"]) in drawn]
    assert len(set(masses)) == len(masses) == 4 + 16 + 8 + 8


def test_numbers_that_are_no_power_of_two_are_refused():
    for number in (0, 1, 12, 2**17):
        with pytest.raises(ScenarioError, match=f"samples = {number}: expected a power of 2"):
            sensitivity(load_scenario("nominal"), repeats=4, samples=number, seed=0)


def test_sobol_indices_of_a_sum_and_a_product_are_the_known_ones(rng):
    # y = 2 a + b + c d with unit normal inputs: variance 4 + 1 + 1; c and d have total order 1/6 and no first order.
    def y(x: np.ndarray) -> np.ndarray:
        return 2 * x[:, 0] + x[:, 1] + x[:, 2] * x[:, 3]

    A, B = rng.normal(size=(2, 2**13, 4))
    AB = [y(np.where(np.arange(4) == k, B, A)) for k in range(4)]
    first, total = sobol_indices(y(A), y(B), np.array(AB), seed=0)
    # 8192 samples know an index to about 0.02; four of them.
    np.testing.assert_allclose([i.value for i in first], [4 / 6, 1 / 6, 0, 0], atol=0.08)
    np.testing.assert_allclose([i.value for i in total], [4 / 6, 1 / 6, 1 / 6, 1 / 6], atol=0.08)
    for index in (*first, *total):
        assert index.low <= index.value <= index.high


def test_the_interval_of_an_error_is_that_of_its_resamples():
    rows = pd.DataFrame({"joint": 1, "design": ALONE, "source": "tilt", "sample": 0, "rel_error": [0.01, -0.03]})
    rms = joint_budget(rows, 1, 0.05, ["tilt"], seed=3).costs[0].rms
    # A quarter of all resamples has the one error twice, a quarter the other.
    np.testing.assert_allclose([rms.value, rms.low, rms.high], [np.sqrt(5e-4), 0.01, 0.03], rtol=1e-12)


def test_the_budget_finds_the_costs_that_were_put_in(tmp_path):
    study, rows = sensitivity(load_scenario(str(two_sources(tmp_path))), repeats=64, samples=256, seed=1), []
    for trial in map(study.trial, range(study.count)):  # the mass error itself, and a hundredth of the noise's seed
        noise = (trial.streams["white"] / 2**31 - 0.5) if trial.streams else 0.0
        error = (trial.settings["plant.payload.mass"] - 7.025) + 0.01 * noise
        rows.append({"trial": trial.number, "joint": 1, **trial.labels, "rel_error": error})
    budget = joint_budget(pd.DataFrame(rows), 1, 0.03, ["mass", "white"], seed=0)
    mass, white = budget.costs
    assert (mass.source, white.source) == ("mass", "white")
    # Scrambled Sobol points of 64 are far better than random ones, which would know a deviation to 9 %.
    np.testing.assert_allclose(mass.rms.value, 0.1, rtol=0.05)
    np.testing.assert_allclose(white.rms.value, 0.01 / np.sqrt(12), rtol=0.05)
    np.testing.assert_allclose(budget.together, budget.summed, rtol=0.05)  # a sum of independent errors
    assert (budget.floor, budget.samples, budget.lost) == (0.0, 256, 0)
    np.testing.assert_allclose(mass.total.value, 1.0, atol=0.15)
    assert white.total.value < 0.01


def test_motions_that_a_source_chooses_from_are_part_of_the_study(tmp_path):
    motion = (CATALOG / "motions" / "drive-gains.toml").read_text()
    (tmp_path / "other.toml").write_text(motion)
    path = tmp_path / "chooses.toml"
    source = '[sources.motion]\ntarget = "experiment.motion"\nchoice = ["drive-gains", "other.toml"]\n'
    path.write_text((CATALOG / "nominal.toml").read_text().partition("# Error sources")[0] + source)
    study = sensitivity(load_scenario(str(path)), repeats=2, samples=2, seed=3)
    before = study_identity(study)
    (tmp_path / "other.toml").write_text(motion + "# another\n")
    assert study_identity(study) != before


def test_a_source_without_a_single_gain_is_silent_and_the_method_s_own_error_is_counted_once(tmp_path):
    # Errors of 0.3 % without any source: each source's own bias is what it adds to that.
    rows = pd.DataFrame(
        [
            {"joint": 2, "design": ALONE, "source": source, "sample": "0", "rel_error": error}
            for source, error in ((NONE, 0.003), (ALL, 0.02), ("mass", 0.013), ("white", np.nan), ("load", -0.004))
        ]
    )
    budget = joint_budget(rows, 2, 0.04, ["mass", "white", "load"], seed=0)
    assert (budget.silent, budget.lost, budget.floor) == (["white"], 1, 0.003)
    np.testing.assert_allclose(budget.summed, 0.003 + 0.010 - 0.007, rtol=1e-9)
    np.testing.assert_allclose([cost.share for cost in budget.costs], np.array([169, 16]) / 185, rtol=1e-12)
    assert joint_budget(rows.fillna(0.01), 2, 0.04, ["mass", "white", "load"], seed=0).silent == []
    rows = pd.concat([rows.assign(joint=j) for j in range(1, 7)])
    scenario = load_scenario(str(two_sources(tmp_path)))
    limits = scenario.table.tolerance.model_copy(update={"gain": (0.01, 0.02, 0.03, 0.04, 0.05, 0.06)})
    scenario = replace(scenario, table=scenario.table.model_copy(update={"tolerance": limits}))
    whole = Budget.of(scenario, 5, SimpleNamespace(table=lambda _: rows), seed=0)
    assert [(each.joint, each.tolerance) for each in whole.joints] == [(j, 0.01 * j) for j in range(1, 6)]  # not 6
