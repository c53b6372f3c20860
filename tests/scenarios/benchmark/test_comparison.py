import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from bad_files import refused
from here import HERE
from method_rows import told
from page_parts import tables
from places import ROOT
from printed import printed
from rich.console import Console

from scenarios.benchmark.comparison import ComparedScenario, Comparison, compared, page
from scenarios.benchmark.methods import Call, Limits, Method, method_of, python_answer, read_answer
from scenarios.benchmark.study import METHOD, comparison
from scenarios.experiments.loaded_scenario import load
from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.study import carry_out, study_identity
from scenarios.rendering.content import Mood
from scenarios.support.errors import ScenarioError

pytestmark = pytest.mark.usefixtures("_all_undiagnosed")
LIMITS = Limits(time_s=60.0)
STUBS = ("method_stubs:least_squares", "method_stubs:constant", "method_stubs:refuses", "method_stubs:raises")


def called_here(method: Method, folder: Path, joints: int, limits: Limits) -> Call:
    """A call in this process, which takes no second to start."""
    try:
        outcome = read_answer(json.dumps(python_answer(method.text, folder)).encode(), joints)
    except ValueError as error:
        outcome = ScenarioError(str(error), kind="MethodCrashed")
    return Call(outcome=outcome, seconds=0.7)


@pytest.fixture(scope="module", autouse=True)
def _calls_in_this_process():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("scenarios.benchmark.study.call", called_here)
        yield


def study(scenario, count: int, *texts: str):
    return comparison(load_scenario(str(scenario)), [method_of(text) for text in texts], LIMITS, count, seed=5)


@pytest.fixture(scope="module")
def rows(scenario, tmp_path_factory) -> pd.DataFrame:
    folder = tmp_path_factory.mktemp("compared") / "study"
    return carry_out(study(scenario, 3, *STUBS), folder, HERE, command="", console=Console(quiet=True)).table()


def test_a_method_is_given_what_a_run_of_that_seed_records(rows, scenario):
    own = rows[(rows[METHOD] == STUBS[0]) & rows["seconds"].notna()]
    trial = int(own["trial"].iloc[0])
    run = load(str(scenario)).run(5 + trial)
    for verdict, row in zip(run.verdict.gains, own[own["trial"] == trial].itertuples(), strict=True):
        assert (row.seed, row.true, row.identifiable) == (5 + trial, verdict.true, verdict.identifiable)
        if verdict.estimate is not None:
            np.testing.assert_allclose([row.estimate, row.std], [verdict.estimate, verdict.std], rtol=1e-12)
            assert row.passed == verdict.passed


def test_a_crash_is_rows_with_a_failure_and_a_trial_that_cannot_be_simulated_no_method_s_fault(rows):
    assert len(rows) == 3 * len(STUBS) * 6
    assert rows["expected"].tolist() == [True, True, True, False, True, False] * (3 * len(STUBS))
    posed = rows[rows["seconds"].notna()]
    crashed = posed[posed[METHOD] == "method_stubs:raises"][["failure", "reason", "passed"]]
    assert set(crashed.itertuples(index=False, name=None)) == {("MethodCrashed", "what is this?", False)}
    refused = posed[posed[METHOD] == "method_stubs:refuses"]
    assert refused["failure"].isna().all()
    assert (refused["passed"] == ~refused["expected"]).all()
    assert set(refused["reason"]) == {"I dare not"}
    unposed = rows[rows["seconds"].isna()]
    assert 0 < unposed["trial"].nunique() < 3  # a payload of 95 kg
    assert unposed["failure"].notna().all()
    assert len(unposed) % (6 * len(STUBS)) == 0


def test_other_methods_other_limits_and_changed_files_are_another_study(scenario):
    loaded, method = load_scenario(str(scenario)), method_of(STUBS[1])
    edited = replace(method, digests=(("method_stubs.py", "0" * 16),))
    others = [([method_of(STUBS[2])], LIMITS), ([method], Limits(time_s=61.0)), ([edited], LIMITS)]
    identity = study_identity(study(scenario, 1, STUBS[1]))
    for methods, limits in others:
        assert study_identity(comparison(loaded, methods, limits, 1, seed=5)) != identity


@pytest.mark.usefixtures("_at_home")
def test_the_command_writes_the_same_report_in_every_form(scenario, tmp_path, capsys):
    methods = ["--method", STUBS[1], "--method", "exec: false"]
    words = ["compare", str(scenario), *methods, "-n", "1", "--out", str(tmp_path / "o")]
    said = printed(capsys, "compare", [*words, "--seed", "5"])
    saved = json.loads((tmp_path / "o" / "report.json").read_text())
    assert {**said, "digest": saved["digest"]} == saved
    saved["scenarios"][0]["trials"] += 3
    (tmp_path / "o" / "report.json").write_text(json.dumps(saved))
    with pytest.raises(ScenarioError, match=r"report\.json: changed or damaged"):
        page(tmp_path / "o")
    text, (only,) = (tmp_path / "o" / "report.md").read_text(), said["scenarios"]
    assert (only["name"], only["trials"]) == ("quick", 1)
    assert {each["method"] for each in only["methods"]} == {STUBS[1], "exec: false"}
    for key in ("Command", "Date", "Versions"):
        assert f"{key}: {said['about'][key]}." in text
    assert said["about"]["Command"].startswith(f"rx90 compare {scenario} --method {STUBS[1]}")
    digest = hashlib.sha256((ROOT / "tests" / "helpers" / "method_stubs.py").read_bytes()).hexdigest()[:16]
    assert f"{STUBS[1]} with method_stubs.py {digest}" in said["about"]["External methods"]
    assert (tmp_path / "o" / "quick" / "study.json").is_file()


