"""Methods side by side: the bound, the statistics, the rule of the order, the study and its report."""

import hashlib
import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from here import HERE
from places import ROOT
from printed import printed
from quick import RANDOM, quick_scenario
from rich.console import Console
from scipy import linalg, signal, stats

from ident.all_joints.columns import JointColumns
from scenarios.build import bench
from scenarios.cli import main
from scenarios.comparison.bound import bound_of, gain_bound, in_band
from scenarios.comparison.rows import METHOD
from scenarios.comparison.statistics import NEEDED, summaries
from scenarios.errors import NothingToCompare, OtherStudy
from scenarios.files.loading import load_scenario
from scenarios.methods import method_of
from scenarios.methods.process import Limits
from scenarios.reports.comparison import Compared, comparison_report
from scenarios.reports.renderers import RENDERERS, Page, renderer
from scenarios.run import run_scenario
from scenarios.studies.comparison import comparison
from scenarios.studies.coverage import coverage
from scenarios.studies.study import carry_out, study_identity

QUIET = Console(quiet=True)
LIMITS = Limits(time_s=60.0)
STUBS = ("method_stubs:least_squares", "method_stubs:constant", "method_stubs:refuses", "method_stubs:raises")


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    return quick_scenario(tmp_path_factory.mktemp("quick"), RANDOM, method="nls")


# The bound


def columns(joint: int, shared: np.ndarray, known: np.ndarray, own: dict[str, np.ndarray], V: np.ndarray):
    r = len(V)
    return JointColumns(
        joint=joint,
        V=V,
        shared=shared,
        known=known,
        own=own,
        payload=np.zeros((0, r, 10)),
        motion=np.zeros(r, dtype=np.intp),
        position=np.arange(r),
    )


def test_one_joint_with_an_offset_is_bounded_by_what_of_its_load_is_no_offset(rng):
    known, sigma, h = rng.normal(3.0, 2.0, 40), 0.37, -1.7
    one = columns(0, np.zeros((40, 0)), known, {"off": np.ones(40)}, h * known + 0.4)
    expected = sigma / (abs(h) * np.linalg.norm(known - known.mean()))
    np.testing.assert_allclose(bound_of((one,), np.array([h]), [np.full(40, sigma)]), [expected], rtol=1e-9)


def test_the_bound_is_the_inverse_of_the_information_of_the_whole_model(rng):
    h, theta, phi = np.array([0.7, -2.1]), rng.normal(size=3), [rng.normal(size=2), rng.normal(size=1)]
    A, k = [rng.normal(size=(r, 3)) for r in (30, 25)], [rng.normal(size=30), np.zeros(25)]
    F = [rng.normal(size=(30, 2)), rng.normal(size=(25, 1))]
    sigma = [rng.uniform(0.1, 0.9, 30), rng.uniform(0.1, 0.9, 25)]

    def currents(x: np.ndarray) -> np.ndarray:
        g, t = np.exp(x[:2]) / h, x[2:5]  # log-gains of size 0 at the truth
        own = [x[5:7], x[7:8]]
        return np.concatenate([((A[j] @ t + k[j]) * h[j] / (g[j] * h[j]) + F[j] @ own[j]) / sigma[j] for j in (0, 1)])

    truth = np.concatenate([np.zeros(2), theta, *phi])
    V = [(A[j] @ theta + k[j]) * h[j] + F[j] @ phi[j] for j in (0, 1)]
    J = np.column_stack([(currents(truth + e) - currents(truth - e)) / 2e-5 for e in 1e-5 * np.eye(8)])
    expected = np.sqrt(np.diag(linalg.inv(J.T @ J)))[:2]
    joints = tuple(columns(j, A[j], k[j], dict(zip(("Fv", "Fc"), F[j].T, strict=False)), V[j]) for j in (0, 1))
    # Central differences of a smooth function with steps of 1e-5: 1e-10, and rounding of 1e-11.
    np.testing.assert_allclose(bound_of(joints, h, sigma), expected, rtol=1e-7)


