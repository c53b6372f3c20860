"""All logs of a check against the model: which mistake is named, which cannot be, what the payload decides."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ident.checks import payload_decides
from ident.checks.check import Checked, check
from ident.checks.comparison import Comparison, prepared, single_readings
from ident.checks.excitation import excitation_remarks, predicted_rel_std
from ident.checks.payload_decides import explained_with_payload, moved_gains, payload_remarks
from ident.checks.remark import Grade
from ident.evidence import EVIDENCE
from ident.explanation import Explanation, unknowns_of
from ident.readings import as_it_is
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, known_logs, ur_like

from ident.arm import load_arm
from ident.errors import RecordingError
from ident.estimators import ls_2011
from ident.identification import ALONE_OPTIONS
from ident.observation import ObserveOptions, observe
from ident.options import GainOptions
from ident.problem import pair
from ident.recording import Recording
from ident.recording_files import read_recording
from ident.structure import structure_of

OBSERVING, GAINS = ObserveOptions(), GainOptions()


@pytest.fixture(scope="module")
def logs() -> tuple[Recording, Recording]:
    return known_logs(ur_like(), BRICK, np.abs(UR_GAIN), np.random.default_rng(51), middle=UR_MIDDLE)


def checked(logs, structure, **more) -> Checked:
    return check(logs, structure, observing=OBSERVING, gains=GAINS, **more)


def changed(logs, *, q=lambda q: q, v=lambda v: v):
    return [Recording(log.t, q(log.q.copy()), v(log.v.copy()), log.name) for log in logs]


def lines(found: Checked, topic: str):
    return [each for each in found.all_remarks if each.topic == topic]


def test_a_clean_pair_is_good(ur, logs):
    found = checked(logs, ur)
    assert found.grade is not Grade.WRONG
    assert found.named == ()
    assert found.backward == ()
    (untold,) = lines(found, "no motion tells")
    assert "q1 plus 90 degrees" in untold.seen


@pytest.mark.parametrize(
    ("factor", "words"),
    [([1, 1, -1, 1, 1, 1], "q3 negated"), ([180 / np.pi] * 6, "all positions in degrees")],
)
def test_a_mistake_is_named_and_wrong(ur, logs, factor, words):
    found = checked(changed(logs, q=lambda q: q * factor), ur)
    assert found.grade is Grade.WRONG
    assert words in found.named
    (line,) = lines(found, "signs, zeros, order, base")
    assert line.grade is Grade.WRONG
    assert words in line.seen


def test_equal_readings_are_named_as_one(ur, logs):
    found = checked(changed(logs, q=lambda q: q * [1, 1, 1, 1, 1, -1]), ur)
    assert {"q6 negated", "q5 plus 180 degrees"} <= set(found.named)
    (line,) = lines(found, "signs, zeros, order, base")
    assert line.seen.startswith("q6 negated = ")  # friction of joint 6 drives: the other would leave it so
    assert found.backward == (5,)


def test_the_wrist_turned_is_told_first_where_friction_brakes(ur, logs):
    def turned(q):
        q[:, 4] += np.pi
        return q

    (line,) = lines(checked(changed(logs, q=turned), ur), "signs, zeros, order, base")
    assert line.seen.startswith("q5 plus 180 degrees = ")


def test_a_current_negated_shows_by_friction_alone(ur, logs):
    expected = np.array([1.0, 1.0, 1.0, -1.0, 1.0, 1.0])
    bad = changed(logs[:1], v=lambda v: v * expected)
    found = checked(bad, ur)
    assert found.backward == (3,)
    assert found.named == ()
    (line,) = lines(found, "friction")
    assert (line.grade, line.joint) == (Grade.WEAK, 3)
    assert checked(bad, ur, about=expected).backward == ()


def test_positions_that_no_joint_reaches_are_wrong_whatever_explains_them(ur, logs):
    arm = replace(ur.arm, lower=np.full(6, -3.5), upper=np.full(6, 3.5))
    beyond = changed(logs, q=lambda q: q + np.pi * np.eye(6)[0])  # no motion shows the zero of joint 1
    low = replace(arm, lower=np.where(np.arange(6) == 0, -1.5, -3.5), upper=np.where(np.arange(6) == 0, 2.1, 3.5))
    found = checked(beyond, replace(ur, arm=low))
    (line,) = lines(found, "reach")
    assert (line.grade, line.joint) == (Grade.WRONG, 0)
    (named,) = lines(found, "signs, zeros, order, base")
    assert "q1 plus 180 degrees puts the joints where they can be" in named.seen


def test_a_log_that_cannot_be_filtered_is_wrong_and_not_compared(ur, logs):
    short = [Recording(log.t[:60], log.q[:60], log.v[:60], log.name) for log in logs]
    found = checked(short, ur)
    assert found.comparison is None
    assert found.grade is Grade.WRONG
    assert found.named == ()
    assert {each.log for each in lines(found, "model")} == {log.name for log in logs}
    assert all(each.seen.startswith("not compared: ") for each in lines(found, "model"))
    assert not any(f"{each.log}: " in each.seen for each in lines(found, "model"))
    assert checked([short[0], logs[0]], ur).comparison is not None


def test_each_log_is_observed_once(ur, logs, monkeypatch):
    asked = list[str]()

    def counted(recording, structure, options):
        asked.append(recording.name)
        return observe(recording, structure, options)

    for module in ("ident.checks.check", "ident.observation"):
        monkeypatch.setattr(f"{module}.observe", counted)
    found = checked(logs[:1], ur)
    assert asked == [logs[0].name]
    assert found.logs[0].observed is not None


def test_a_check_hands_on_what_each_usable_log_carries_and_the_ratio_that_fits(ur, logs, monkeypatch):
    asked = {}
    left = Explanation(as_it_is(ur.arm), np.full(6, 0.03), np.full(6, 900))
    nothing = Comparison(given=left, unreachable=(), same=(), alternatives=())
    stubs = {
        "motor_side": lambda logs: ("a ratio",),
        "compared": lambda logs, more: asked.update(more=more) or nothing,
        "payload_remarks": lambda logs, carrying, payload, same: asked.update(carrying=carrying) or [],
    }
    for name, stub in stubs.items():
        monkeypatch.setattr(f"ident.checks.check.{name}", stub)
    short = Recording(logs[0].t[:60], logs[0].q[:60], logs[0].v[:60], "short")
    found = checked([short, logs[1], logs[0]], ur, payload=BRICK, loaded=[False, True, False], about=np.abs(UR_GAIN))
    assert asked == {"more": ("a ratio",), "carrying": [True, False]}
    assert lines(found, "excitation") == []  # the first that is usable carries it already


def test_a_log_of_another_number_of_joints_is_refused(ur, logs):
    five = Recording(logs[0].t, logs[0].q[:, :5], logs[0].v[:, :5], "five")
    with pytest.raises(RecordingError, match=r"five: 5 joints, but robot ur-like has 6"):
        checked([five], ur)


def reading(structure, words):
    return next(each for each in single_readings(structure.arm) if each.words == words)


def test_the_zero_of_the_last_joint_moves_gains_by_the_payload_beside_its_axis(ur):
    own, last = unknowns_of(ur), reading(ur, "q6 plus 90 degrees")
    assert moved_gains(ur, own, last, BRICK.known_part()) == (0, 1, 2, 3, 4, 5)
    first = reading(ur, "q1 plus 90 degrees")
    assert moved_gains(ur, own, first, BRICK.known_part()) == ()
    # on the axis of joint 6, which is y, and round about it
    pin = replace(BRICK, com=(0.0, 0.13, 0.0), inertia=(0.017, 0.006, 0.017, 0.0, 0.0, 0.0))
    assert moved_gains(ur, own, last, pin.known_part()) == ()


def test_the_payload_as_drawn_decides_about_the_zero_of_the_last_joint(ur, logs):
    last = [reading(ur, "q6 plus 90 degrees")]
    bad = changed(logs, q=lambda q: q - [0, 0, 0, 0, 0, np.pi / 2])
    good, wrong, alone = (prepared(ur, each, OBSERVING) for each in (logs, bad, bad[:1]))
    (line,) = payload_remarks(good, [False, True], BRICK, last)
    assert line.grade is Grade.GOOD
    (line,) = payload_remarks(wrong, [False, True], BRICK, last)
    assert line.grade is Grade.WRONG
    assert line.seen.startswith("q6 plus 90 degrees fits the payload's torque better")
    for seen, carrying in ((alone, [False]), (wrong, [False, False]), (wrong, [True, True])):
        (line,) = payload_remarks(seen, carrying, BRICK, last)
        assert "a bare and a loaded recording with this payload tell" in line.seen
    assert payload_remarks(wrong, [False, True], replace(BRICK, known="mass"), last) == []
    assert payload_remarks(wrong, [False, True], BRICK, [reading(ur, "q1 plus 90 degrees")]) == []


def test_another_zero_that_makes_a_wrong_centre_a_little_better_is_no_name_for_it(ur, logs):
    last = reading(ur, "q6 plus 90 degrees")
    drawn = replace(BRICK, com=(-0.05, 0.11, 0.07))  # the axes taken in another order
    good = prepared(ur, logs, OBSERVING)
    given, other = (
        explained_with_payload(good, [False, True], drawn.known_part(), x) for x in (as_it_is(ur.arm), last)
    )
    better = next(each for each in (given, other) if each.left.sum() == min(given.left.sum(), other.left.sum()))
    assert better is other
    (line,) = payload_remarks(good, [False, True], drawn, [last])
    assert line.grade is Grade.WEAK
    assert line.seen == "the payload's torque is not as described: q6 plus 90 degrees fits it better, but not well"


def seen_moving(logs, moving):
    """Logs of which only some instants show a joint, by what is given of each motion's."""
    return replace(logs, seen=tuple(replace(at, moving=at.moving & moving(at.moving)) for at in logs.seen))


