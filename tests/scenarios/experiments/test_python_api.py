import ast
import contextlib
import re
import shutil

import numpy as np
import pytest
from places import ROOT

import scenarios
from scenarios.cli import main
from scenarios.support.errors import ScenarioError, WrongValue

CUTOFF = "identification.observe.cutoff_hz"


@pytest.fixture(scope="module")
def quick(scenario) -> scenarios.LoadedScenario:
    return scenarios.load(scenario)


@pytest.mark.slow
def test_the_lines_of_the_readme_work_as_they_stand(tmp_path):
    shutil.copytree(ROOT / "rx90_mjcf", tmp_path / "rx90_mjcf")
    assert main(["run", "nominal", "--save", str(tmp_path / "cell")]) == 0
    (code,) = re.findall(r"^```python\n(.*?)^```$", (ROOT / "README.md").read_text(), re.MULTILINE | re.DOTALL)
    names, shown = dict[str, object](), []
    with contextlib.chdir(tmp_path):
        for node in ast.parse(code).body:
            if isinstance(node, ast.Expr):  # a line that shows a value
                shown.append(eval(compile(ast.Expression(node.value), "README.md", "eval"), names))
            else:
                exec(compile(ast.Module([node], []), "README.md", "exec"), names)
    (gain, std, diagnoses), ratio, run, trials, swept = shown
    assert gain.shape == std.shape == (6,)
    assert list(gain.mask) == list(std.mask) == [False] * 5 + [True]
    assert all(isinstance(each.sentence, str) for each in diagnoses)
    assert abs(ratio[:5] - 1.0).max() < 0.01  # a percent: what nominal promises
    assert run.verdict.passed
    assert len(trials) == 20 * 6
    assert sorted(set(swept[CUTOFF])) == [8.0, 15.0, 30.0]
    assert len(swept) == 3 * 20 * 6


@pytest.mark.usefixtures("_undiagnosed")
def test_a_seed_gives_the_same_logs_and_gains_whatever_is_called(quick):
    seed = 8
    s, run = quick.simulate(seed), quick.run(seed)
    for one, other in zip(s.recordings, run.recordings, strict=True):
        np.testing.assert_array_equal(one.v, other.v)
    np.testing.assert_array_equal(s.truth.gain, run.setup.true_gain)
    assert not np.array_equal(s.truth.gain, quick.setup.true_gain)  # drawn
    own = quick.monte_carlo(3, seed=6).to_frame().query(f"seed == {seed}")
    assert own["trial"].tolist() == [2] * 6
    assert own["estimate"].astype(object).replace({np.nan: None}).tolist() == [g.estimate for g in run.verdict.gains]


@pytest.mark.usefixtures("_undiagnosed")
def test_a_run_and_a_study_are_shown_as_their_pages_show_them(quick):
    run, study = quick.run(8), quick.monte_carlo(3, seed=6)
    frame = run.to_frame()
    np.testing.assert_allclose(
        frame["Error [%]"].astype(float),
        [np.nan if each.rel_error is None else 100.0 * each.rel_error for each in run.verdict.gains],
        rtol=1e-12,
    )
    (verdict,) = [part.text for part in run.result().parts() if getattr(part, "strong", False)]
    assert f"<p>{verdict}</p><table><tr><th>Joint</th><th>Injected [N m/unit]</th>" in run._repr_html_()
    assert run.plot().axes[0].get_title() == "Error of each gain, with its interval"
    assert (study.result().seed, study.result().trials, len(study.result().joints)) == (6, 3, 6)
    assert "<th>Bias [%]</th>" in study._repr_html_()
    assert repr(study) == repr(study.result()) == next(iter(study.result().parts())).text
    assert repr(study.result().joints[1]).startswith("JointStatistics(joint=2")
    assert repr(quick.arm) == "Arm 'rx90': joint1, joint2, joint3, joint4, joint5, joint6"
    assert study.plot().axes[0].get_title() == "Coverage of two estimated standard deviations"
    assert study.to_frame().attrs["units"]["std"] == "N (m)/unit"


@pytest.mark.usefixtures("_undiagnosed")
def test_a_sweep_is_every_combination_with_the_same_seeds(quick):
    mass = [6.9, 7.1]
    rows = quick.sweep({"observe.cutoff_hz": [9, 14], "plant.payload.mass": mass}, seeds=(4, 2)).to_frame()
    first = rows[rows["joint"] == 1]
    assert first[[CUTOFF, "plant.payload.mass", "seed"]].to_numpy().tolist() == [
        [cutoff, kg, seed] for cutoff in (9.0, 14.0) for kg in mass for seed in (4, 2)
    ]
    assert first["failure"].isna().all()
    drawn = first.groupby("seed")["plant.gain.1"].nunique()
    assert drawn.tolist() == [1, 1]  # what the scenario draws depends on the seed alone
    same = first[(first["plant.payload.mass"] == 7.1) & (first["seed"] == 2)]  # but for the cut-off
    assert (same["true"].nunique(), same["estimate"].nunique()) == (1, 2)


def test_a_study_of_what_is_not_there_or_does_not_fit_or_without_a_trial_is_refused_before_anything_runs(quick):
    for values, seeds, error, said in (
        ({"identification.observe.cutoff": [8]}, 1, ScenarioError, "no 'cutoff' in"),
        ({"mass": [7.0]}, 1, ScenarioError, "mass is ambiguous: plant"),
        ({"plant.payload.mass": [-2.0]}, 1, WrongValue, "greater than 0"),
        ({CUTOFF: []}, 2, ScenarioError, "has no trial"),
        ({CUTOFF: [9.0]}, 0, ScenarioError, "has no trial"),
    ):
        with pytest.raises(error, match=said):
            quick.sweep(values, seeds=seeds)
    with pytest.raises(ScenarioError, match="has no trial"):
        quick.monte_carlo(0)
