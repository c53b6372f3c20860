"""Methods from elsewhere: how they are named, what they may take, and what of an answer is believed."""

import json
import multiprocessing
import os
import subprocess
import sys
import time
from pathlib import Path

import jsonschema
import numpy as np
import pytest

import scenarios.support.errors as errors
from ident.model.structure import Structure
from scenarios.benchmark.comparison.exact import OBSERVING, TRUSTING, exact_motions
from scenarios.benchmark.methods import METHOD_KINDS, method_of
from scenarios.benchmark.methods.answer import read_answer
from scenarios.benchmark.methods.call import Call, Limits, call
from scenarios.experiments.judge import Claim
from scenarios.experiments.robots import robot
from scenarios.results.json_schemas import schema
from scenarios.results.problem_folder import write_problem
from scenarios.support.errors import MethodError, ScenarioError

LIMITS = Limits(time_s=30.0, memory_gb=2.0)


@pytest.fixture(scope="module")
def folder(structure: Structure, tmp_path_factory) -> Path:
    place = tmp_path_factory.mktemp("exact") / "problem"
    motions = exact_motions(structure, 4, noise=0.0).motions
    write_problem(place, robot(), (), motions, observing=OBSERVING, gains=TRUSTING)
    return place


def asked(text: str, folder: Path, limits: Limits = LIMITS) -> Call:
    return call(method_of(text), folder, 6, limits)


def failure(text: str, folder: Path, limits: Limits = LIMITS) -> MethodError:
    outcome = asked(text, folder, limits).outcome
    assert isinstance(outcome, MethodError), outcome
    return outcome


def script(folder: Path, text: str) -> str:
    path = folder / "method.py"
    path.write_text(text)
    return f"exec: {sys.executable} {path}"


# What is asked, and what comes back


@pytest.mark.parametrize("text", ["ls-2011", "nls", "nls,friction=viscous-coulomb", "method_stubs:least_squares"])
def test_a_method_in_its_own_process_finds_exact_gains(text, folder, structure):
    outcome = asked(text, folder).outcome
    found = np.array([claim.value for claim in outcome])
    gain = exact_motions(structure, 4, noise=0.0).gain
    np.testing.assert_allclose(found, gain, rtol=1e-8)  # filters and differences: 1e-9
    assert all(claim.std > 0.0 and claim.reason is None for claim in outcome)


def test_a_command_is_given_the_folder_as_its_last_word_and_its_answer_is_read(folder, tmp_path):
    text = script(
        tmp_path,
        "import json, sys, pathlib\n"
        "problem = json.loads((pathlib.Path(sys.argv[-1]) / 'problem.json').read_text())\n"
        "gains = [{'joint': j, 'estimate': j + 0.5, 'std': None, 'identifiable': True} for j in range(1, 7)]\n"
        "assert sys.argv[1:-1] == ['--fast', 'a b'] and len(problem['motions']) == 2\n"
        "print(json.dumps({'gains': gains, 'more': 'of no interest'}))\n",
    )
    outcome = asked(f"{text} --fast 'a b'", folder).outcome
    assert outcome == tuple(Claim(j + 0.5, None, None) for j in range(1, 7))


def test_what_a_function_leaves_out_follows_and_what_it_prints_is_not_its_answer(folder):
    outcome = asked("method_stubs:half_sure", folder).outcome
    assert outcome == (*[Claim(0.75, None, None)] * 5, Claim(None, None, "I dare not"))


def test_options_of_a_method_and_of_the_identification_reach_it(folder):
    strict = asked("ls-2011,max_rel_std=1e-15,noise-floor=0.3", folder).outcome
    assert all(claim.value is None for claim in strict)
    assert "exceeds 1e-13 %" in strict[0].reason
    coarse = asked("ls-2011,cutoff-hz=600", folder).outcome
    assert "too slow for a cut-off of 600 Hz" in coarse[0].reason


def test_data_that_are_refused_as_a_whole_are_every_joint_refused(structure, tmp_path):
    motions = exact_motions(structure, 4, noise=0.0).motions
    write_problem(tmp_path / "p", robot(), (), motions[:1], observing=OBSERVING, gains=TRUSTING)
    outcome = asked("ls-2011", tmp_path / "p").outcome
    assert [claim.value for claim in outcome] == [None] * 6
    assert all("no motion carries a payload" in claim.reason for claim in outcome)


def test_every_call_has_a_process_of_its_own(folder):
    numbers = {asked("method_stubs:by_place", folder).outcome[0].value for _ in range(2)}
    assert len(numbers | {float(os.getpid())}) == 3


def test_a_method_is_called_in_a_daemon_too_as_the_workers_of_dask_are(folder, monkeypatch):
    monkeypatch.setitem(multiprocessing.current_process()._config, "daemon", True)
    assert asked("method_stubs:constant", folder).outcome == (Claim(1.0, 0.25, None),) * 6


# How methods are named

