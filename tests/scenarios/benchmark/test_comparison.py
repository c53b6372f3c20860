import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from bad_files import refused
from here import HERE
from places import ROOT
from printed import printed
from rich.console import Console

from scenarios.benchmark.comparison import ComparedScenario, Comparison
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
    assert json.loads((tmp_path / "o" / "report.json").read_text()) == said
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
        ([*nls, *rest], "required: SCENARIO"),
        (["nominal", *nls, "--out", "o"], "required: -n"),
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