def test_a_joint_that_hardly_moves_leaves_the_others_to_decide_about_the_payload(ur, logs):
    bad = prepared(ur, changed(logs, q=lambda q: q - [0, 0, 0, 0, 0, np.pi / 2]), OBSERVING)
    still = seen_moving(bad, lambda moving: np.arange(6) != 1)
    (line,) = payload_remarks(still, [False, True], BRICK, [reading(ur, "q6 plus 90 degrees")])
    assert line.grade is Grade.WRONG
    assert line.joint != 1


def test_what_a_payload_says_takes_the_evidence_of_instants_that_show_a_joint(ur, logs):
    last, known = reading(ur, "q6 plus 90 degrees"), BRICK.known_part()
    bad = prepared(ur, changed(logs, q=lambda q: q - [0, 0, 0, 0, 0, np.pi / 2]), OBSERVING)
    told = set[Grade]()
    for step in (12, 16, 20, 24, 28):  # joint 6 alone shows, at one instant of so many
        few = seen_moving(bad, lambda moving, k=step: (np.arange(len(moving)) % k == 0)[:, None] & (np.arange(6) == 5))
        given, other = (explained_with_payload(few, [False, True], known, each) for each in (as_it_is(ur.arm), last))
        gain = float(np.log(given.left[5] / other.left[5]))
        assert gain * sum(len(at.v) for at in few.seen) > EVIDENCE
        (line,) = payload_remarks(few, [False, True], BRICK, [last])
        assert (line.grade is Grade.WRONG) == (gain * given.freedom[5] > EVIDENCE)
        told.add(line.grade)
    assert told == {Grade.GOOD, Grade.WRONG}


