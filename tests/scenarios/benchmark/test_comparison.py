"""Methods side by side: the study, the command and its report."""

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from here import HERE
from method_rows import told
from places import ROOT
from printed import printed
from quick import BRIEF, RANDOM, quick_scenario
from rich.console import Console

from scenarios import load
from scenarios.benchmark.bound import gain_bound
from scenarios.benchmark.comparison import Comparison, compared
from scenarios.benchmark.methods import Call, Limits, Method, method_of, python_answer, read_answer
from scenarios.benchmark.study import METHOD, comparison
from scenarios.cli import main
from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.setup import setup_of
from scenarios.experiments.study import carry_out, study_identity
from scenarios.rendering import RENDERERS, Page, renderer
from scenarios.support.errors import MethodError, ScenarioError, StudyError

QUIET = Console(quiet=True)
LIMITS = Limits(time_s=60.0)
STUBS = ("method_stubs:least_squares", "method_stubs:constant", "method_stubs:refuses", "method_stubs:raises")


def called_here(method: Method, folder: Path, joints: int, limits: Limits) -> Call:
    """A call in this process, which takes no second to start."""
    try:
        outcome = read_answer(json.dumps(python_answer(method.text, folder)).encode(), joints)
    except ValueError as error:
        outcome = MethodError("MethodCrashed", str(error))
    return Call(outcome=outcome, seconds=0.7)


@pytest.fixture(scope="module", autouse=True)
def _calls_in_this_process():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("scenarios.benchmark.study.call", called_here)
        yield


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    return quick_scenario(tmp_path_factory.mktemp("quick"), RANDOM, lasts=BRIEF)


# The study


def study(scenario, count: int, *texts: str):
    return comparison(load_scenario(str(scenario)), [method_of(text) for text in texts], LIMITS, count, seed=5)


@pytest.fixture(scope="module")
def finished(scenario, tmp_path_factory):
    folder = tmp_path_factory.mktemp("compared") / "study"
    return carry_out(study(scenario, 4, *STUBS), folder, HERE, command="", console=QUIET)


def test_every_method_has_a_row_for_each_trial_and_joint(finished):
    rows = finished.table()
    assert len(rows) == 4 * len(STUBS) * 6
    for _, group in rows.groupby(["trial", METHOD]):
        assert group["joint"].tolist() == [1, 2, 3, 4, 5, 6]
    assert set(rows[METHOD]) == set(STUBS)
    assert rows["expected"].tolist() == [True, True, True, False, True, False] * (4 * len(STUBS))


def test_a_method_is_given_what_a_run_of_that_seed_records(finished, scenario):
    rows = finished.table()
    own = rows[(rows[METHOD] == STUBS[0]) & rows["seconds"].notna()]
    trial = int(own["trial"].iloc[0])
    run = load(str(scenario)).run(5 + trial)
    found = own[own["trial"] == trial]
    for verdict, row in zip(run.verdict.gains, found.itertuples(), strict=True):
        assert row.seed == 5 + trial
        assert row.true == verdict.true
        assert row.identifiable == verdict.identifiable
        if verdict.estimate is not None:
            np.testing.assert_allclose([row.estimate, row.std], [verdict.estimate, verdict.std], rtol=1e-12)
            assert row.passed == verdict.passed


def test_a_crash_is_rows_with_a_failure_and_refuses_nothing(finished):
    rows = finished.table()
    posed = rows[rows["seconds"].notna()]
    crashed = posed[posed[METHOD] == "method_stubs:raises"]
    assert (crashed["failure"] == "MethodCrashed").all()
    assert (crashed["reason"] == "what is this?").all()
    assert not crashed["passed"].any()
    refused = posed[posed[METHOD] == "method_stubs:refuses"]
    assert refused["failure"].isna().all()
    assert (refused["passed"] == ~refused["expected"]).all()
    assert set(refused["reason"]) == {"I dare not"}


def test_a_trial_that_cannot_be_simulated_is_no_method_s_fault(finished):
    rows = finished.table()
    unposed = rows[rows["seconds"].isna()]
    assert 0 < unposed["trial"].nunique() < 4  # a payload of 95 kg
    assert unposed["failure"].notna().all()
    assert len(unposed) % (6 * len(STUBS)) == 0


def test_an_interrupted_comparison_goes_on_where_it_stopped(scenario, tmp_path, finished):
    two, rows = STUBS[1:3], finished.table()
    first = carry_out(study(scenario, 2, *two), tmp_path / "s", HERE, command="", console=QUIET)
    assert first.table()["trial"].nunique() == 2
    whole = carry_out(study(scenario, 4, *two), tmp_path / "s", HERE, command="", console=QUIET).table()
    same = rows[rows[METHOD].isin(two)].reset_index(drop=True)
    pd.testing.assert_frame_equal(whole.drop(columns="seconds"), same.drop(columns="seconds"), check_exact=True)