UNKNOWN = [
    ("ls-2012", "unknown method 'ls-2012'; did you mean 'ls-2011'?"),
    ("", "unknown method ''"),
    ("ls-2011,friction=load", "unknown option 'friction'; known: none"),
    ("nls,friction=glue", "friction = 'glue': expected one of auto"),
    ("nls,max_rel_std=-1", "max_rel_std = -1: expected more than 0"),
    ("nls,reversal_speed", "option 'reversal_speed': expected KEY=VALUE"),
    ("nowhere_at_all:f", "No module named 'nowhere_at_all'"),
    ("method_stubs:absent", "module method_stubs has no function absent"),
    ("method_stubs:NOT_CALLABLE", "module method_stubs has no function NOT_CALLABLE"),
    ("method_stubs:", "expected package.module:function"),
    ("a b:c", "expected package.module:function"),
    ("exec:", "no command"),
    ("exec: 'unbalanced", "no closing quotation"),
    ("exec: no-such-program-anywhere --fast", "program not found: 'no-such-program-anywhere'"),
]


@pytest.mark.parametrize(("text", "message"), UNKNOWN, ids=lambda value: None)
def test_a_method_that_does_not_exist_is_found_before_it_is_called(text, message):
    with pytest.raises(ScenarioError) as caught:
        method_of(text)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_every_kind_claims_texts_of_its_own():
    texts = {"exec": "exec: true", "function": "method_stubs:constant", "estimator": "nls"}
    assert set(texts) == set(METHOD_KINDS)
    order = list(METHOD_KINDS)
    for name, text in texts.items():
        earlier = order[: order.index(name)]
        assert all(METHOD_KINDS[kind](text) is None for kind in earlier)
        assert METHOD_KINDS[name](text).text == text


def test_a_method_is_known_by_the_content_of_its_files(tmp_path, monkeypatch):
    own = tmp_path / "mine_alone.py"
    monkeypatch.syspath_prepend(str(tmp_path))
    own.write_text("def f(p): return []\n")
    by_function = method_of("mine_alone:f").digests
    by_command = method_of(f"exec: {sys.executable} {own} --fast").digests
    assert [name for name, _ in by_function] == ["mine_alone.py"]
    assert [name for name, _ in by_command] == [Path(sys.executable).name, "mine_alone.py"]
    own.write_text("def f(p): return [1]\n")
    assert method_of("mine_alone:f").digests != by_function
    assert method_of(f"exec: {sys.executable} {own} --fast").digests[1] != by_command[1]


# What they may take

ENDS = [
    ("method_stubs:raises", "MethodCrashed", "exit status 1: ValueError: what is this?"),
    ("method_stubs:aborts", "MethodCrashed", "ended by SIGABRT"),
    ("method_stubs:leaves", "NoAnswer", "it printed nothing"),
    ("method_stubs:devours", "MethodOutOfMemory", "it requested more than 2 GB"),
    ("method_stubs:not_a_number", "NotFinite", "a number is NaN"),
    ("method_stubs:infinite", "NotFinite", "a number is Infinity"),
    ("method_stubs:one_short", "WrongJoints", "expected 1 to 6"),
    ("exec: false", "MethodCrashed", "exit status 1: it printed no message"),
    ("exec: echo", "NoAnswer", "it printed no JSON"),
    ("exec: yes", "NoAnswer", "it printed more than 10 MB"),
]


@pytest.mark.parametrize(("text", "kind", "message"), ENDS, ids=[text for text, *_ in ENDS])
def test_a_method_that_fails_is_an_outcome_with_a_name(text, kind, message, folder):
    error = failure(text, folder)
    assert type(error).__name__ == kind
    assert message in str(error)
    assert "\n" not in str(error)


SLEEPS = """
import os, pathlib, subprocess, time
child = subprocess.Popen(["sleep", "600"])
pathlib.Path("sleepers").write_text(f"{os.getpid()} {child.pid}")
time.sleep(600)
"""


@pytest.mark.parametrize("text", ["method_stubs:sleeps", "exec"])
def test_a_method_that_takes_too_long_is_ended_with_all_that_it_started(text, folder, tmp_path, monkeypatch):
    note = tmp_path / "sleepers"
    monkeypatch.chdir(tmp_path)
    if text == "exec":
        text = script(tmp_path, SLEEPS)
    for limit in (1.0, 10.0, 90.0):  # on a busy machine a method may not have started anything by then
        started = time.perf_counter()
        error = failure(text, folder, Limits(time_s=limit, memory_gb=2.0))
        assert type(error).__name__ == "MethodTimedOut"
        assert str(error) == f"no answer after {limit:g} s"
        assert time.perf_counter() - started < 5.0 * limit
        if note.exists():
            break
    for number in map(int, note.read_text().split()):
        assert not _alive(number)


def _alive(number: int) -> bool:
    state = Path(f"/proc/{number}/stat")
    for _ in range(50):  # a killed process needs an instant
        if not state.exists() or ") Z " in state.read_text():
            return False
        time.sleep(0.1)
    return True