def test_friction_and_offset_may_be_others_in_every_motion_after_the_first(rng):
    own, motion = rng.normal(size=(7, 84)), np.array([0, 0, 1, 1, 1, 2, 2])
    expected = np.zeros((7, 6))
    last_three = own[:, 14 * 2 + 11 : 14 * 3]
    expected[2:5, :3], expected[5:, 3:] = last_three[2:5], last_three[5:]
    np.testing.assert_array_equal(payload_decides._again(own, 2, motion), expected)
    assert payload_decides._again(own[:2], 2, motion[:2]).shape == (2, 0)


def test_a_check_with_a_payload_asks_it(ur, logs):
    bad = changed(logs, q=lambda q: q - [0, 0, 0, 0, 0, np.pi / 2])
    found = checked(bad, ur, payload=BRICK, loaded=[False, True])
    assert [each.grade for each in lines(found, "payload as drawn")] == [Grade.WRONG]


def test_the_deviation_that_is_predicted_is_that_of_the_loaded_motion(ur, logs):
    """The same motion, recorded with the payload, gives deviations of the same size by the estimator itself."""
    bare, loaded = (observe(log, ur, OBSERVING) for log in logs)
    predicted = predicted_rel_std(bare, BRICK, np.abs(UR_GAIN), GAINS)
    found = ls_2011.joint_by_joint_gains(pair(bare, loaded, BRICK, GAINS), ALONE_OPTIONS)
    expected = [joint.predicted_rel_std for joint in found.joints]
    # currents of the loaded motion are larger, and 5 % of them is the floor; its uncertainty allows for stretches
    np.testing.assert_allclose(predicted, expected, rtol=0.4)
    wired = np.abs(UR_GAIN) * [1, -1, 1, -1, -1, 1]
    assert predicted_rel_std(bare, BRICK, wired, GAINS) == predicted