def test_a_joint_that_nothing_known_reaches_has_no_bound(rng):
    A, known = rng.normal(size=(30, 2)), rng.normal(size=30)
    seen = columns(0, np.hstack((A, np.zeros((30, 2)))), known, {}, A @ [1.0, 2.0] + known)
    alone = columns(1, np.hstack((np.zeros((30, 2)), A)), np.zeros(30), {}, A @ [1.0, 2.0])
    found = bound_of((seen, alone), np.array([1.0, 1.0]), [np.ones(30), np.ones(30)])
    assert found[0] < 1.0
    assert found[1] > 1e6


@pytest.mark.parametrize(
    ("name", "percent"),
    [("nominal", [0.28, 0.22, 0.18, 0.19, 0.23]), ("mass-only", [0.55, 0.34, 0.34, 0.89, 0.90])],
)
def test_the_bound_of_a_scenario_is_what_a_second_implementation_found(name, percent):
    # From all samples and the exact spectrum; two digits are known of it.
    np.testing.assert_allclose(100.0 * gain_bound(bench(load_scenario(name)))[:5], percent, atol=0.01)


def test_the_bound_is_in_proportion_to_the_noise_and_none_without(scenario):
    nominal = bench(load_scenario(str(scenario)))

    def noisy(**sensors: float):
        return replace(
            nominal,
            experiments=tuple(replace(e, sensors=replace(e.sensors, **sensors)) for e in nominal.experiments),
        )

    assert gain_bound(noisy(current_white=0.0, current_coloured=0.0)) is None
    white = gain_bound(noisy(current_coloured=0.0))
    np.testing.assert_allclose(gain_bound(noisy(current_white=0.15, current_coloured=0.0)), 3.0 * white, rtol=1e-9)
    coloured, both = gain_bound(noisy(current_white=0.0)), gain_bound(nominal)
    np.testing.assert_allclose(np.hypot(white, coloured), both, rtol=1e-9)  # variances of the same rows add up


def test_coloured_noise_has_its_power_below_its_cut_off():
    # A Butterworth filter's power is flat well below the cut-off; its integral is pi / (2 sqrt 2) times the cut-off for
    # the second order, where the rate is far above.
    expected = 500.0 / (20.0 * np.pi / (2.0 * np.sqrt(2.0)))
    np.testing.assert_allclose(in_band(20.0, 0.5, 1000.0), expected, rtol=0.01)
    assert in_band(20.0, 500.0, 1000.0) == pytest.approx(1.0)
    _, H = signal.sosfreqz(signal.butter(2, 20.0, fs=1000.0, output="sos"), worN=[10.0], fs=1000.0)
    assert in_band(20.0, 10.0, 1000.0) > expected * np.abs(H[0]) ** 2


# Statistics


def told(method: str, *rows: dict) -> pd.DataFrame:
    """Rows of trials that count up; joint 1 unless it is said."""
    common = {
        "joint": 1,
        "true": 2.0,
        "estimate": None,
        "std": None,
        "rel_error": None,
        "expected": True,
        "seconds": 0.5,
        "failure": None,
    }
    full = [{METHOD: method, "trial": k, **common, **row} for k, row in enumerate(rows)]
    for row in full:
        if row["estimate"] is not None and row["rel_error"] is None:
            row["rel_error"] = (row["estimate"] - row["true"]) / row["true"]
    frame = pd.DataFrame(full, columns=list(NEEDED))
    return frame.astype({"estimate": float, "std": float, "rel_error": float, "seconds": float})


def one(rows: pd.DataFrame, bound=None):
    return summaries(rows, [rows[METHOD].iloc[0]], bound)[0]


def test_errors_of_a_joint_are_summed_up():
    values = [2.02, 1.9, 2.06, 1.98, 2.5]
    found = one(told("m", *({"estimate": value, "std": 0.07} for value in values)), np.array([0.02])).joints[0]
    error = np.array([0.01, -0.05, 0.03, -0.01, 0.25])
    np.testing.assert_allclose(found.bias, error.mean(), rtol=1e-12)
    np.testing.assert_allclose(found.spread, np.sqrt(((error - error.mean()) ** 2).sum() / 4), rtol=1e-12)
    np.testing.assert_allclose(found.rms, np.sqrt((error**2).mean()), rtol=1e-12)
    np.testing.assert_allclose(found.p95, 0.05 + 0.8 * (0.25 - 0.05), rtol=1e-12)  # place 0.95 of 0 to 4 is 3.8
    np.testing.assert_allclose(found.claimed, 0.035, rtol=1e-12)
    np.testing.assert_allclose(found.claimed_over_bound, 1.75, rtol=1e-12)
    np.testing.assert_allclose(found.spread_over_bound, found.spread / 0.02, rtol=1e-12)
    assert (found.joint, found.expected, found.gains) == (1, 5, 5)
    assert found.cover_1.share == pytest.approx(3 / 5)  # off by 0.02, 0.1, 0.06, 0.02, 0.5 with 0.07
    assert found.cover_2.share == pytest.approx(4 / 5)


