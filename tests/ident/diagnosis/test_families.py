"""Alternatives: how they are read, how their size is refined, and columns of small ones."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import at, changed, doubted, logs_of, problem_of
from real_friction import Truth

from ident.diagnosis import arm_faults, column_faults, encoding_faults, terms
from ident.diagnosis.evidence import each_added
from ident.diagnosis.families import FAMILIES
from ident.diagnosis.hypothesis import in_logs, scopes
from ident.diagnosis.models import reference
from ident.diagnosis.search import Exact, FirstOrder, directions
from ident.model.arm import with_transmission
from ident.model.displacement import across
from ident.model.structure import structure_of


def test_positions_of_joints_beside_currents_of_motors_are_converted_as_advised(sound):
    found = [each for each in arm_faults.transmissions(sound) if "v alone" in each.words]
    assert [each.joints for each in found] == [(0, 1)] * 4 + [(1, 2)] * 4
    q = np.arange(6.0).reshape(2, 3) ** 2 + 0.7
    for each in found:
        A, (own, *_) = each.hypothesis.transmission, each.hypothesis.logs
        np.testing.assert_allclose(own.mixed(q), q @ A.T, rtol=1e-12)
        assert f"transmission = {A.astype(int).tolist()} " in each.advice
        pair = re.search(r"coupling = \[\[(\d), (-?\d)\]\] in \[q\]", each.advice)
        motor, joint = int(pair[1]), int(pair[2])
        converted = q.copy()
        converted[:, motor - 1] += np.sign(joint) * q[:, abs(joint) - 1]  # as a log description does
        np.testing.assert_allclose(converted, q @ A.T, rtol=1e-12)


def test_a_differential_turns_by_half_of_a_sum_and_a_ratio_that_is_far_off_is_refined_by_factors(sound):
    halves = [each for each in arm_faults.transmissions(sound) if "half of" in each.words]
    blocks = [each.hypothesis.transmission[np.ix_(each.joints, each.joints)].tolist() for each in halves]
    assert blocks == [[[0.5, 0.5], [0.5, -0.5]], [[0.5, -0.5], [0.5, 0.5]]] * 2
    assert "motor 1 turns by half of joint 1 plus joint 2 and motor 2 turns by half of joint 1 minus" in halves[0].words
    far = arm_faults.shared(sound, 1, 1, 1.3)
    assert far.words == "motor 2 turns by 2.3 times the stated angle"
    np.testing.assert_allclose(far.refined(np.array([0.1])).hypothesis.transmission[1, 1], 2.3 * 1.1, rtol=1e-12)


def test_the_advice_on_a_coupling_of_positions_undoes_it(sound):
    log, found = sound.recordings[1], list(column_faults.couplings(sound))
    assert len(found) == 8  # either neighbour of three joints, plus or minus
    for each in found:
        ((j, i),) = json.loads(re.search(r"coupling = (\[\[.*?\]\])", each.advice)[1])
        q = log.q.copy()
        q[:, j - 1] += np.sign(i) * log.q[:, abs(i) - 1]
        np.testing.assert_allclose(each.hypothesis.logs[1].read(log).q, q, rtol=1e-12)
        assert f"q{j} is the position of joint {j} {'minus' if i > 0 else 'plus'} that of joint {abs(i)}" == each.words


def test_scales_of_a_logs_currents_are_looked_for_over_eight_decades_and_only_powers_of_ten_are_natural(axes):
    bare, loaded = logs_of(Truth())

    def scaled(factor: np.ndarray | float):
        logs = doubted(axes, [bare, changed(loaded, v=loaded.v * factor)])
        return [each for each in column_faults.scales(logs) if each.value != -1.0]

    found = {(scale, ()): scaled(scale) for scale in (-4e3, 1e3, 37.0, -0.02)}
    found[37.0, (1,)] = scaled(at(1, 37.0, 1.0, 3))
    for (scale, joints), alternatives in found.items():
        own = [each.value / scale for each in alternatives if each.joints == joints and each.value * scale > 0.0]
        assert np.abs(np.log(own)).min() < 0.2  # neighbours
    every = [each for alternatives in found.values() for each in alternatives]
    natural = [f"{abs(each.value):.6e}".startswith("1.000000") for each in every]
    assert {*natural} == {True, False}
    assert [each.searched for each in every] == [not each for each in natural]
    assert encoding_faults.geared(doubted(axes, [bare, loaded]), (1,), np.array([-63.0])).searched


def test_a_searched_scale_is_likeliest_beside_refits_of_every_scale(axes):
    bare, loaded = logs_of(Truth())
    logs = doubted(axes, [bare, changed(loaded, v=loaded.v * at(1, 5.0, 1.0, 3))])
    found = column_faults.scale_losses(logs, 1, 1)
    held = logs.fits.parts[1]
    own = logs.rows[1].motion == 1
    at_some = np.arange(0, len(column_faults.SCALES), 13)
    expected = []
    for s in column_faults.SCALES[at_some]:
        left = held.without(np.where(own, held.V / s, held.V))
        share, squares = own.mean(), [np.sum(left[~own] ** 2), s**2 * np.sum(left[own] ** 2)]
        expected.append(0.5 * held.freedom * (np.log(squares) @ [1.0 - share, share]))
    np.testing.assert_allclose(found[at_some], expected, rtol=1e-8)


def test_one_log_has_no_other_scale_and_no_log_of_its_own():
    assert (scopes(1), scopes(3)) == ([(0,)], [(0, 1, 2), (0,), (1,), (2,)])
    assert in_logs("x", (0, 1), ("a", "b")) == "x"
    assert in_logs("x", (0, 2), ("a", "b", "c")) == "x in a and c alone"
    assert in_logs("x", (1,), ("far/a", "far/b")) == "x in b alone"
    assert in_logs("x", (1,), ("far/a", "near/a")) == "x in near/a alone"


@pytest.mark.parametrize(
    ("scale", "advice"), [(0.93, "equally warm drives"), (1012.0, "'v.factor = 0.001'; 0.0009881")]
)
def test_a_small_scale_of_a_log_may_be_temperature_and_a_large_one_a_unit(sound, scale, advice):
    assert advice in column_faults.scaled(sound, (1,), (), scale).advice


@pytest.fixture(scope="module")
def found(sound):
    return directions(reference(sound.problem), sound, FAMILIES)


def test_every_direction_of_a_fault_is_read_back_with_its_own_size(sound, found):
    faults = [each for each in found if not each.term]
    assert {each.family for each in faults} == {"zero", "ratio", "base", "lengths", "clock", "delay", "current scale"}
    for each in faults:
        m = next(c for c in each.columns if c is not None).shape[1]
        other = each.at(np.full(m, 0.013))
        assert (other.key, other.joints, other.logs) == (each.key, each.joints, each.logs)
        assert other.refined(np.full(m, 0.0)).words == other.words
        if each.family == "delay" and m > 1:  # each joint by a time of its own
            np.testing.assert_allclose(other.hypothesis.logs[each.logs[0]].delay, 0.013, rtol=1e-12)
            continue
        change = np.expm1(0.013) if each.family in ("lengths", "clock") else 0.013  # factors, which are positive
        size = change * np.sqrt(m) * each.scale + (each.family == "current scale")
        own_sign = each.family in ("clock", "delay", "current scale", "ratio")  # angles are told as what undoes them
        np.testing.assert_allclose(other.value if own_sign else abs(other.value), size, rtol=1e-9)


PUT_IN = [
    ("zero", (1,), (0, 1), [0.08]), ("zero", (1,), (1,), [-0.06]), ("delay", (), (0, 1), [0.006]),
    ("delay", (1,), (1,), [-0.014]), ("clock", (), (0, 1), [0.03]), ("lengths", (2,), (0, 1), [0.12]),
    ("base", (), (0, 1), [0.03, -0.05]), ("ratio", (1,), (0, 1), [0.05]), ("ratio", (2, 1), (0, 1), [-0.07]),
    ("ratio", (0, 1), (0, 1), [0.09]),
]  # fmt: skip


@pytest.mark.parametrize(("family", "joints", "scope", "size"), PUT_IN)
def test_a_small_fault_is_estimated_with_its_size_and_sign(axes, sound, found, family, joints, scope, size):
    """Logs, or the model, are changed by the opposite alternative, which this one undoes to first order."""
    own = next(each for each in found if (each.family, each.joints, each.logs) == (family, joints, scope))
    opposite = own.at(-np.array(size)).hypothesis
    arm = opposite.of_arm(axes.arm)
    structure = axes if arm is axes.arm else structure_of(arm)
    wrong = doubted(structure, [how.read(log) for how, log in zip(opposite.logs, sound.recordings, strict=True)])
    again = directions(reference(wrong.problem), wrong, FAMILIES)
    own = next(each for each in again if (each.family, each.joints, each.logs) == (family, joints, scope))
    (more,) = each_added(wrong.fits, [own.columns])
    std = np.sqrt(np.diag(more.covariance))
    assert (std < 0.33 * np.abs(size)).all()
    # Three deviations, once in 400 a component; a fifth for the second order and what other unknowns of the arm fit.
    assert (np.abs(more.value - size) < 3.0 * std + 0.2 * np.abs(size)).all(), more.value


TERMS = {"joint elasticity", "position-dependent torque", "friction law", "friction drift", "current drift"}
TERMS |= {"offset", "offset drift"}


def test_directions_are_of_those_joints_and_logs_in_which_they_differ_from_others(sound, found):
    assert all(each.parameters == next(c.shape[1] for c in each.columns if c is not None) for each in found)
    assert {each.family for each in found if each.term} == TERMS  # terms of the model are no alternative readings
    wrong = {each.family for each in found if each.term and each.at_fault}
    assert wrong == {"offset", "offset drift"}  # of a current sensor, not of a model of the arm
    assert {each.logs for each in found if each.family == "offset"} == {(1,)}  # of the first log it is that of others
    assert {each.logs for each in found if each.family == "offset drift"} == {(0,), (1,)}
    apart = [each for each in found if each.family == "delay" and len(each.joints) > 1]  # times of their own
    assert [(each.joints, each.logs) for each in apart] == [((0, 1, 2), (0,)), ((0, 1, 2), (1,))]
    for each in apart:
        assert not any(column[:, np.arange(3) != j].any() for j, column in enumerate(each.columns))
    assert sound.structure.arm.translation.any(axis=1).all()  # also what stands before the first joint
    assert [each.joints for each in found if each.family == "lengths"] == [(), (1,), (2,)]
    (second, *_) = (each for each in arm_faults.lengths(sound) if each.joints == (2,))
    assert second.words == "the length from joint 2 to 3 is 0.8 times that of the model"
    np.testing.assert_array_equal(second.hypothesis.length_factors, [1.0, 1.0, 0.8])


def test_steps_of_a_size_add_up(sound):
    turned = column_faults.turned(sound, 1, (0, 1), 1.0, 0.3).refined(np.array([0.11]))
    np.testing.assert_allclose(turned.hypothesis.logs[0].zero, [0.0, 0.41, 0.0], rtol=1e-12)
    assert turned.advice.startswith("use q2 plus 23.5 degrees,")
    assert column_faults.turned(sound, 2, (1,), -1.0, -0.3).advice.startswith("use -q3 minus 17.2 degrees,")
    later = column_faults.late(sound, (1,), (), np.array([0.004])).refined(np.array([0.003]))
    np.testing.assert_allclose(later.hypothesis.logs[1].delay, 0.007, rtol=1e-12)
    assert "7 ms later" in later.words
    assert "23 Hz" in later.words  # 1 / (2 pi 7 ms)
    apart = column_faults.late(sound, (0,), (0, 1, 2), np.array([0.002, -0.003, 0.0]))
    apart = apart.refined(np.array([0.0, -0.0021, 0.004]))
    np.testing.assert_allclose(apart.hypothesis.logs[0].delay, [0.002, -0.0051, 0.004], rtol=1e-12)
    assert "2.0 (v1), -5.1 (v2), 4.0 (v3) ms" in apart.words
    assert (apart.value, apart.parameters, later.parameters) == (None, 3, 1)
    timed = column_faults.timed(sound, (0,), 1.2).refined(np.array([0.05]))
    np.testing.assert_allclose(timed.hypothesis.logs[0].clock, 1.2 * np.exp(0.05), rtol=1e-12)
    ratio = arm_faults.shared(sound, 2, 1, 0.3).refined(np.array([0.11]))
    np.testing.assert_allclose(ratio.hypothesis.transmission, [[1, 0, 0], [0, 1, 0], [0, 0.41, 1]], rtol=1e-12)
    scaled = column_faults.scaled(sound, (1,), (2,), -2.0).refined(np.array([0.1]))
    np.testing.assert_allclose(scaled.hypothesis.logs[1].v_factor, [1.0, 1.0, -0.5 * np.exp(-0.1)], rtol=1e-12)
    longer = arm_faults.lengthened(sound, 2, 1.1).refined(np.array([-2.1]))  # never negative
    np.testing.assert_allclose(longer.hypothesis.length_factors, [1.0, 1.0, 1.1 * np.exp(-2.1)], rtol=1e-12)


def test_a_ratio_is_of_the_motors_that_are_stated(sound, found):
    stated = np.array([[-1.3, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.7, 0.4]])
    arm = with_transmission(sound.structure.arm, stated)
    turned = replace(sound, problem=replace(sound.problem, structure=replace(sound.structure, arm=arm)))
    shares = arm_faults.shared(turned, 2, 1, 0.3).hypothesis.transmission  # motor 3 by 0.3 of what motor 2 turns
    np.testing.assert_allclose(shares, [*stated[:2], [0.0, 1.3, 0.4]], rtol=1e-12)
    own = next(each for each in found if each.key == ("ratio", (2, 1), (0, 1)))
    reach = max(np.abs(log.q[:, 1]).max() for log in sound.recordings)
    assert own.largest * reach == pytest.approx(arm_faults.LARGEST_ANGLE)
    coupled = replace(sound.structure, arm=replace(sound.structure.arm, couplings=((1, 2),)))
    coupled = replace(sound, problem=replace(sound.problem, structure=coupled))
    assert not [*arm_faults.small_ratios(reference(sound.problem), coupled)]


def test_a_tilted_base_is_turned_gravity_of_the_same_size(sound, found):
    tilt = next(each for each in found if each.family == "base")
    value = np.array([0.05, -0.12])
    other = tilt.at(value)
    before, after = sound.structure.arm.gravity, other.hypothesis.gravity
    np.testing.assert_allclose(np.linalg.norm(after), np.linalg.norm(before), rtol=1e-12)
    angle = np.arccos(before @ after / (before @ before))
    np.testing.assert_allclose([angle, np.deg2rad(other.value)], np.linalg.norm(value), rtol=1e-9)
    small = 1e-6 * value
    derivative = sum(x * np.cross(axis, before) for x, axis in zip(small, across(sound.structure.arm), strict=True))
    np.testing.assert_allclose(tilt.at(small).hypothesis.gravity - before, derivative, atol=1e-10)  # second order
    assert len(list(arm_faults.bases(sound))) == 25  # of 26 directions, one is the model's


def test_a_small_alternative_is_near_its_own_size_and_not_near_a_quarter_turn_or_a_sign(sound, found):
    zero = next(each for each in found if each.key == ("zero", (1,), (0, 1)))
    small = FirstOrder(zero, np.ones(40), np.array([0.06]), np.eye(1))
    assert small.near(column_faults.turned(sound, 1, (0, 1), 1.0, 0.09))
    quarter, negated = (1, (0, 1), 1.0, 0.06 + np.pi / 2), (1, (0, 1), -1.0, 0.06)
    for each in (quarter, negated, (2, (0, 1), 1.0, 0.06), (1, (1,), 1.0, 0.06)):  # the last of another joint, one log
        assert not small.near(column_faults.turned(sound, *each))
    scale = next(each for each in found if each.key == ("current scale", (1,), (1,)))
    small = FirstOrder(scale, np.ones(40), np.array([0.2]), np.eye(1))
    assert small.near(column_faults.scaled(sound, (1,), (1,), 1.3))
    assert not small.near(column_faults.scaled(sound, (1,), (1,), 1000.0))
    for share in (0.97, -0.97, 1.03, -1.03):  # the first order is believed up to the largest size either way
        own = replace(small, value=np.array([share * column_faults.LARGEST_SCALE]))
        assert own.within is (abs(share) < 1.0)


def test_the_deviation_of_an_angle_is_that_which_does_not_go_around(sound):
    def std(alternative, spread: list[float] | None) -> float | None:
        spread = None if spread is None else np.array(spread)
        return Exact(alternative, np.ones(40), sound, sound.fits.score, spread).std

    for zero in (np.pi - 0.001, -np.pi + 0.001, 0.3):
        turned = column_faults.turned(sound, 1, (0, 1), 1.0, zero)
        np.testing.assert_allclose(std(turned, [0.01]), np.rad2deg(0.01), rtol=1e-9)
        assert std(turned, None) is None
    apart = column_faults.late(sound, (0,), (0, 1, 2), np.array([0.002, -0.003, 0.0]))
    assert std(apart, [1e-3, 2e-3, 3e-3]) is None  # of three sizes there is no one


@pytest.mark.parametrize("joints", [(), (1,)])
@pytest.mark.parametrize(
    ("family", "begin"), [("current scale", 1.0), ("current drift", -0.5), ("offset", 1.0), ("offset drift", -0.5)]
)
def test_scales_offsets_and_drifts_are_what_they_change_of_the_filtered_currents(
    axes, sound, found, family, begin, joints
):
    own = next(each for each in found if (each.family, each.joints, each.logs) == (family, joints, (1,)))
    assert family != "current drift" or (own.unit, own.scale) == ("%", 100.0)
    log, sizes, of_offset = sound.recordings[1], np.array([0.7, -1.3, 2.1]), "offset" in family
    # a drift is none in the middle of its log and half of the size at the ends
    moved = np.linspace(begin, abs(begin), len(log.t))[:, None] * (sizes if of_offset else log.v)
    other = problem_of(axes, [sound.recordings[0], changed(log, v=log.v + moved)])
    for j, (column, before) in enumerate(zip(own.columns, sound.rows, strict=True)):
        if joints and j not in joints:
            assert column is None
            continue
        value = (sizes[[j]] if joints else sizes) if of_offset else np.ones(1)
        rows = np.concatenate([each.observation.joints[j].V for each in other.motions]) - before.V
        # A row stands for its position in the log; the filter's width is a small part of that, noise that a fit leaves.
        size = 0.02 * np.abs(sizes[j]) if of_offset else 0.1 * np.std(before.V)
        np.testing.assert_allclose(column @ value, rows, atol=size)


def test_states_of_rows_are_those_in_the_middle_of_their_filters(sound):
    for j, rows in enumerate(sound.rows):
        q, dq = terms.states(sound, rows)
        for log, motion in enumerate(sound.problem.motions):
            behind = motion.observation.full_rate
            D, own = behind.decimator, rows.motion == log
            for found, x in ((q, behind.q), (dq, behind.dq)):
                mean = [D.kernel @ x[i : i + len(D.kernel), j] for i in D.factor * rows.position[own]]
                # Of a few hertz little is lost in the mean; one end of the filter is a fifth of a second off.
                np.testing.assert_allclose(found[own], mean, atol=0.1 * np.std(mean))