def test_joints_whose_gain_would_not_be_good_enough_are_listed():
    options = replace(GAINS, max_rel_std=0.07)
    (line,) = excitation_remarks("bare", (0.0123, None, 0.071, 0.069, 0.5), options)
    assert (line.grade, line.log) == (Grade.WEAK, "bare")
    assert line.seen.endswith("joint by joint: 1.2, -, 7.1, 6.9, 50 %")
    assert str(line.advice).endswith("for joint 2, 3, 5")
    (line,) = excitation_remarks("bare", (0.0123, 0.069), options)
    assert (line.grade, line.advice) == (Grade.GOOD, None)


@pytest.mark.slow
def test_a_payload_that_a_joint_does_not_feel_is_told_before_it_is_mounted(ur, logs):
    bare, about = observe(logs[0], ur, OBSERVING), np.abs(UR_GAIN)
    (line,) = excitation_remarks("bare", predicted_rel_std(bare, BRICK, about, GAINS), GAINS)
    assert line.grade is Grade.GOOD
    speck = replace(BRICK, mass=0.002, inertia=(2e-6, 2e-6, 2e-6, 0.0, 0.0, 0.0), mass_std=0.0)
    (line,) = excitation_remarks("bare", predicted_rel_std(bare, speck, about, GAINS), GAINS)
    assert line.grade is Grade.WEAK
    assert "for joint 1, 2, 3, 4, 5, 6" in str(line.advice)


@pytest.mark.parametrize(("about", "many"), [(np.abs(UR_GAIN), 1), (None, 0)])
def test_deviations_are_predicted_where_somebody_knows_the_gains(ur, logs, about, many):
    assert len(lines(checked(logs[:1], ur, payload=BRICK, about=about), "excitation")) == many


@pytest.mark.real
@pytest.mark.parametrize("folder", ["ur10e", pytest.param("ur10e_december", marks=pytest.mark.slow)])
def test_nothing_is_wrong_with_the_real_pairs(real: Path, folder):
    structure = structure_of(load_arm(real / "ur10e" / "ur10e.urdf"))
    pair = [read_recording(real / folder / f"{name}.parquet") for name in ("unloaded", "loaded")]
    assert checked(pair, structure).grade is not Grade.WRONG
    assert checked(pair[:1], structure).grade is not Grade.WRONG


@pytest.mark.slow
@pytest.mark.real
def test_nothing_is_wrong_with_the_real_tx40_and_a_negated_joint_is(real: Path):
    structure = structure_of(load_arm(real / "tx40" / "tx40.urdf", couplings=((4, 5),)))
    log = read_recording(real / "tx40" / "recording.parquet")
    assert checked([log], structure).grade is not Grade.WRONG
    bad = checked(changed([log], q=lambda q: q * [1, -1, 1, 1, 1, 1]), structure)
    assert "q2 negated" in bad.named