def test_coverage_has_the_interval_of_clopper_and_pearson():
    found = coverage(np.array([True] * 93 + [False] * 7))
    assert found.share == pytest.approx(0.93)
    np.testing.assert_allclose(found.low, stats.beta.ppf(0.025, 93, 8), rtol=1e-9)
    np.testing.assert_allclose(found.high, stats.beta.ppf(0.975, 94, 7), rtol=1e-9)
    assert coverage(np.array([], dtype=bool)) is None


def test_an_interval_holds_the_truth_at_its_very_end_and_one_of_zero_only_without_error():
    edge = one(told("m", {"estimate": 2.25, "std": 0.25}, {"estimate": 2.0, "std": 0.0}, {"estimate": 2.5, "std": 0.0}))
    assert edge.joints[0].cover_1.share == pytest.approx(2 / 3)
    assert one(told("m", {"estimate": 2.5, "std": 0.25})).joints[0].cover_2.share == 1.0


def test_gains_without_deviation_count_for_errors_and_not_for_coverage():
    found = one(told("m", {"estimate": 2.2}, {"estimate": 2.0, "std": 0.1})).joints[0]
    assert found.gains == 2
    assert found.cover_2.share == 1.0
    assert found.claimed == pytest.approx(0.05)
    silent = one(told("m", {"estimate": 2.2})).joints[0]
    assert (silent.cover_1, silent.claimed, silent.claimed_over_bound, silent.spread) == (None, None, None, None)