def test_other_methods_other_limits_and_changed_files_are_another_study(scenario, tmp_path):
    carry_out(study(scenario, 1, STUBS[1]), tmp_path / "s", HERE, command="", console=QUIET)
    with pytest.raises(StudyError, match="methods"):
        carry_out(study(scenario, 1, STUBS[2]), tmp_path / "s", HERE, command="", console=QUIET)
    loaded, method = load_scenario(str(scenario)), method_of(STUBS[1])
    slow = comparison(loaded, [method], Limits(time_s=61.0), 1, seed=5)
    with pytest.raises(StudyError, match=r"limits\.time_s"):
        carry_out(slow, tmp_path / "s", HERE, command="", console=QUIET)
    edited = comparison(loaded, [replace(method, digests=(("method_stubs.py", "0" * 16),))], LIMITS, 1, seed=5)
    assert study_identity(edited) != study_identity(study(scenario, 1, STUBS[1]))


def test_no_method_and_one_twice_are_refused(scenario):
    with pytest.raises(ScenarioError, match="no method"):
        study(scenario, 1)
    with pytest.raises(ScenarioError, match="'nls' is given twice"):
        study(scenario, 1, "nls", "ls-2011", "nls")


# The command


def test_the_command_writes_the_same_report_in_every_form(scenario, tmp_path, capsys):
    words = [
        "compare",
        str(scenario),
        "--method",
        STUBS[1],
        "--method",
        "exec: false",
        "-n",
        "1",
        "--out",
        str(tmp_path / "o"),
    ]
    assert main([*words, "--seed", "5", "--json", "--jobs", "1"]) == 0
    said = printed(capsys, "compare")
    assert json.loads((tmp_path / "o" / "report.json").read_text()) == said
    text = (tmp_path / "o" / "report.md").read_text()
    assert said["scenarios"][0]["name"] == "quick"
    assert said["scenarios"][0]["trials"] == 1
    assert {each["method"] for each in said["scenarios"][0]["methods"]} == {STUBS[1], "exec: false"}
    for key in ("Command", "Date", "Versions"):
        assert f"{key}: {said['about'][key]}." in text
    assert said["about"]["Command"].startswith(f"rx90 compare {scenario} --method {STUBS[1]}")
    digest = hashlib.sha256((ROOT / "tests" / "helpers" / "method_stubs.py").read_bytes()).hexdigest()[:16]
    assert f"{STUBS[1]} with method_stubs.py {digest}" in said["about"]["External methods"]
    assert (tmp_path / "o" / "quick" / "study.json").is_file()
    bound = gain_bound(setup_of(load_scenario(str(scenario))))
    stated = [joint["bound"] for joint in said["scenarios"][0]["methods"][0]["joints"]]
    np.testing.assert_allclose(stated, bound, rtol=1e-9)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["nominal", "-n", "1", "--out", "o"], "no method"),
        (["--method", "nls", "-n", "1", "--out", "o"], "expected scenarios"),
        (["nominal", "--method", "nls", "--out", "o"], "expected scenarios, -n N and --out DIR"),
        (["nominal", "nominal", "--method", "nls", "-n", "1", "--out", "o"], "'nominal' is given twice"),
        (["nominal", "--method", "nsl", "-n", "1", "--out", "o"], "did you mean 'nls'"),
    ],
)
def test_what_cannot_be_compared_is_said_before_anything_is_simulated(words, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sim.engine.Engine.advance", None)
    assert main(["compare", *words]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize("form", RENDERERS)
def test_a_report_says_all_that_it_knows_in_every_form(form):
    rows = pd.concat([
        told("mine", {"estimate": 2.02, "std": 0.05}, {"failure": "NotFinite"}),
        told("theirs", {}, {"estimate": 2.5}),
    ])  # fmt: skip
    here = compared("here", rows, ["mine", "theirs"], np.array([0.0123])).model_copy(update={"unposed": 1})
    found = Comparison(about={"Date": "2011-09-25"}, scenarios=[here])
    report = found.report(found.title)
    text = renderer(form)(report, Page())
    for word in ("mine", "theirs", "here", "NotFinite"):
        assert word in text
    if form != "json":
        assert "1.230" in text
        assert "mine: 1 NotFinite." in text
        assert "1 of them failed before any method was run." in text


@pytest.mark.parametrize(
    ("scores", "said"),
    [
        ({"a": 0.9004, "b": 0.9, "c": 0.7, "d": 0.1}, "On here a and b score 90.0 %, c 70.0 %."),
        ({"a": 0.9, "b": 0.2, "c": 0.1}, "On here a scores 90.0 %, b 20.0 %."),
        ({"a": 0.3, "b": 0.3, "c": 0.3}, "On here a, b and c score 30.0 %."),
        ({"a": 0.3}, "On here a scores 30.0 %."),
    ],
)
def test_the_verdict_names_every_method_with_the_highest_score_and_the_next(scores, said):
    here = compared("here", told("a", {"estimate": 2.02, "std": 0.05}), ["a"], None)
    here.methods = [replace(here.methods[0], method=name, score=score) for name, score in scores.items()]
    assert next(iter(Comparison(about={}, scenarios=[here]).parts())).text == said


def test_a_saved_result_is_no_scenario_to_compare_and_says_what_shows_it(tmp_path, capsys):
    (tmp_path / "record.json").write_text("{}")
    assert main(["compare", str(tmp_path), "--method", "ls-2011"]) == 2
    said = capsys.readouterr().err
    assert "is a saved result (rx90 report shows it; rx90 verify compares" in said
    assert main(["compare", "nominal", "--method", "ls-2011"]) == 2
    assert capsys.readouterr().err.endswith("rx90: expected scenarios, -n N and --out DIR\n")
