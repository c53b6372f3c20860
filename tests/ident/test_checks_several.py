"""More than one mistake in logs: what a second look finds, and where to begin."""

from dataclasses import replace

import ident.checks.several as several
import numpy as np
import pytest
from ident.checks.check import check
from ident.checks.comparison import Alternative, Logs, prepared
from ident.checks.remark import Grade
from ident.checks.several import Several, mended, several_mistakes, several_remark
from ident.readings import Reading, as_it_is
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, arm_of, known_logs, ur_like

from ident.observation import ObserveOptions
from ident.options import GainOptions
from ident.recording import Recording
from ident.structure import structure_of

OBSERVING = ObserveOptions()


@pytest.fixture(scope="module")
def logs() -> Logs:
    structure = structure_of(arm_of(ur_like()))
    recordings = known_logs(ur_like(), BRICK, np.abs(UR_GAIN), np.random.default_rng(51), middle=UR_MIDDLE)
    return prepared(structure, recordings, OBSERVING)


def two_mistakes(log: Recording) -> Recording:
    q, v = log.q.copy(), log.v.copy()
    q[:, 1] = -q[:, 1]
    q[:, 3] += np.pi / 2
    return Recording(log.t, q, v, log.name)


def test_of_two_mistakes_none_is_named_as_sure_and_where_to_begin_is_told(logs):
    faulty = [two_mistakes(each) for each in logs.recordings]
    found = check(faulty, logs.structure, observing=OBSERVING, gains=GainOptions())
    assert found.named == ()
    (line,) = [each for each in found.remarks if each.topic == "signs, zeros, order, base"]
    assert line.grade is Grade.WRONG
    assert line.seen.startswith("more than one thing is wrong; perhaps q2 ")
    assert "begin with joint 2," in line.advice


def reading(logs: Logs, words: str, **more) -> Reading:
    return replace(as_it_is(logs.arm), words=words, **more)


def test_what_is_mended_is_the_log_as_the_reading_means_it(logs):
    n = logs.arm.n
    factor, zero, order = np.ones(n), np.zeros(n), np.arange(n)
    factor[2], zero[4] = -1.0, 0.7
    order[[0, 5]] = [5, 0]
    found = mended(logs, reading(logs, "x", factor=factor, zero=zero, q_order=order), OBSERVING)
    for mine, log in zip(found.recordings, logs.recordings, strict=True):
        expected = log.q[:, order] * factor + zero
        np.testing.assert_array_equal(mine.q, expected)
        np.testing.assert_array_equal(mine.v, log.v)
    other = mended(logs, reading(logs, "y", v_order=order), OBSERVING)
    np.testing.assert_array_equal(other.recordings[1].v, logs.recordings[1].v[:, order])
    assert other.structure is logs.structure
    stretch, gravity = np.ones(n), np.array([0.0, 9.81, 0.0])
    stretch[3] = 1.25
    arm = mended(logs, reading(logs, "z", stretch=stretch), OBSERVING).arm
    np.testing.assert_array_equal(arm.translation[3], 1.25 * logs.arm.translation[3])
    np.testing.assert_array_equal(arm.translation[2], logs.arm.translation[2])
    np.testing.assert_array_equal(mended(logs, reading(logs, "g", gravity=gravity), OBSERVING).arm.gravity, gravity)


def alternative(logs: Logs, words: str) -> Alternative:
    return Alternative((reading(logs, words),), np.zeros(6), 99.0, borne_out=True)


def looked_at(logs: Logs, monkeypatch, after: dict[str, list[str]], sure: list[str]) -> Several | None:
    """The second look where what is sure after each first change is stated."""
    monkeypatch.setattr(several, "mended", lambda logs, first, _: first)
    monkeypatch.setattr(several, "motor_side", lambda first: first)
    monkeypatch.setattr(several, "compared", lambda first, more: first if more is first else None)
    monkeypatch.setattr(
        several, "better_readings", lambda first: [alternative(logs, words) for words in after[first.words]]
    )
    return several_mistakes(logs, [alternative(logs, words) for words in sure], OBSERVING)


def test_a_second_look_that_finds_nothing_leaves_one_mistake(logs, monkeypatch):
    assert looked_at(logs, monkeypatch, {}, []) is None
    assert looked_at(logs, monkeypatch, {"a": []}, ["a"]) is None
    assert looked_at(logs, monkeypatch, {"a": ["x"], "b": []}, ["a", "b"]) is None  # b alone is enough


def test_the_best_change_and_the_best_one_after_it_are_told(logs, monkeypatch):
    found = looked_at(logs, monkeypatch, {"a": ["x", "y"], "b": ["z"]}, ["a", "b"])
    assert (found.first.words, found.second.words) == ("a", "x")


def test_where_to_begin_is_what_the_first_change_touches(logs):
    zero, order = np.zeros(6), np.arange(6)
    zero[3], order[[1, 4]] = 1.0, [4, 1]
    for more, joint, begin in (
        ({"zero": zero}, 3, "begin with joint 4, "),
        ({"v_order": order}, 1, "begin with joints 2 and 5, "),
        ({"q_order": order}, 1, "begin with joints 2 and 5, "),
        ({"factor": np.where(np.arange(6) == 5, -1.0, 1.0)}, 5, "begin with joint 6, "),
        ({"factor": np.full(6, 0.1)}, 0, "begin with order, base and units, "),
        ({"gravity": np.ones(3)}, None, "begin with order, base and units, "),
    ):
        told = several_remark(Several(reading(logs, "one", **more), reading(logs, "two")))
        assert (told.grade, told.joint) == (Grade.WRONG, joint)
        assert told.seen.endswith("perhaps one, and then two")
        assert told.advice.startswith(begin)
