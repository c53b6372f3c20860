"""Commands beside `rx90 identify` with a payload ask as well whether one log counts currents otherwise."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from ident.one_log import Counting
from ident.own_torque import Scale
from known_logs import arm_of
from printed import printed
from real_friction import Truth, real_logs, three_axes
from weighed_cell import MODEL

from ident.errors import Contradiction
from ident.estimators.nls import AllJointsOptions
from ident.identification import Recorded
from ident.observation import ObserveOptions
from ident.options import GainOptions
from ident.problem import Problem
from ident.recording import Recording
from ident.recording_files import read_recording, write_recording
from ident.structure import structure_of
from scenarios.bare import BareAnswer, bare_answer
from scenarios.cli import main
from scenarios.patching.values import Unknown
from scenarios.reports.bare import bare_report

PLAIN = AllJointsOptions(friction="viscous-coulomb")
OTHERWISE: dict[str, tuple[Callable[[np.ndarray], np.ndarray], str]] = {
    "thousandth": (lambda v: 1e3 * v, r"v2 counts 1\.01e\+03 times, v3"),
    "second": (lambda v: v * np.where(np.arange(6) == 1, 1.15, 1.0), r"v2 counts 1\.1[4-7] times those of .*unloaded"),
}


def counted(log: Recording, change: Callable[[np.ndarray], np.ndarray]) -> Recording:
    return Recording(log.t, log.q, change(log.v), log.name)


def changed_friction(
    problem: Problem, names: Sequence[str], wired: Callable[[], None], *, bare: bool = False
) -> list[Counting]:
    """What logs say one joint of which alone had other friction, and whose links are too light to tell a scale."""
    friction = (1.0, 1.4, 1.01)
    scales = tuple(Scale(joint=j, value=1.0, std=0.2, evidence=0.1, friction=each) for j, each in enumerate(friction))
    return [Counting(first=names[0], second=names[1], scales=scales)]


def answer(logs: list[Recording]) -> BareAnswer:
    return bare_answer(
        [Recorded(each) for each in logs],
        structure_of(arm_of(three_axes())),
        observing=ObserveOptions(),
        gains=GainOptions(),
        options=PLAIN,
        known=None,
        payload=None,
    )


@pytest.fixture(scope="module")
def bare() -> list[Recording]:
    first, second = real_logs(Truth(), (None, None), np.random.default_rng(5))
    return [first, Recording(second.t, second.q, second.v, "second")]


@pytest.mark.parametrize("which", OTHERWISE)
def test_a_verification_names_currents_that_one_log_counts_otherwise(which, weighed_cell, tmp_path, capsys):
    change, said = OTHERWISE[which]
    run: Path = weighed_cell / "run"
    write_recording(counted(read_recording(run / "light.parquet"), change), tmp_path / "light.parquet")
    words = ["--model", MODEL, "--gains", str(weighed_cell / "gains.toml"), "--unloaded", str(run / "unloaded.parquet")]
    words += ["--loaded", str(tmp_path / "light.parquet"), "--payload", str(run / "payload-light.toml")]
    assert main(["verify", *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert re.search(said, err)


def test_bare_motions_are_refused_where_one_counts_currents_otherwise(bare):
    first, second = bare
    with pytest.raises(Contradiction, match=r"second: .*v2 counts 1e.03 times, v3 counts 999 times those of bare"):
        answer([first, counted(second, lambda v: 1e3 * v)])
    with pytest.raises(Contradiction, match=r"second: v2 counts 1\.1[4-6] times those of bare"):
        answer([first, counted(second, lambda v: v * [1.0, 1.15, 1.0])])


def test_sound_bare_motions_give_ratios_without_a_note(bare):
    assert answer(bare).notes == ()


def test_friction_that_changed_on_one_joint_alone_is_noted_of_bare_motions(bare, monkeypatch):
    monkeypatch.setattr("scenarios.bare.alike", changed_friction)
    found = answer(bare)
    (note,) = found.notes
    assert note.startswith("second: friction of joint 2 alone is 1.4 times that in bare")
    report = bare_report(found, Unknown("not asked"), arm_of(three_axes()))
    assert note in report.document["notes"]
    assert any(note[1:] in str(part) for part in report.parts)


def test_friction_that_changed_on_one_joint_alone_is_noted_of_a_verification(weighed_cell, monkeypatch, capsys):
    monkeypatch.setattr("scenarios.weighing.problem.alike", changed_friction)
    run: Path = weighed_cell / "run"
    words = ["--model", MODEL, "--gains", str(weighed_cell / "gains.toml"), "--unloaded", str(run / "unloaded.parquet")]
    words += ["--loaded", str(run / "light.parquet"), "--payload", str(run / "payload-light.toml"), "--json"]
    assert main(["verify", *words]) == 0
    assert any("friction of joint 2 alone is 1.4 times" in note for note in printed(capsys, "verify")["notes"])
