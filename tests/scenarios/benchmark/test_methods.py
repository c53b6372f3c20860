import json
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from method_stubs import least_squares
from printed import fits

from scenarios.benchmark.methods import Call, Limits, call, method_of, python_answer, read_answer
from scenarios.experiments.loaded_scenario import load
from scenarios.experiments.verdict import Claim
from scenarios.results.problem_folder import GivenProblem, read_problem, write_problem
from scenarios.results.run_folder import simulated_problem
from scenarios.support.errors import ScenarioError

LIMITS = Limits(time_s=60.0, memory_gb=2.0)


@pytest.fixture(scope="module")
def problem(scenario) -> GivenProblem:
    done = load(scenario).simulate(5)
    return simulated_problem(done.setup, done.recordings)


@pytest.fixture(scope="module")
def folder(problem, tmp_path_factory) -> Path:
    write_problem(folder := tmp_path_factory.mktemp("posed"), problem)
    return folder


def asked(text: str, folder: Path, limits: Limits = LIMITS) -> Call:
    return call(method_of(text), folder, 6, limits)


def script(folder: Path, text: str) -> str:
    path = folder / "method.py"
    path.write_text(text)
    return f"exec: {sys.executable} {path}"


def as_in_python(claims: Sequence[Claim], folder: Path) -> bool:
    told = least_squares(read_problem(folder))
    return list(claims) == [Claim(*map(each.get, ("estimate", "std", "reason"))) for each in told]


@pytest.mark.slow
@pytest.mark.parametrize("text", ["ls-2011", "method_stubs:least_squares"])
def test_a_method_in_its_own_process_finds_the_gains_that_it_finds_here(text, folder):
    assert as_in_python(asked(text, folder).outcome, folder)


COUNTS = """import json, sys, pathlib
problem = json.loads((pathlib.Path(sys.argv[-1]) / "problem.json").read_text())
gains = [{"joint": j, "estimate": j + 0.5, "std": None, "identifiable": True} for j in range(1, 7)]
assert sys.argv[1:-1] == ["--fast", "a b"] and len(problem["motions"]) == 2
print(json.dumps({"gains": gains, "more": "of no interest"}))
"""


def test_a_command_is_given_the_folder_as_its_last_word_and_its_answer_is_read(folder, tmp_path):
    called = asked(f"{script(tmp_path, COUNTS)} --fast 'a b'", folder)
    assert called.outcome == tuple(Claim(j + 0.5, None, None) for j in range(1, 7))
    assert 0.0 < called.seconds < LIMITS.time_s


def test_options_of_a_method_and_of_the_identification_reach_it(folder):
    strict = python_answer("ls-2011,max_rel_std=1e-15,noise-floor=0.3", folder)["gains"]
    assert all(gain["estimate"] is None for gain in strict)
    assert "exceeds 1e-13 %" in strict[0]["reason"]
    coarse = python_answer("ls-2011,cutoff-hz=600", folder)["gains"]
    assert "too slow for a cut-off of 600 Hz" in coarse[0]["reason"]


def test_our_own_methods_answer_by_the_schemas_and_refuse_every_joint_of_refused_data(folder, problem, tmp_path):
    found = python_answer("ls-2011", folder)
    for name in ("answer", "result"):
        fits(found, name)
    assert as_in_python(read_answer(json.dumps(found).encode(), 6), folder)
    write_problem(tmp_path, replace(problem, motions=problem.motions[:1]))
    claims = read_answer(json.dumps(python_answer("ls-2011", tmp_path)).encode(), 6)
    assert [claim.value for claim in claims] == [None] * 6
    assert all("no motion carries a payload" in claim.reason for claim in claims)


UNKNOWN = [
    ("ls-2012", "unknown method 'ls-2012'; did you mean 'ls-2011'?"),
    ("ls-2011,friction=load", "unknown key 'friction'; known: none"),
    ("nls,reversal_speed", "option 'reversal_speed': expected KEY=VALUE"),
    ("nowhere_at_all:f", "No module named 'nowhere_at_all'"),
    ("method_stubs:absent", "has no attribute 'absent'"),
    ("exec:", "no command"),
    ("exec: 'unbalanced", "no closing quotation"),
    ("exec: no-such-program-anywhere --fast", "program not found: 'no-such-program-anywhere'"),
]


def test_a_method_that_does_not_exist_is_found_before_it_is_called():
    for text, message in UNKNOWN:
        with pytest.raises(ScenarioError) as caught:
            method_of(text)
        assert message in str(caught.value)
        assert "\n" not in str(caught.value)


def test_a_method_is_known_by_the_content_of_its_files(tmp_path, monkeypatch):
    own = tmp_path / "mine_alone.py"
    monkeypatch.syspath_prepend(str(tmp_path))
    texts = "mine_alone:f", f"exec: {sys.executable} {own} --fast"
    own.write_text("def f(p): return []\n")
    before = [method_of(text).digests for text in texts]
    assert [[name for name, _ in each] for each in before] == [["mine_alone.py"], [Path(sys.executable).name, own.name]]
    own.write_text("def f(p): return [1]\n")
    after = [method_of(text).digests for text in texts]
    assert [a[-1] != b[-1] for a, b in zip(before, after, strict=True)] == [True, True]


