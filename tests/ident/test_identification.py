"""Data that are not what they are said to be give no wrong gain: an arm of known gains, and its log corrupted."""

from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import joint_by_joint, logs_of, problem_of
from corruptions import CHANGES, corrupted
from exact import exact_pair
from ident.all_joints.unmodelled import SOFTEST, unmodelled
from ident.checks.between_logs import mounted_remarks
from ident.consistency import UNCHECKED
from ident.contradiction import SHARE, SURE_F, check_shape
from ident.payload_shape import shape_mismatch
from ident.wiring import known_wiring
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, arm_of, known_logs, ur_like
from real_friction import GAIN, Truth, real_logs

from ident.all_joints.terms import STRONGEST
from ident.errors import Contradiction, NotIdentifiable, OptionError
from ident.estimate import IdentifiedGain
from ident.estimators import ESTIMATORS, ls_2011
from ident.identification import Recorded, identify, identify_motions
from ident.joint_fit import joint_fit
from ident.observation import ObserveOptions, observe
from ident.options import GainOptions
from ident.payload import Payload
from ident.plausibility import repeatable
from ident.problem import pair
from ident.recording import Recording
from ident.signs import joint_signs

MODELS = {
    "base on its side": ur_like((9.81, 0.0, 0.0)),
    "base on the ceiling": ur_like((0.0, 0.0, 9.81)),
    "base at 45 degrees": ur_like((0.0, 6.94, -6.94)),
    "a shorter arm": ur_like(reach=0.8),
}


@pytest.fixture(scope="module")
def logs() -> tuple[Recording, Recording]:
    return known_logs(ur_like(), BRICK, UR_GAIN, np.random.default_rng(0), middle=UR_MIDDLE)


def test_a_motion_may_repeat_another_to_the_last_digit_only_where_it_is_simulated(ur, logs):
    bare, loaded = logs
    motions = [Recorded(bare), Recorded(loaded, BRICK), Recorded(replace(bare, name="again"))]
    given = {"method": "ls-2011", "wiring": known_wiring, "checks": UNCHECKED}
    with pytest.raises(NotIdentifiable, match="hold the same motion"):
        identify_motions(motions, ur, **given)
    estimate = identify_motions(motions, ur, sameness=repeatable, **given).estimate
    once = identify(bare, loaded, ur, BRICK, **given).estimate
    # Rows that count twice weigh more, of a log that its model explains to 1e-3.
    np.testing.assert_allclose(1.0 / estimate.solution.inverse, 1.0 / once.solution.inverse, rtol=1e-2)


def test_the_log_as_it_is_gives_every_gain(ur, logs):
    estimate = identify(*logs, ur, BRICK).estimate
    for joint, true in zip(estimate.joints, UR_GAIN, strict=True):
        assert isinstance(joint, IdentifiedGain)
        assert abs(joint.value - true) < 4.0 * joint.total_std  # six joints: by chance once in 2600 seeds


@pytest.mark.parametrize("change", CHANGES)
def test_positions_that_are_not_the_joint_s_own_give_no_gain(ur, logs, change):
    bad = corrupted(logs, CHANGES[change])
    with pytest.raises((Contradiction, NotIdentifiable)):
        identify(*bad, ur, BRICK, wiring=known_wiring)


@pytest.mark.parametrize("model", MODELS)
def test_the_model_of_another_arm_or_base_gives_no_gain(logs, model):
    with pytest.raises((Contradiction, NotIdentifiable)):
        identify(*logs, arm_of(MODELS[model]), BRICK, wiring=known_wiring)


def test_the_message_names_joints_and_suspects(ur, logs):
    bad = corrupted(logs, CHANGES["joint 2 negated"])
    with pytest.raises(Contradiction, match="joint 3: by the payload the gain has one sign, by friction the other; "):
        identify(*bad, ur, BRICK, wiring=known_wiring)
    bad = corrupted(logs, CHANGES["joint 4 negated"])
    with pytest.raises(
        Contradiction,
        match=r"2, 3: the payload's torque has another shape than described, surest on joint 3 \([0-9.]+ % of it\)",
    ) as caught:
        identify(*bad, ur, BRICK, wiring=known_wiring)
    assert "\n" not in str(caught.value)


