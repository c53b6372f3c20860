"""A log of another wiring is refused by name, with little known of the payload; one of this arm is not."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from corruptions import CHANGES, CURES, corrupted, shifted
from ident.evidence import BETTER, EVIDENCE, LENGTH_EVIDENCE, gain_over
from ident.explanation import Explanation, explanations, unknowns_of, unknowns_under_any
from ident.instants import instants
from ident.one_log_readings import agree
from ident.readings import readings
from ident.wiring import check_wiring, known_wiring
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, arm_of, known_logs, ur_like

import scenarios.run
from ident import wiring
from ident.arm import load_arm
from ident.errors import Contradiction
from ident.identification import identify
from ident.observation import ObserveOptions
from ident.recording import Recording
from ident.recording_files import read_recording
from ident.structure import Structure, structure_of

OPTIONS = ObserveOptions()
NAMED = ("joint 1 negated", "joint 3 negated", "joint 5 negated", "joint 6 negated", "joint 2 at +pi/2",
         "joint 4 at -pi/2", "joint 5 at -pi/2", "joints 1 and 2 swapped", "joints 4 and 5 swapped")  # fmt: skip


@pytest.fixture(scope="module")
def ur() -> Structure:
    return structure_of(arm_of(ur_like()))


@pytest.fixture(scope="module")
def logs() -> tuple[Recording, Recording]:
    return known_logs(ur_like(), BRICK, UR_GAIN, np.random.default_rng(21), middle=UR_MIDDLE)


@pytest.mark.parametrize("change", NAMED)
def test_the_mistake_is_named(ur, logs, change):
    with pytest.raises(Contradiction, match=re.escape(CURES[change])) as caught:
        check_wiring(ur, *corrupted(logs, CHANGES[change]), OPTIONS)
    assert "\n" not in str(caught.value)


def test_readings_that_explain_as_well_as_the_log_itself_are_no_mistake(ur, logs):
    for joint, angle in ((0, 0.9), (0, np.pi / 2), (5, -np.pi / 2), (5, np.pi)):  # the first and the last axis
        check_wiring(ur, *corrupted(logs, shifted(joint, angle)), OPTIONS)


def test_exchanged_currents_and_exchanged_joints_are_told_from_exchanged_positions(ur, logs):
    order = [0, 2, 1, 3, 4, 5]
    currents = (Recording(log.t, log.q, log.v[:, order], log.name) for log in logs)
    with pytest.raises(Contradiction, match=r"this one: columns v2 and v3 exchanged \("):
        check_wiring(ur, *currents, OPTIONS)
    joints = (Recording(log.t, log.q[:, order], log.v[:, order], log.name) for log in logs)
    with pytest.raises(Contradiction, match=r"this one: joints 2 and 3 exchanged \("):
        check_wiring(ur, *joints, OPTIONS)


def test_a_base_on_the_ceiling_and_a_shorter_arm_are_named(logs):
    ceiling = structure_of(arm_of(ur_like((0.0, 0.0, 9.81))))
    with pytest.raises(Contradiction, match=r"this one: gravity along \(0, 0, -1\) of the base \("):
        check_wiring(ceiling, *logs, OPTIONS)
    arm = arm_of(ur_like())
    short = structure_of(replace(arm, translation=0.8 * arm.translation))
    with pytest.raises(Contradiction, match=r"this one: every length times 1\.2[3-8], or t times 0\.(88|89|9)"):
        check_wiring(short, *logs, OPTIONS)


@pytest.mark.parametrize("noise", [0.02, 0.1])
def test_a_log_without_weight_is_called_gravity_compensated(ur, noise):
    afloat = ur_like((0.0, 0.0, 0.0))
    logs = known_logs(afloat, BRICK, UR_GAIN, np.random.default_rng(4), middle=UR_MIDDLE, noise=noise)
    with pytest.raises(Contradiction, match=r"without the weight of links and payload \(.*: v is gravity-compensated"):
        check_wiring(ur, *logs, OPTIONS)


def test_a_log_without_the_weight_of_its_own_links_still_gives_the_gains(ur):
    # A controller that knows of no payload leaves its weight in v, and gains come from that.
    model, truth = ur_like(), UR_GAIN
    logs = known_logs(model, BRICK, truth, np.random.default_rng(7), middle=UR_MIDDLE)
    data = model.createData()
    light = [
        Recording(
            log.t, log.q, log.v - [pin.computeGeneralizedGravity(model, data, q) / truth for q in log.q], log.name
        )
        for log in logs
    ]
    check_wiring(ur, *light, OPTIONS)
    found = identify(*light, ur.arm, BRICK, method="ls-2011").estimate
    for joint, gain in zip(found.joints, truth, strict=True):
        # Four of the deviations that are claimed: once in 3000 seeds for six joints.
        assert abs(joint.value - gain) < 4.0 * joint.total_std


def test_the_message_tells_the_joint_that_shows_it_most_and_what_is_left_of_its_current(ur, logs):
    bad = corrupted(logs, CHANGES["joint 3 negated"])
    with pytest.raises(Contradiction) as caught:
        check_wiring(ur, *bad, OPTIONS)
    told = re.search(r"joint (\d)'s current then: ([\d.]+) instead of ([\d.]+) %", str(caught.value))
    assert told is not None
    as_is = next(readings(ur.arm))[:1]
    after, before = (
        explanations(ur.arm, unknowns_of(ur), [instants(log, 400, OPTIONS) for log in pair], as_is)[0].left
        for pair in (logs, bad)
    )
    joint = int(np.argmax(before / after))
    assert int(told[1]) == joint + 1
    np.testing.assert_allclose(
        [float(told[2]), float(told[3])], [100 * after[joint], 100 * before[joint]], rtol=0.05
    )  # two digits


def test_identify_refuses_what_the_mass_alone_cannot_contradict(ur, logs):
    light = replace(BRICK, known="mass")
    identify(*logs, ur, light)
    with pytest.raises(Contradiction, match="q5 negated"):
        identify(*corrupted(logs, CHANGES["joint 5 negated"]), ur, light)


def test_arms_whose_wiring_is_known_are_not_questioned(ur, logs):
    known_wiring(ur, *corrupted(logs, CHANGES["joint 3 negated"]), OPTIONS)


def test_a_scenario_s_arm_is_not_questioned(monkeypatch):
    asked = []
    monkeypatch.setattr(scenarios.run, "identify_motions", lambda *_, wiring, **__: asked.append(wiring) or 1 / 0)
    with pytest.raises(ZeroDivisionError):
        scenarios.run.run_scenario("ideal")
    assert asked == [known_wiring]


@pytest.mark.parametrize("seed", [22, 23, 24])
def test_a_log_of_the_arm_itself_passes(ur, seed):
    noise = {22: 0.005, 23: 0.02, 24: 0.08}[seed]
    check_wiring(
        ur, *known_logs(ur_like(), BRICK, UR_GAIN, np.random.default_rng(seed), middle=UR_MIDDLE, noise=noise), OPTIONS
    )


def explanation(ur: Structure, left: list[float], freedom: int) -> Explanation:
    return Explanation(next(readings(ur.arm))[0], np.array(left), np.full(len(left), freedom))


def test_a_reading_must_be_better_by_the_margin_and_with_evidence(ur):
    given, freedom = explanation(ur, [0.3, 0.05], 4000), int(2.0 * EVIDENCE / BETTER)
    better = [0.3 * np.exp(-0.7 * BETTER), 0.05 * np.exp(-0.4 * BETTER)]  # by 1.1 margins in sum
    assert wiring._surely_better(given, explanation(ur, better, freedom))
    assert not wiring._surely_better(given, explanation(ur, [0.3 * np.exp(-0.9 * BETTER), 0.05], freedom))
    enough = EVIDENCE / (1.1 * BETTER)
    assert wiring._surely_better(given, explanation(ur, better, int(enough) + 1))
    assert not wiring._surely_better(given, explanation(ur, better, int(enough) - 1))
    worse = [0.3 * np.exp(-2.0 * BETTER), 0.05 * np.exp(1.5 * BETTER)]  # one joint gains less than the other loses
    assert not wiring._surely_better(given, explanation(ur, worse, freedom))


def test_another_length_needs_less_evidence(ur):
    given = explanation(ur, [0.3], 4000)
    longer = next(family[0] for family in readings(ur.arm) if "length" in family[0].words)
    for share, convincing in ((1.1, True), (0.9, False)):
        left = np.array([0.3 * np.exp(-3.0 * BETTER)])
        freedom = np.array([round(share * LENGTH_EVIDENCE / (3.0 * BETTER))])
        assert wiring._surely_better(given, Explanation(longer, left, freedom)) == convincing
        assert not wiring._surely_better(given, replace(given, left=left, freedom=freedom))


def test_what_filters_leave_of_exact_data_and_joints_without_instants_tell_nothing(ur):
    given, other = explanation(ur, [9e-4, np.inf, 0.2], 50), explanation(ur, [1e-9, 0.1, 0.1], 50)
    gain = gain_over(given.left, other.left)
    np.testing.assert_allclose(gain, [0.0, 0.0, np.log(2.0)], atol=1e-15)  # rounding


def test_three_of_equally_good_readings_are_named_and_the_others_counted(ur, logs):
    several = "q1 negated or q1 negated plus 90 degrees or q1 negated plus 180 degrees or 1 more ("  # a vertical axis
    with pytest.raises(Contradiction, match=re.escape(f"this one: {several}")):
        check_wiring(ur, *corrupted(logs, CHANGES["joint 1 negated"]), OPTIONS)


def test_a_slanting_base_shows_parameters_that_an_upright_one_hides(ur, logs):
    slanting = structure_of(arm_of(ur_like((6.94, 0.0, -6.94))))  # 9.81 between two axes
    other = next(f for f in readings(ur.arm) if f[0].words == "gravity along (1, 0, -1) of the base")
    found, own = (
        wiring._explained(each.arm, (unknowns_of(each), unknowns_under_any(each)), logs, OPTIONS, 120, [family])[0]
        for each, family in ((ur, other), (slanting, next(readings(slanting.arm))[:1]))
    )
    np.testing.assert_array_equal(found.freedom, own.freedom)
    np.testing.assert_allclose(found.left, own.left, rtol=1e-3)  # 6.94 for 9.81 / sqrt(2)


def test_weightless_arms_have_no_base_to_turn(ur, logs):
    afloat = replace(ur, arm=replace(ur.arm, gravity=np.zeros(3)))
    own, any_gravity = unknowns_of(afloat), unknowns_under_any(afloat)
    for one, other in zip(own.arm + own.payload, any_gravity.arm + any_gravity.payload, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("read", "words"),
    [
        (lambda log, order: Recording(log.t, log.q, log.v[:, order], log.name), "columns v2 and v3 exchanged"),
        (lambda log, order: Recording(log.t, log.q[:, order], log.v[:, order], log.name), "joints 2 and 3 exchanged"),
    ],
)
def test_logs_with_one_mistake_agree_about_the_arm_under_the_reading_that_undoes_it_alone(ur, logs, read, words):
    seen = [instants(read(log, [0, 2, 1, 3, 4, 5]), 400, OPTIONS) for log in logs]
    if "joints" in words:  # instants of a joint that hardly moves are not asked
        seen[1] = replace(seen[1], v=np.where(seen[1].moving, seen[1].v, -9.0 * seen[1].v))
    asked = {each.words: each for family in readings(ur.arm) for each in family}
    told = {
        name: agree(ur.arm, unknowns_of(ur), seen, asked[name]) for name in (words, "the log as it is", "q3 negated")
    }
    assert told == {words: True, "the log as it is": False, "q3 negated": False}


def test_one_log_alone_is_not_asked_for_a_mistake_that_all_logs_share(ur, logs, monkeypatch):
    monkeypatch.setattr(wiring, "one_log_explanations", lambda *_: 1 / 0)
    slanting = known_logs(ur_like((6.94, 0.0, -6.94)), BRICK, UR_GAIN, np.random.default_rng(8), middle=UR_MIDDLE)
    with pytest.raises(Contradiction, match=r"gravity along \(1, 0, -1\) of the base \("):
        check_wiring(ur, *slanting, OPTIONS)
    arm = arm_of(ur_like())
    shorter = structure_of(replace(arm, translation=0.8 * arm.translation))
    turned = corrupted(logs, CHANGES["joint 5 negated"])
    more = Recording(logs[0].t, turned[0].q * [1, 1, -1, 1, 1, 1], logs[0].v, "more")
    for structure, pair in ((shorter, logs), (ur, (more, turned[1]))):  # lengths alone, and two mistakes
        with pytest.raises(ZeroDivisionError):
            check_wiring(structure, *pair, OPTIONS)


@pytest.mark.real
@pytest.mark.parametrize("folder", ["ur10e", "ur10e_december"])
def test_real_pairs_of_this_arm_pass(real: Path, folder):
    structure = structure_of(load_arm(real / "ur10e" / "ur10e.urdf"))
    pair = [read_recording(real / folder / f"{name}.parquet") for name in ("unloaded", "loaded")]
    check_wiring(structure, *pair, OPTIONS)
    upside = [Recording(log.t, log.q * [1, -1, 1, 1, 1, 1], log.v, log.name) for log in pair]
    with pytest.raises(Contradiction, match="this one: q2 negated"):
        check_wiring(structure, *upside, OPTIONS)


@pytest.mark.real
def test_short_real_recordings_do_not_convince_of_another_arm(real: Path):
    structure = structure_of(load_arm(real / "tx40" / "tx40.urdf", couplings=((4, 5),)))
    log = read_recording(real / "tx40" / "recording.parquet")
    half = len(log.t) // 2
    check_wiring(
        structure, *(Recording(log.t[k], log.q[k], log.v[k]) for k in (slice(half), slice(half, None))), OPTIONS
    )
