"""Answers to problem folders, and problems whose truth is sealed until the answers are in."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
from printed import printed
from quick import BRIEF, quick_scenario

import scenarios.benchmark.comparison.seal as sealing
import scenarios.benchmark.methods.answers as answering
from scenarios import load
from scenarios.benchmark.comparison.bound import gain_bound
from scenarios.benchmark.comparison.seal import (
    PROBLEMS,
    SALT_BYTES,
    SEAL,
    TRUTH,
    Revealed,
    TruthFile,
    revealed,
    scored,
    seal,
    unknown_seed,
)
from scenarios.benchmark.comparison.statistics import summaries
from scenarios.benchmark.methods.answers import ANSWERS, answered, problem_digest, read_answers
from scenarios.benchmark.methods.call import Call, Limits
from scenarios.benchmark.methods.method import Method
from scenarios.cli import main
from scenarios.experiments.judge import Claim
from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.setup import setup_of
from scenarios.results.problem_folder import read_problem
from scenarios.support.errors import MethodTimedOut, ScenarioError

DRAWN = """
[random.gains]
target = "plant.gain"
distribution = "norm"
parameters = { loc = 1.0, scale = 0.1 }
apply = "multiply"
"""
GOOD, LATE = Method("good", ("good",), (("good.py", "1f"),)), Method("late", ("late",))


@pytest.fixture(scope="module")
def scenario(tmp_path_factory) -> Path:
    return quick_scenario(tmp_path_factory.mktemp("quick"), DRAWN, lasts=BRIEF)


@pytest.fixture(scope="module")
def sealed(scenario, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("game") / "sealed"
    assert seal([load_scenario(str(scenario))], 3, 41, folder).problems == 3
    return folder


@pytest.fixture
def calls(monkeypatch) -> list[tuple[str, str]]:
    """Calls instead of processes: `good` claims 1 for each joint but the last, `late` is too slow."""
    made: list[tuple[str, str]] = []

    def called(method: Method, folder: Path, joints: int, limits: Limits) -> Call:
        made.append((method.text, folder.name))
        if method.text == "late":
            return Call(outcome=MethodTimedOut("no answer after 9 s"), seconds=9.0)
        claims = (*[Claim(1.0, 0.25, None)] * (joints - 1), Claim(None, None, "I dare not"))
        return Call(outcome=claims, seconds=0.5)

    monkeypatch.setattr(answering, "call", called)
    return made


def problems(folder: Path) -> list[Path]:
    return sorted((folder / PROBLEMS).iterdir())


def truth_of(folder: Path, name: str) -> dict:
    return json.loads((folder / TRUTH / f"{name}.json").read_text())


# Sealing


def test_the_seal_is_the_digest_of_each_truth_and_each_problem(sealed):
    stated = json.loads((sealed / SEAL).read_text())["problems"]
    assert list(stated) == [path.name for path in problems(sealed)]
    for name, each in stated.items():
        assert each["truth"] == hashlib.sha256((sealed / TRUTH / f"{name}.json").read_bytes()).hexdigest()
        assert each["problem"] == problem_digest(sealed / PROBLEMS / name)


def test_the_truth_is_that_of_the_trial_and_nothing_of_it_is_published(sealed, scenario):
    seeds = set()
    for path in problems(sealed):
        truth = truth_of(sealed, path.name)
        run = load(str(scenario)).run(truth["seed"])
        np.testing.assert_array_equal(truth["gain"], run.setup.true_gain)
        assert truth["identifiable"] == [True, True, True, False, True, False]
        assert truth["scenario"] == "quick"
        recordings = [motion.recording for motion in read_problem(path).motions]
        np.testing.assert_array_equal(recordings[0].v, run.recordings[0].v)
        published = "".join(p.read_text() for p in path.iterdir() if p.suffix != ".parquet")
        for secret in (truth["salt"], "quick", str(truth["gain"][0])):
            assert secret not in published + (sealed / SEAL).read_text()
        seeds.add(truth["seed"])
    assert seeds == {41, 42, 43}


def test_every_truth_has_a_salt_of_its_own(sealed):
    salts = {truth_of(sealed, path.name)["salt"] for path in problems(sealed)}
    assert len(salts) == 3
    assert all(len(bytes.fromhex(salt)) == SALT_BYTES for salt in salts)


def test_the_seed_is_one_that_nobody_knows_and_leaves_room_for_all_trials():
    seeds = [unknown_seed(2**30) for _ in range(20)]
    assert len(set(seeds)) > 10
    assert all(0 <= seed < 2**30 for seed in seeds)


# Answering


def test_answers_are_written_down_with_what_they_answer(sealed, tmp_path, calls):
    rows = answered(problems(sealed)[:1], [GOOD, LATE], Limits(), tmp_path / ANSWERS)
    assert rows == read_answers(tmp_path / ANSWERS)
    good, late = rows
    assert (good.problem, good.method, good.files) == ("problem-0001", "good", {"good.py": "1f"})
    assert good.digest == problem_digest(problems(sealed)[0])
    assert good.claims == (*[Claim(1.0, 0.25, None)] * 5, Claim(None, None, "I dare not"))
    assert [gain.identifiable for gain in good.gains] == [True] * 5 + [False]
    assert (late.failure, late.reason, late.claims) == ("MethodTimedOut", "no answer after 9 s", ())
    assert (good.seconds, late.seconds) == (0.5, 9.0)


def test_what_is_answered_is_not_asked_again_unless_method_or_problem_changed(sealed, tmp_path, calls):
    two = problems(sealed)[:2]
    answered(two[:1], [GOOD], Limits(), tmp_path / ANSWERS)
    answered(two, [GOOD, LATE], Limits(), tmp_path / ANSWERS)
    first, second = (path.name for path in two)
    assert calls == [("good", first), ("late", first), ("good", second), ("late", second)]
    calls.clear()
    edited = Method("good", ("good",), (("good.py", "2e"),))
    rows = answered(two, [edited], Limits(), tmp_path / ANSWERS)
    assert calls == [("good", first), ("good", second)]
    assert len(rows) == 4  # of the old ones none is left
    assert {row.files.get("good.py") for row in rows} == {"2e", None}


def test_two_folders_of_one_name_and_a_file_of_something_else_are_refused(sealed, tmp_path, calls):
    one = problems(sealed)[0]
    with pytest.raises(ScenarioError, match="two problem folders are called problem-0001"):
        answered([one, one], [GOOD], Limits(), tmp_path / ANSWERS)
    for text in ("{", "[]", '{"format": 2}', '{"format": 1, "answers": [{"problem": 3}]}'):
        (tmp_path / "other.json").write_text(text)
        with pytest.raises(ScenarioError, match=r"other\.json: not a file of answers"):
            answered([one], [GOOD], Limits(), tmp_path / "other.json")
    assert not calls
    with pytest.raises(ScenarioError, match="No such file"):
        read_answers(tmp_path / "absent.json")


# Opening


def test_scores_are_those_of_the_truth(sealed, tmp_path, calls):
    rows = answered(problems(sealed)[:2], [GOOD, LATE], Limits(), tmp_path / ANSWERS)
    tables = scored(rows, revealed(sealed / SEAL, sealed / TRUTH))
    assert list(tables) == ["quick"]
    by_name = {each.method: each for each in summaries(tables["quick"], ["good", "late"], None)}
    good, late = by_name["good"], by_name["late"]  # the better one comes first, which depends on the truths
    truths = np.array([truth_of(sealed, path.name)["gain"] for path in problems(sealed)])
    error = 1.0 / truths - 1.0
    own = good.joints[1]
    np.testing.assert_allclose(own.bias, error[:2, 1].mean(), rtol=1e-12)
    assert own.gains == 2
    assert good.trials == late.trials == 3  # the third problem is unanswered: refused, not left out
    assert good.refused_wrongly == 4
    assert good.refused_rightly == 2 + 2  # of two joints; joint 4 was claimed where it answered
    assert (late.time_outs, late.refused_wrongly) == (2, 4)
    wanted = np.array([True, True, True, False, True, False])
    assert good.solved[2] == (np.abs(error[:2, wanted]) <= 0.1).sum() / 12


def test_the_bound_is_that_of_the_scenario_with_the_numbers_it_states(sealed, scenario):
    stated = [truth_of(sealed, path.name)["bound"] for path in problems(sealed)]
    own = gain_bound(setup_of(load_scenario(str(scenario))))
    assert own is not None
    assert np.isfinite(own[0])
    expected = [value if np.isfinite(value) else None for value in own.tolist()]
    assert stated == [expected] * 3
    np.testing.assert_array_equal(revealed(sealed / SEAL, sealed / TRUTH).bound("quick"), own)


def known_of(*truths: tuple[str, tuple[float | None, ...] | None]) -> Revealed:
    each = {
        f"problem-{k}": TruthFile(salt="5a", scenario=name, seed=k, gain=(1.7,), identifiable=(True,), bound=bound)
        for k, (name, bound) in enumerate(truths)
    }
    return Revealed(each, dict.fromkeys(each, "d1"))


def test_a_bound_is_used_where_all_truths_of_a_scenario_state_it_and_what_does_not_show_is_infinite():
    known = known_of(
        ("a", (0.02, None)), ("b", (0.03, 0.5)), ("a", (0.02, None)), ("c", None), ("d", (0.1,)), ("d", None)
    )
    np.testing.assert_array_equal(known.bound("a"), [0.02, np.inf])
    np.testing.assert_array_equal(known.bound("b"), [0.03, 0.5])
    assert known.bound("c") is None
    assert known.bound("d") is None
    two = known_of(("a", (0.02,)), ("a", (0.04,)))
    assert two.bound("a") is None


def test_truths_without_a_bound_are_opened_too(sealed, tmp_path):
    truth = truth_of(sealed, "problem-0001")
    del truth["bound"]
    content = json.dumps(truth).encode()
    (tmp_path / "problem-0001.json").write_bytes(content)
    digests = {"problem": "d1", "truth": hashlib.sha256(content).hexdigest()}
    (tmp_path / SEAL).write_text(json.dumps({"format": 1, "problems": {"problem-0001": digests}}))
    assert revealed(tmp_path / SEAL, tmp_path).bound("quick") is None


@pytest.mark.parametrize(
    ("found", "stated"), [(None, None), (np.array([0.02, np.inf, 0.7]), [0.02, None, 0.7])], ids=["no noise", "no load"]
)
def test_a_bound_that_is_not_there_or_infinite_is_sealed_as_null(found, stated, scenario, tmp_path, monkeypatch):
    monkeypatch.setattr(sealing, "gain_bound", lambda setup: found)
    seal([load_scenario(str(scenario))], 1, 7, tmp_path / "sealed")
    assert truth_of(tmp_path / "sealed", "problem-0001")["bound"] == stated


def test_a_truth_that_was_changed_or_kept_back_is_found_out(sealed, tmp_path):
    for path in (sealed / TRUTH).iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    changed = tmp_path / "problem-0002.json"
    changed.write_text(changed.read_text().replace('"seed": 4', '"seed": 5'))
    with pytest.raises(ScenarioError, match=r"problem-0002\.json: its SHA-256 differs from the sealed one"):
        revealed(sealed / SEAL, tmp_path)
    changed.unlink()
    with pytest.raises(ScenarioError, match=r"problem-0002\.json: No such file"):
        revealed(sealed / SEAL, tmp_path)
    with pytest.raises(ScenarioError, match="No such file"):
        revealed(tmp_path / SEAL, tmp_path)
    (tmp_path / SEAL).write_text("{}")
    with pytest.raises(ScenarioError, match="not the seal file of a set of problems"):
        revealed(tmp_path / SEAL, tmp_path)


def test_answers_to_another_problem_or_of_another_arm_are_not_scored(sealed, tmp_path, calls):
    (row,) = answered(problems(sealed)[:1], [GOOD], Limits(), tmp_path / ANSWERS)
    known = revealed(sealed / SEAL, sealed / TRUTH)
    for other in ({"digest": "0" * 64}, {"problem": "problem-0002"}, {"problem": "elsewhere"}):
        with pytest.raises(ScenarioError, match="is not the problem that was sealed"):
            scored([row.model_copy(update=other)], known)
    with pytest.raises(ScenarioError, match="good: 5 gains; the sealed problem has 6 joints"):
        scored([row.model_copy(update={"gains": row.gains[:5]})], known)


# The command


def test_seal_answer_open_from_the_command_line(scenario, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["compare", str(scenario), "-n", "1", "--seal", "sealed", "--json"]) == 0
    assert printed(capsys, "compare-seal")["problems"] == 1
    words = ["compare", "sealed/problems/problem-0001", "--method", "method_stubs:constant", "--out", "mine"]
    assert main(words) == 0
    out = capsys.readouterr().out
    assert "problem-0001\n" in out
    assert "method_stubs:constant" in out
    assert main(["compare", "--open", "sealed", "mine/answers.json", "--json"]) == 0
    (found,) = printed(capsys, "compare")["scenarios"]
    assert (found["name"], found["trials"]) == ("quick", 1)
    assert found["methods"][0]["joints"][2]["gains"] == 1
    joint = found["methods"][0]["joints"][0]
    assert joint["bound"] == truth_of(Path("sealed"), "problem-0001")["bound"][0]
    # the stub states 0.25 of whatever the gain is
    assert joint["claimed_over_bound"] == pytest.approx(joint["claimed"] / joint["bound"], rel=1e-12)
    assert main(["compare", str(scenario), "-n", "1", "--seal", "sealed"]) == 2
    assert "is not empty; seal into a new folder" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--seal", "s"], "expected scenarios and -n N, to be sealed"),
        (["nominal", "--seal", "s"], "expected scenarios and -n N, to be sealed"),
        (["--open", "s"], "expected files of answers"),
        (["a.json", "--open", "s"], "seal.json: No such file"),
    ],
)
def test_what_is_missing_is_said(words, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["compare", *words]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_scenarios_and_problems_are_not_mixed(sealed, capsys):
    words = ["compare", "nominal", str(problems(sealed)[0]), "--method", "ls-2011", "--out", "nowhere"]
    assert main(words) == 2
    assert "compare them separately" in capsys.readouterr().err