def test_after_a_crash_and_a_time_out_the_next_call_is_answered(folder):
    failure("method_stubs:aborts", folder)
    failure("method_stubs:raises", folder)
    assert asked("method_stubs:constant", folder).outcome[5] == Claim(1.0, 0.25, None)


def test_a_program_that_goes_between_two_calls_is_an_outcome(folder, tmp_path):
    program = tmp_path / "method"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    method = method_of(f"exec: {program}")
    program.unlink()
    outcome = call(method, folder, 6, LIMITS).outcome
    assert type(outcome).__name__ == "MethodNotStarted"
    assert "No such file" in str(outcome)


# What of an answer is believed


def answer(*gains: dict) -> str:
    return json.dumps({"gains": list(gains)})


def gain(joint: int = 1, **changes: object) -> dict:
    return {"joint": joint, "estimate": 1.5, "std": 0.25, "identifiable": True, "reason": None, **changes}


MISFITS = [
    ("", "NoAnswer", "nothing"),
    ("gains: 1", "NoAnswer", "no JSON"),
    ("[1.5]", "NoAnswer", "expected one JSON object"),
    ("{}", "WrongForm", "gains: field required"),
    (answer({"joint": 1}), "WrongForm", "gains.0.estimate: field required"),
    (answer(gain(estimate="1.5")), "WrongForm", "gains.0.estimate: input should be a valid number"),
    (answer(gain(estimate=True)), "WrongForm", "gains.0.estimate: input should be a valid number"),
    (answer(gain(identifiable=1)), "WrongForm", "gains.0.identifiable: input should be a valid boolean"),
    (answer(gain(joint=1.0)), "WrongForm", "gains.0.joint: input should be a valid integer"),
    (answer(gain(joint=2)), "WrongJoints", "gains of joints [2]; expected 1 to 1"),
    (answer(gain(), gain(2)), "WrongJoints", "gains of joints [1, 2]; expected 1 to 1"),
    (answer(), "WrongJoints", "expected 1 to 1"),
    (answer(gain(estimate=float("nan"))), "NotFinite", "NaN"),
    ('{"gains": [{"joint": 1, "estimate": 1e999, "std": null, "identifiable": true}]}', "NotFinite", "estimate is inf"),
    ('{"gains": [{"joint": 1, "estimate": 1, "std": 1e999, "identifiable": true}]}', "NotFinite", "std is inf"),
    (answer(gain(estimate=0.0)), "ImpossibleGain", "a gain of 0.0"),
    (answer(gain(estimate=None)), "ImpossibleGain", "a gain of None"),
    (answer(gain(std=-0.1)), "ImpossibleGain", "a standard deviation of -0.1"),
    (answer(gain(identifiable=False)), "ImpossibleGain", "is refused but has a number"),
    (answer(gain(identifiable=False, estimate=None)), "ImpossibleGain", "is refused but has a number"),
    (answer(gain(identifiable=False, std=None)), "ImpossibleGain", "is refused but has a number"),
    ("[" * 100000, "NoAnswer", "no JSON"),
]


@pytest.mark.parametrize(("text", "kind", "message"), MISFITS, ids=lambda value: None)
def test_every_misfit_of_an_answer_has_a_name(text, kind, message):
    with pytest.raises(getattr(errors, kind)) as caught:
        read_answer(text, 1)
    assert message in str(caught.value)
    assert len(str(caught.value)) < 300


def test_an_answer_is_read_as_it_is_meant():
    text = answer(
        gain(), gain(2, estimate=-3, std=None), gain(3, estimate=None, std=None, identifiable=False, reason="no")
    )
    assert read_answer(text, 3) == (Claim(1.5, 0.25, None), Claim(-3.0, None, None), Claim(None, None, "no"))
    assert read_answer(answer(gain(std=0.0)), 1)[0].std == 0.0


LATE = """
import importlib, json, pathlib, sys
from scenarios.benchmark.methods.call import IMPORTED, python_answer
for name in IMPORTED:
    importlib.import_module(name)
before = set(sys.modules)
print(json.dumps(python_answer("ls-2011", pathlib.Path(sys.argv[1]))))
print(*set(sys.modules) - before, file=sys.stderr)
"""


def test_our_own_methods_answer_by_the_schema_and_import_what_they_need_before_their_process_is_forked(folder):
    done = subprocess.run([sys.executable, "-c", LATE, str(folder)], capture_output=True, text=True, check=True)
    for name in ("answer", "result"):
        jsonschema.Draft202012Validator(schema(name)).validate(json.loads(done.stdout))
    assert read_answer(done.stdout, 6)[0].value == asked("ls-2011", folder).outcome[0].value
    late = {name.partition(".")[0] for name in done.stderr.split()}
    assert late
    assert not late & {"pandas", "pinocchio", "scipy", "ident", "scenarios"}