HALF_SURE = """import os, sys
import method_stubs  # from the path of the process that asks
def f(problem):
    sys.stdout.write("a line of its own\\n")
    os.system("echo another one")
    return [{"estimate": 0.75}] * (problem.arm.n - 1) + [{"reason": "I dare not"}]
"""


def test_a_function_of_the_working_folder_may_print_and_leave_out_what_follows(folder, tmp_path, monkeypatch):
    (tmp_path / "ident.py").write_text("raise SystemExit('it hides an installed one')\n")
    (tmp_path / "of_this_folder.py").write_text(HALF_SURE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    outcome = asked("of_this_folder:f", folder).outcome
    assert outcome == (*[Claim(0.75, None, None)] * 5, Claim(None, None, "I dare not"))


ENDS = [
    pytest.param("method_stubs:raises", "MethodCrashed", "status 1: ValueError: what is this?", marks=pytest.mark.slow),
    ("exec: sh -c 'echo what is this? >&2; exit 3'", "MethodCrashed", "exit status 3: what is this?"),
    (f"exec: {sys.executable} -c 'bytearray(3*10**9)'", "MethodOutOfMemory", "it requested more than 2 GB"),
    ("exec: false", "MethodCrashed", "exit status 1: it printed no message"),
    ("exec: true", "NoAnswer", "it printed nothing"),
    ("exec: yes", "NoAnswer", "it printed more than 10 MB"),
]


@pytest.mark.parametrize(("text", "kind", "message"), ENDS)
def test_a_method_that_fails_is_an_outcome_with_a_name(text, kind, message, folder):
    error = asked(text, folder).outcome
    assert isinstance(error, ScenarioError), error
    assert error.kind == kind
    assert message in str(error)
    assert "\n" not in str(error)


SLEEPS = """
import os, pathlib, subprocess, time
child = subprocess.Popen(["sleep", "600"])
pathlib.Path("sleepers").write_text(f"{os.getpid()} {child.pid}")
time.sleep(600)
"""


def test_a_method_that_takes_too_long_is_ended_with_all_that_it_started(folder, tmp_path, monkeypatch):
    note = tmp_path / "sleepers"
    monkeypatch.chdir(tmp_path)
    for limit in (0.5, 5.0, 50.0):  # on a busy machine it may not have started anything by then
        called = asked(script(tmp_path, SLEEPS), folder, Limits(time_s=limit, memory_gb=2.0))
        assert called.outcome.kind == "MethodTimedOut"
        assert str(called.outcome) == f"no answer after {limit:g} s"
        assert called.seconds < 5.0 * limit
        if note.exists():
            break
    for number in note.read_text().split():
        state, deadline = Path(f"/proc/{number}/stat"), time.monotonic() + 5.0  # a killed process needs an instant
        while (living := state.exists() and ") Z " not in state.read_text()) and time.monotonic() < deadline:
            time.sleep(0.1)
        assert not living


def answer(*gains: dict) -> bytes:
    return json.dumps({"gains": list(gains)}).encode()


def gain(joint: int = 1, **changes: object) -> dict:
    return {"joint": joint, "estimate": 1.5, "std": 0.25, "identifiable": True, "reason": None, **changes}


REFUSED = {"identifiable": False}
HUGE = b'{"gains": [{"joint": 1, "estimate": %s, "std": %s, "identifiable": true}]}'
MISFITS = [
    (b"", "NoAnswer", "nothing"),
    (b"\xff", "NoAnswer", "invalid JSON"),
    (b"{}", "WrongForm", "gains: field required"),
    (answer(gain(estimate="1.5")), "WrongForm", "gains.0.estimate: input should be a valid number"),
    (answer(gain(identifiable=1)), "WrongForm", "gains.0.identifiable: input should be a valid boolean"),
    (answer(gain(), gain(2)), "WrongJoints", "gains of joints [1, 2]; expected 1 to 1"),
    (answer(gain(estimate=float("nan"))), "NotFinite", "gains.0.estimate"),
    (HUGE % (b"1e999", b"null"), "NotFinite", "gains.0.estimate"),
    (answer(gain(estimate=0.0)), "ImpossibleGain", "a gain of 0.0"),
    (answer(gain(estimate=None)), "ImpossibleGain", "a gain of None"),
    (answer(gain(std=-0.1)), "ImpossibleGain", "a standard deviation of -0.1"),
    (answer(gain(**REFUSED, estimate=None)), "ImpossibleGain", "is refused but has a number"),
    (b"[" * 100000, "NoAnswer", "invalid JSON"),
]


def test_every_misfit_of_an_answer_has_a_name_and_others_are_read_as_they_are_meant():
    for text, kind, message in MISFITS:
        with pytest.raises(ScenarioError) as caught:
            read_answer(text, 1)
        assert (caught.value.kind, message in str(caught.value)) == (kind, True), str(caught.value)
        assert len(str(caught.value)) < 300
    refused = gain(3, estimate=None, std=None, reason="no", **REFUSED)
    text = answer(gain(), gain(2, estimate=-3, std=None), refused)
    assert read_answer(text, 3) == (Claim(1.5, 0.25, None), Claim(-3.0, None, None), Claim(None, None, "no"))
    assert read_answer(answer(gain(std=0.0)), 1)[0].std == 0.0