def test_a_centre_of_mass_in_another_frame_is_a_contradiction(ur, logs):
    with pytest.raises(Contradiction, match="centre of mass"):
        identify(*logs, ur, replace(BRICK, com=(0.11, 0.07, -0.05)), wiring=known_wiring)


def test_one_drive_wired_backwards_or_all_of_them_is_none(ur, logs):
    for signs in (-np.ones(6), np.array([1.0, 1.0, -1.0, 1.0, 1.0, -1.0])):
        turned = (Recording(log.t, log.q, signs * log.v, log.name) for log in logs)
        estimate = identify(*turned, ur, BRICK, wiring=known_wiring).estimate
        np.testing.assert_allclose(
            [joint.value for joint in estimate.joints], signs * UR_GAIN, rtol=0.05
        )  # five per cent of a gain known to half a per cent


def test_swapped_files_are_still_named(ur, logs):
    with pytest.raises(NotIdentifiable, match="unloaded and loaded files are probably swapped"):
        identify(logs[1], logs[0], ur, BRICK, wiring=known_wiring)


def test_the_shape_of_a_payload_s_torque_is_told_by_an_f_test(ur, logs):
    observing = ObserveOptions()
    problem = pair(*(observe(log, ur, observing) for log in logs), BRICK, GainOptions())
    wrong = replace(BRICK, com=(0.07, -0.05, 0.17))
    for payload, contradicts in ((BRICK, False), (wrong, True)):
        fit = joint_fit(problem, 1, [payload.known_part()])
        mismatch = shape_mismatch(problem, fit)
        # A second way: solve with all the payload's columns free, and compare the sums of squares.
        system = fit.system
        free = np.linalg.svd(np.hstack((system.W, system.rows.W_L[0])), full_matrices=False)
        U = free[0][:, free[1] > 1e-9 * free[1][0]]
        left = np.sum((system.rows.V - U @ (U.T @ system.rows.V)) ** 2)
        added = U.shape[1] - system.W.shape[1]
        more = np.sum(fit.fit.residual**2) - left
        np.testing.assert_allclose(mismatch.F, more / added / (left / (len(system.rows.V) - U.shape[1])), rtol=1e-3)
        others = system.W[:, :-1]
        own = system.W[:, -1] - others @ np.linalg.lstsq(others, system.W[:, -1])[0]
        np.testing.assert_allclose(mismatch.share, np.sqrt(more) / np.linalg.norm(own / UR_GAIN[1]), rtol=0.05)
        assert (mismatch.F > SURE_F and mismatch.share > SHARE) == contradicts


def test_the_mass_alone_leaves_no_shape_to_test(ur, logs):
    light = replace(BRICK, known="mass")
    problem = pair(*(observe(log, ur, ObserveOptions()) for log in logs), light, GainOptions())
    assert shape_mismatch(problem, joint_fit(problem, 1, [light.known_part()])) is None


def test_friction_and_load_give_the_sign_with_their_own_deviations(ur, logs):
    result = identify(*logs, ur, BRICK)
    signs = joint_signs(result.estimate)
    np.testing.assert_array_equal(np.sign(signs.friction_z), np.sign(UR_GAIN))
    np.testing.assert_array_equal(np.sign(signs.load_z), np.sign(UR_GAIN))
    std = np.array([joint.std / abs(joint.value) for joint in result.estimate.joints])
    np.testing.assert_allclose(np.abs(signs.load_z), 1.0 / std, rtol=1e-9)
    assert np.abs(signs.friction_z).min() > 50.0