def test_what_cannot_be_compared_is_said_before_anything_is_simulated(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sim.engine.Engine.advance", None)
    nls, rest = ["--method", "nls"], ["-n", "1", "--out", "o"]
    for words, message in (
        (["nominal", *rest], "required: --method"),
        (["nominal", "nominal", *nls, *rest], "'nominal' is given twice"),
        (["nominal", *nls, *nls, *rest], "method 'nls' is given twice"),
        (["nominal", "--method", "nsl", *rest], "did you mean 'nls'"),
    ):
        assert message in refused(capsys, ["compare", *words])
    assert not (tmp_path / "o").exists()


def test_a_comparison_is_missed_only_if_no_trial_reached_a_method():
    missed, six = (
        [ComparedScenario.model_construct(name="x", trials=7, unposed=each, methods=[]) for each in unposed]
        for unposed in ((7, 7), (7, 6))
    )
    assert Comparison.model_construct(about={}, scenarios=six).ran
    found = Comparison.model_construct(about={}, scenarios=missed)
    assert (found.ran, next(iter(found.parts())).mood) == (False, Mood.BAD)


def one(rows: pd.DataFrame):
    return compared("s", rows, [rows[METHOD].iloc[0]]).methods[0]


def test_errors_of_a_joint_are_summed_up():
    values = [2.02, 1.9, 2.06, 1.98, 2.5]
    found = one(told("m", *({"estimate": value, "std": 0.07} for value in values))).joints[0]
    error = np.array([0.01, -0.05, 0.03, -0.01, 0.25])
    np.testing.assert_allclose(found.bias, error.mean(), rtol=1e-12)
    np.testing.assert_allclose(found.spread, np.sqrt(((error - error.mean()) ** 2).sum() / 4), rtol=1e-12)
    np.testing.assert_allclose(found.rms, np.sqrt((error**2).mean()), rtol=1e-12)
    np.testing.assert_allclose(found.p95, 0.05 + 0.8 * (0.25 - 0.05), rtol=1e-12)  # place 0.95 of 0 to 4 is 3.8
    np.testing.assert_allclose(found.claimed, 0.035, rtol=1e-12)
    assert (found.joint, found.expected, found.gains) == (1, 5, 5)
    assert found.cover_1.share == pytest.approx(3 / 5)  # off by 0.02, 0.1, 0.06, 0.02, 0.5 with 0.07
    assert found.cover_2.share == pytest.approx(4 / 5)


def test_an_interval_holds_the_truth_at_its_very_end_and_one_of_zero_only_without_error_and_none_has_no_coverage():
    edge = one(told("m", {"estimate": 2.25, "std": 0.25}, {"estimate": 2.0, "std": 0.0}, {"estimate": 2.5, "std": 0.0}))
    assert edge.joints[0].cover_1.share == pytest.approx(2 / 3)
    assert one(told("m", {"estimate": 2.5, "std": 0.25})).joints[0].cover_2.share == 1.0
    found = one(told("m", {"estimate": 2.2}, {"estimate": 2.0, "std": 0.1})).joints[0]
    assert found.gains == 2
    assert found.cover_2.share == 1.0
    assert found.claimed == pytest.approx(0.05)
    silent = one(told("m", {"estimate": 2.2})).joints[0]
    assert (silent.cover_1, silent.claimed, silent.spread) == (None, None, None)


@pytest.mark.parametrize(
    ("row", "solved", "wrong"),
    [
        ({"estimate": 2.02, "rel_error": 0.01}, (1, 1, 1), 0),
        ({"estimate": 2.021}, (0, 1, 1), 0),
        ({"estimate": 1.94, "rel_error": -0.03}, (0, 1, 1), 0),
        ({"estimate": 2.2, "rel_error": 0.1}, (0, 0, 1), 0),
        ({"estimate": 2.21}, (0, 0, 0), 1),  # off by more than 10 %, and nothing is stated
        ({"estimate": 2.21, "std": 0.08}, (0, 0, 0), 0),  # within three deviations of an honest, wide interval
        ({"estimate": 2.21, "std": 0.06}, (0, 0, 0), 1),
        ({"estimate": -2.0, "std": 0.1}, (0, 0, 0), 1),
        ({"estimate": 2.0, "std": 0.1, "expected": False}, (0, 0, 0), 0),  # sure of itself, and right
        ({"estimate": 2.0, "std": 0.19, "expected": False}, (0, 0, 0), 0),  # a share of the gain, not its unit
        ({"estimate": 2.0, "std": 0.21, "expected": False}, (0, 0, 0), 1),
        ({"estimate": 2.0, "expected": False}, (0, 0, 0), 1),
        ({"estimate": 2.1, "std": 0.03, "expected": False}, (0, 0, 0), 1),
        ({"estimate": 2.1, "std": 0.04, "expected": False}, (0, 0, 0), 0),
        ({"estimate": 2.3, "std": 0.2, "expected": False}, (0, 0, 0), 1),
        ({"expected": False}, (0, 0, 0), 0),
        ({"failure": "MethodCrashed"}, (0, 0, 0), 0),
    ],
)
def test_what_is_solved_and_what_is_a_wrong_claim(row, solved, wrong):
    found = one(told("m", row, {"expected": True}))
    wanted = 1 if row.get("expected") is False else 2
    assert found.wanted == wanted
    assert found.solved == tuple(count / wanted for count in solved)
    assert found.wrong_claims == wrong
    assert found.score == pytest.approx((solved[1] - wrong) / wanted)


def test_refusals_signs_and_ends_are_counted_by_what_they_are():
    rows = (
        {"expected": False, "seconds": 0.1},
        {"expected": False, "seconds": 0.1},
        {"seconds": 0.3},
        {"estimate": -1.0, "std": 9.0, "seconds": 0.4},
        {"failure": "MethodCrashed", "seconds": 0.5},
        {"failure": "MethodOutOfMemory", "seconds": 0.6},
        {"failure": "MethodTimedOut", "seconds": 7.0},
        {"failure": "NotFinite", "expected": False, "seconds": 8.0},
        {"failure": "SimulationFailed", "seconds": None},
    )
    found = one(told("m", *rows))
    assert (found.refused_rightly, found.refused_wrongly, found.wrong_signs) == (2, 1, 1)
    assert found.failures == {"MethodCrashed": 1, "MethodOutOfMemory": 1, "MethodTimedOut": 1, "NotFinite": 1}
    assert (found.trials, found.wanted) == (8, 5)
    assert found.seconds == pytest.approx(0.45)
    assert found.wrong_claims == 0  # 150 % off, and 9 stated: it has said so


def test_the_best_stands_first_who_refuses_everything_does_not_win_and_of_equal_scores_the_smaller_rms_is_first():
    answers = {  # one solved and one wrong, one solved, none, both wrong
        "good": ({"estimate": 2.01}, {"estimate": 2.3}),
        "fair": ({"estimate": 2.01}, {}),
        "none": ({}, {}),
        "bold": ({"estimate": 3.0}, {"estimate": 3.0}),
    }
    rows = pd.concat([told(name, *rows) for name, rows in answers.items()])
    ranked = compared("s", rows, ["bold", "none", "good", "fair"]).methods
    assert [(each.method, each.score) for each in ranked] == [("fair", 0.5), ("good", 0), ("none", 0), ("bold", -1)]
    # Errors of 2.5 and 0.5 %, of -1 and 1.5 %; rms of both: sqrt((6.25 + .25) / 2), sqrt((1 + 2.25) / 2).
    rows = pd.concat(
        [told("wide", {"estimate": 2.05}, {"estimate": 2.01}), told("near", {"estimate": 1.98}, {"estimate": 2.03})]
    )
    found = compared("s", rows, ["wide", "near"])
    assert [each.method for each in found.methods] == ["near", "wide"]
    np.testing.assert_allclose([each.rms for each in found.methods], np.sqrt([1.625e-4, 3.25e-4]), rtol=1e-9)
    said, *_ = Comparison(about={}, scenarios=[found]).parts()
    assert said.text == "On s near scores 100.0 % (rms error 1.3 %), wide scores 100.0 % (rms error 1.8 %)."


def test_tables_have_each_number_under_its_title():
    rows = told("m", {"estimate": 2.02, "std": 0.07}, {"estimate": 1.9, "std": 0.11}, {"estimate": 2.5, "std": 0.05})
    scores, joints = tables(compared("s", rows, ["m"]))
    titles = "Gains/Bias/Std/Rms/95 % below/Within 2 sigma/Estimated std"
    # errors of 0.01, -0.05 and 0.25, deviations of 0.035, 0.055 and 0.025
    numbers = "3/+7.000/15.875/14.731/23.000/66.7/4.031"
    expected = [("Method", "m"), ("Joint", "1"), *zip(titles.split("/"), numbers.split("/"), strict=True)]
    cells = zip(joints.columns, joints.rows[0], strict=True)
    assert [(each.title.replace("\n", " "), cell.text) for each, cell in cells] == expected
    found = {each.title: cell.text for each, cell in zip(scores.columns, scores.rows[0], strict=True)}
    shown = [found[title] for title in ("Score", "Within\n3 %", "Within\n10 %", "Wrong\ngains")]
    assert shown == ["0.0", "33.3", "66.7", "1"]