@pytest.mark.parametrize(
    ("row", "solved", "wrong"),
    [
        ({"estimate": 2.02, "rel_error": 0.01}, (1, 1, 1), 0),
        ({"estimate": 2.021}, (0, 1, 1), 0),
        ({"estimate": 1.94, "rel_error": -0.03}, (0, 1, 1), 0),
        ({"estimate": 2.2, "rel_error": 0.1}, (0, 0, 1), 0),
        ({"estimate": 1.93}, (0, 0, 1), 0),
        ({"estimate": 2.19}, (0, 0, 1), 0),
        ({"estimate": 2.21}, (0, 0, 0), 1),  # off by more than 10 %, and nothing is stated
        ({"estimate": 2.21, "std": 0.08}, (0, 0, 0), 0),  # within three deviations of an honest, wide interval
        ({"estimate": 2.21, "std": 0.06}, (0, 0, 0), 1),
        ({"estimate": -2.0, "std": 0.1}, (0, 0, 0), 1),
        ({"estimate": 2.0, "std": 0.1, "expected": False}, (0, 0, 0), 0),  # sure of itself, and right
        ({"estimate": 2.0, "std": 0.21, "expected": False}, (0, 0, 0), 1),
        ({"estimate": 2.0, "expected": False}, (0, 0, 0), 1),
        ({"estimate": 2.1, "std": 0.03, "expected": False}, (0, 0, 0), 1),
        ({"estimate": 2.1, "std": 0.04, "expected": False}, (0, 0, 0), 0),
        ({"estimate": 2.3, "std": 0.2, "expected": False}, (0, 0, 0), 1),
        ({"expected": False}, (0, 0, 0), 0),
        ({}, (0, 0, 0), 0),
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
    found = one(
        told(
            "m",
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
    )
    assert (found.refused_rightly, found.refused_wrongly, found.wrong_signs) == (2, 1, 1)
    assert (found.crashes, found.time_outs, found.misfits) == (2, 1, 1)
    assert found.failures == {"MethodCrashed": 1, "MethodOutOfMemory": 1, "MethodTimedOut": 1, "NotFinite": 1}
    assert (found.trials, found.wanted) == (8, 5)
    assert found.seconds == pytest.approx(0.45)
    assert found.wrong_claims == 0  # 150 % off, and 9 stated: it has said so


def test_the_best_stands_first_and_who_refuses_everything_does_not_win():
    good = told("good", {"estimate": 2.01}, {"estimate": 2.3})  # one solved, one wrong
    fair = told("fair", {"estimate": 2.01}, {})
    none = told("none", {}, {})
    bold = told("bold", {"estimate": 3.0}, {"estimate": 3.0})
    rows = pd.concat([bold, none, good, fair])
    ranked = summaries(rows, ["bold", "none", "good", "fair"], None)
    assert [each.method for each in ranked] == ["fair", "none", "good", "bold"]
    assert [each.score for each in ranked] == [0.5, 0.0, 0.0, -1.0]


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
    run = run_scenario(str(scenario), seed=5 + trial)
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
    assert (crashed["reason"] == "exit status 1: ValueError: what is this?").all()
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


def test_other_methods_other_limits_and_changed_files_are_another_study(scenario, tmp_path, monkeypatch):
    carry_out(study(scenario, 1, STUBS[1]), tmp_path / "s", HERE, command="", console=QUIET)
    with pytest.raises(OtherStudy, match="methods"):
        carry_out(study(scenario, 1, STUBS[2]), tmp_path / "s", HERE, command="", console=QUIET)
    loaded, method = load_scenario(str(scenario)), method_of(STUBS[1])
    slow = comparison(loaded, [method], Limits(time_s=61.0), 1, seed=5)
    with pytest.raises(OtherStudy, match=r"limits\.time_s"):
        carry_out(slow, tmp_path / "s", HERE, command="", console=QUIET)
    edited = comparison(loaded, [replace(method, digests=(("method_stubs.py", "0" * 16),))], LIMITS, 1, seed=5)
    assert study_identity(edited) != study_identity(study(scenario, 1, STUBS[1]))


def test_no_method_and_one_twice_are_refused(scenario):
    with pytest.raises(NothingToCompare, match="no method"):
        study(scenario, 1)
    with pytest.raises(NothingToCompare, match="'nls' is given twice"):
        study(scenario, 1, "nls", "ls-2011", "nls")


# The command


def test_the_command_writes_the_same_report_in_every_form(scenario, tmp_path, capsys):
    words = [
        "compare",
        str(scenario),
        "--method",
        STUBS[1],
        "--method",
        STUBS[2],
        "-n",
        "2",
        "--out",
        str(tmp_path / "o"),
    ]
    assert main([*words, "--seed", "5", "--json", "--jobs", "1"]) == 0
    said = printed(capsys, "compare")
    assert json.loads((tmp_path / "o" / "report.json").read_text()) == said
    text = (tmp_path / "o" / "report.md").read_text()
    assert said["scenarios"][0]["name"] == "quick"
    assert said["scenarios"][0]["trials"] == 2
    assert {each["method"] for each in said["scenarios"][0]["methods"]} == {STUBS[1], STUBS[2]}
    for key in ("Command", "Date", "Versions"):
        assert f"{key}: {said['about'][key]}." in text
    assert said["about"]["Command"].startswith(f"rx90 compare {scenario} --method {STUBS[1]}")
    digest = hashlib.sha256((ROOT / "tests" / "helpers" / "method_stubs.py").read_bytes()).hexdigest()[:16]
    assert f"{STUBS[1]} with method_stubs.py {digest}" in said["about"]["Methods from elsewhere"]
    assert (tmp_path / "o" / "quick" / "study.json").is_file()
    bound = gain_bound(bench(load_scenario(str(scenario))))
    stated = [joint["bound"] for joint in said["scenarios"][0]["methods"][0]["joints"]]
    np.testing.assert_allclose(stated, bound, rtol=1e-9)
    # What is finished is not simulated again, and the command writes over what is its own.
    assert main([*words, "--seed", "5", "--json", "--jobs", "1"]) == 0


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
    methods = summaries(rows, ["mine", "theirs"], np.array([0.0123]))
    report = comparison_report([Compared(name="here", trials=3, unposed=1, methods=methods)], {"Date": "2011-09-25"})
    text = renderer(form)(report, Page())
    for word in ("mine", "theirs", "here", "NotFinite", "2011-09-25"):
        assert word in text
    if form != "json":
        assert "1.230" in text
        assert "mine: 1 NotFinite." in text
        assert "1 of them failed before any method was asked." in text