def test_a_joint_that_is_refused_anyway_contradicts_nobody(structure, payload):
    # A millimetre of the payload's centre is most of the torque on joint 6, and less than SHARE of it elsewhere.
    gain = np.array([0.94, -0.96, 1.11, 0.91, 1.3, 0.7])
    off = replace(payload, com=(0.0008, -0.0006, payload.com[2]))
    rng = np.random.default_rng(3)
    problem = pair(*exact_pair(structure, off, gain, rng, noise=1e-4), payload, GainOptions())
    estimate = ESTIMATORS["ls-2011"].estimate(problem, ESTIMATORS["ls-2011"].options())
    assert list(estimate.identifiable) == [True] * 5 + [False]
    check_shape(problem, estimate)
    fit = joint_fit(problem, 5, [payload.known_part()])
    mismatch = shape_mismatch(problem, fit)
    assert mismatch.share > 10 * SHARE
    assert mismatch.F > SURE_F
    far = replace(payload, com=(0.04, -0.03, payload.com[2]))
    problem = pair(*exact_pair(structure, far, gain, rng, noise=1e-4), payload, GainOptions())
    with pytest.raises(Contradiction, match="another shape than described"):
        check_shape(problem, ESTIMATORS["ls-2011"].estimate(problem, ESTIMATORS["ls-2011"].options()))


def test_a_method_that_is_the_check_s_own_is_run_once_and_says_the_same(ur, logs, monkeypatch):
    ran = list[GainOptions]()
    once = ls_2011.joint_by_joint_gains

    def counted(problem, options):
        ran.append(problem.options)
        return once(problem, options)

    monkeypatch.setattr("ident.estimators.ls_2011.joint_by_joint_gains", counted)
    # Any uncertainty but that of the check, so that its own deviations would show.
    asked = GainOptions(uncertainty="jackknife")
    found = identify(*logs, ur, BRICK, method="ls-2011", gains=asked, wiring=known_wiring).estimate
    assert len(ran) == 1
    observed = [observe(log, ur, ObserveOptions()) for log in logs]
    direct = once(pair(*observed, BRICK, asked), ls_2011.JointByJointOptions())
    assert found.joints == direct.joints
    assert found.options == asked
    with pytest.raises(OptionError, match="options are float"):
        identify(*logs, ur, BRICK, method="ls-2011", options=1.5, wiring=known_wiring)


@pytest.fixture(scope="module")
def braked() -> list[Recording]:
    """Friction that grows with load, by a seed with which joint 3 alone takes it for another shape of the payload."""
    return logs_of(Truth(load=(0.15, 0.12, 0.105)), seed=2)


def test_friction_that_grows_with_load_is_no_other_shape_of_the_payload(axes, braked):
    problem = problem_of(axes, braked)
    fit = joint_fit(problem, 2, [BRICK.known_part()])
    mismatch = shape_mismatch(problem, fit)
    assert mismatch.share > SHARE
    assert mismatch.F > SURE_F
    check_shape(problem, joint_by_joint(problem).estimate)


def test_a_centre_of_mass_that_is_off_is_one_beside_friction_that_grows_with_load(axes, braked):
    problem = problem_of(axes, braked, (None, replace(BRICK, com=(0.09, -0.05, 0.11))))
    with pytest.raises(Contradiction, match="3: the payload's torque has another shape than described"):
        check_shape(problem, joint_by_joint(problem).estimate)


def test_joints_that_yield_are_named_where_they_explain_part_of_it(axes):
    # 25 times the compliance that drives may have on joint 2, and nine times what it is let have.
    logs = real_logs(Truth(compliance=(0.0, 6e-4, 0.0)), (None, BRICK), np.random.default_rng(1), noise=5e-4)
    problem = problem_of(axes, logs)
    with pytest.raises(Contradiction, match=r"joints that yield: with load friction they explain [2-9][0-9] %"):
        check_shape(problem, joint_by_joint(problem).estimate)


@pytest.mark.parametrize(("size", "left"), [(0.5, 0.5), (2.0, 0.0), (-0.7, 1.0)])
def test_other_causes_count_up_to_the_most_they_may_add(axes, braked, size, left):
    problem = problem_of(axes, braked)
    fit = joint_fit(problem, 2, [BRICK.known_part()])
    alone = shape_mismatch(problem, fit)
    beside = size * fit.fit.residual[:, None]
    with_it = shape_mismatch(problem, fit, np.hstack((beside, np.zeros_like(beside))))
    # The share is linear in what is left of the residual; rounding is that of a difference of squares.
    np.testing.assert_allclose(with_it.share, left * alone.share, rtol=1e-9, atol=1e-7)
    if left:
        freedom = len(beside) - fit.system.W.shape[1] - 5 - 1
        np.testing.assert_allclose(with_it.F, alone.F * freedom / (freedom + 1), rtol=1e-3)  # a column is none too few


def test_unmodelled_currents_are_the_most_that_friction_and_compliance_may_add(axes):
    loads = (0.05, 0.04, 0.03)
    stiff = unmodelled(problem_of(axes, logs_of(Truth())))
    yields = 0.5 * stiff.compliance
    for truth, parts in (
        (Truth(load=loads), np.array(loads) / STRONGEST),
        (Truth(compliance=tuple(yields)), np.full(3, 0.5 / SOFTEST)),
    ):
        problem = problem_of(axes, real_logs(truth, (None, BRICK), np.random.default_rng(4), noise=1e-4))
        lacking = unmodelled(problem)
        for joint, part in enumerate(parts):
            fit = joint_fit(problem, joint, [BRICK.known_part()])
            most = lacking.currents(joint, 1.0 / GAIN[joint])
            column = most[:, 1] if truth.load[0] else most[:, 2:].sum(axis=1)
            W = np.column_stack((fit.system.W, column))
            found = np.linalg.lstsq(W / np.linalg.norm(W, axis=0), fit.system.rows.V)[0][-1] / np.linalg.norm(column)
            # First order in small terms, from torques of a fit that lacks them.
            np.testing.assert_allclose(found, part, rtol=0.15)


@pytest.fixture(scope="module")
def faint() -> tuple[Recording, Recording, Payload]:
    """Logs of a payload of known mass alone, that joints alone do not see in noise of 15 %."""
    full = replace(BRICK, mass=0.3, com=(0.0, 0.0, 0.01), inertia=(1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0), mass_std=0.001)
    bare, loaded = known_logs(ur_like(), full, UR_GAIN, np.random.default_rng(3), middle=UR_MIDDLE, noise=0.15)
    return bare, loaded, replace(full, known="mass")


def test_a_load_that_no_joint_alone_shows_is_no_reason_to_refuse_what_all_joints_show(ur, faint):
    bare, loaded, payload = faint
    with pytest.raises(NotIdentifiable, match="by ls-2011 the loaded motion shows no load on any joint"):
        identify(bare, loaded, ur, payload, method="ls-2011", wiring=known_wiring)
    estimate = identify(bare, loaded, ur, payload, wiring=known_wiring).estimate
    gains = {j: each for j, each in enumerate(estimate.joints) if isinstance(each, IdentifiedGain)}
    assert set(gains) == {1, 2}
    for j, gain in gains.items():
        assert abs(gain.value - UR_GAIN[j]) < 3.0 * gain.total_std  # two joints: by chance once in 180 seeds


@pytest.mark.parametrize("seed", [1, 3, 5])  # nls finds 1/g 9.7, 4.5 and 10.2 deviations from zero
def test_all_joints_find_no_gain_where_nothing_is_mounted_and_the_payload_is_asked_for(ur, seed):
    logs = [
        known_logs(ur_like(), BRICK, UR_GAIN, np.random.default_rng(each), middle=UR_MIDDLE)[0]
        for each in (seed, seed + 7)
    ]
    with pytest.raises(NotIdentifiable, match=r"was the payload mounted\?$"):
        identify(*logs, ur, BRICK, wiring=known_wiring, gains=GainOptions(max_rel_std=0.5))


def test_a_check_asks_for_the_load_what_an_identification_by_default_asks(ur, faint):
    *logs, payload = faint
    problem = pair(*(observe(log, ur, ObserveOptions()) for log in logs), payload, GainOptions())
    assert mounted_remarks(problem, logs) == []
    strict = replace(problem, options=GainOptions(max_rel_std=1e-3))
    (remark,) = mounted_remarks(strict, logs)
    assert remark.seen.startswith("no drive gain can be identified")
