"""Encodings of positions: units, gears, encoders, shares of a range, conventions; how they are read and advised."""

import re
from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import at, changed

from ident.diagnosis import column_faults, encoding_faults
from ident.diagnosis.plausibility import friction_z
from ident.estimation.estimate import largest
from ident.recordings.description import read_description
from ident.recordings.files import read_log, write_recording


def test_ratios_and_counts_that_all_joints_share_are_read_if_positions_are_beyond_the_limits(sound):
    limited = replace(sound.structure.arm, lower=np.full(3, -3.3), upper=np.full(3, 3.3))
    structure = replace(sound.structure, arm=limited)
    for factor in (17.0, -17.0, 2.0**14 / (2.0 * np.pi)):
        wrong = tuple(changed(each, q=each.q * factor) for each in sound.recordings)
        logs = replace(sound, recordings=wrong, problem=replace(sound.problem, structure=structure))
        own = [each for each in encoding_faults.units(logs) if each.value is not None and not each.joints]
        found = min(own, key=lambda each: abs(each.value - factor))
        np.testing.assert_allclose(found.hypothesis.logs[0].read(wrong[0]).q, sound.recordings[0].q, rtol=1e-12)
        assert ("16384 per turn" in found.words) == (factor > 500.0)
    assert not [each for each in encoding_faults.units(replace(logs, recordings=sound.recordings)) if each.value]


@pytest.mark.parametrize(("joint", "ratio"), [(2, -63.4), (0, 2037.3), pytest.param(1, 101.0, marks=pytest.mark.slow)])
def test_positions_on_the_motors_side_are_read_by_the_nearest_plausible_ratio(sound, joint, ratio):
    wrong = tuple(changed(each, q=each.q * at(joint, ratio, 1.0, 3)) for each in sound.recordings)
    of_a_ratio = (each for each in encoding_faults.units(replace(sound, recordings=wrong)) if each.value is not None)
    geared = min(of_a_ratio, key=lambda each: abs(each.value - ratio))
    assert abs(geared.value / ratio - 1.0) < 0.011  # ratios are 2 % apart
    exact = geared.refined(np.array([ratio / geared.value - 1.0]))
    np.testing.assert_allclose(exact.hypothesis.logs[0].read(wrong[0]).q, sound.recordings[0].q, atol=1e-9)


def test_degrees_are_read_as_radians_where_that_puts_every_joint_within_reach(sound):
    wrong = tuple(changed(each, q=np.rad2deg(each.q)) for each in sound.recordings)
    words = "all positions are in degrees"
    found = next(each for each in encoding_faults.units(replace(sound, recordings=wrong)) if each.words == words)
    np.testing.assert_allclose(found.hypothesis.logs[1].read(wrong[1]).q, sound.recordings[1].q, rtol=1e-12)
    assert not any(each.words == words for each in encoding_faults.units(sound))


@pytest.mark.parametrize(("lowest", "of_degrees"), [(-100, True), (-100, False), (0, True), (0, False)])
def test_per_cent_of_each_joints_range_are_read_and_its_advice_decodes_them(sound, lowest, of_degrees):
    lower, upper = np.array([-2.3, -2.0, -2.9]), np.array([2.6, 1.9, 2.1])
    right = [each.q for each in sound.recordings]
    percent = [lowest + (100.0 - lowest) * (q - lower) / (upper - lower) for q in right]
    wrong = tuple(
        changed(each, q=np.deg2rad(x) if of_degrees else x) for each, x in zip(sound.recordings, percent, strict=True)
    )
    structure = replace(sound.structure, arm=replace(sound.structure.arm, lower=lower, upper=upper))
    logs = replace(sound, recordings=wrong, problem=replace(sound.problem, structure=structure))
    words = f"all positions are per cent of each joint's range, {lowest} to 100" + ", taken for degrees" * of_degrees
    (found,) = [each for each in encoding_faults.normalised(logs) if each.words == words]
    for how, log, q in zip(found.hypothesis.logs, wrong, right, strict=True):
        np.testing.assert_allclose(how.read(log).q, q, rtol=1e-9, atol=1e-9)
    part = read_description(None, re.findall("'(.*?)'", found.advice)).q
    unit = np.array(part.factor) * (np.pi / 180.0 if of_degrees else 1.0)
    np.testing.assert_allclose(unit * (percent[1] + part.zero), right[1], atol=1e-5)  # 7 digits


def test_lines_that_are_advised_decode_the_log_as_the_hypothesis_does(sound, tmp_path):
    log, seen = changed(sound.recordings[1], v=sound.recordings[1].v * [3.7, -0.4, 1.9]), set[str]()
    write_recording(log, tmp_path / "log.parquet")
    degrees = encoding_faults.in_unit(sound, (1,), (0, 1, 2), np.pi / 180.0, "in degrees")
    geared = encoding_faults.geared(sound, (2,), np.array([-63.7]))
    each_own = encoding_faults.geared(sound, (0, 1, 2), np.array([9.0, -6.4, 111.0]))
    scaled = [column_faults.scaled(sound, (1,), joints, 4.2) for joints in ((), (1,))]
    families = (column_faults.zeros(sound), column_faults.couplings(sound), column_faults.clocks(sound))
    for each in (degrees, geared, each_own, *scaled, *(one for family in families for one in family if 1 in one.logs)):
        lines = re.findall(r"'([qvt]\.\w+ = [^']+)'", each.advice)
        if lines:
            seen |= {line.split(" ")[0] for line in lines}
            found = read_log(tmp_path / "log.parquet", read_description(None, lines), check=None).recording
            right = each.hypothesis.logs[1].read(log)
            for own in "tqv":
                np.testing.assert_allclose(getattr(found, own), getattr(right, own), rtol=1e-6, atol=1e-12)
            assert ("rx90 convert" in each.advice) == (len(each.logs) == 1)
    assert seen == {"q.factor", "v.factor", "t.factor", "q.coupling"}


def test_a_convention_is_advised_in_lines_that_decode_a_log_in_degrees(sound, tmp_path):
    right = sound.recordings[1]
    write_recording(changed(right, q=np.rad2deg(right.q)), tmp_path / "log.csv")
    brakes = [float(largest(friction_z(sound.problem, j))) for j in range(3)]
    found = list(encoding_faults.conventions(sound))
    for each in found:
        lines = re.findall(r"'([qv]\.\w+ = [^']+)'", each.advice)
        read = read_log(tmp_path / "log.csv", read_description(None, [*lines, 'q.unit = "deg"']), check=None).recording
        own = each.hypothesis.logs[1].read(right)
        np.testing.assert_allclose(read.q, own.q, rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(read.v, own.v, rtol=1e-12)
    signs = {each.joints: each for each in found if "degrees" not in each.advice}
    assert sorted(signs) == [(0, 1), (0, 1, 2), (0, 2), (1, 2)]
    assert len(found) == 4 + 2 * 9 * 4  # quarter turns of both of two neighbours, and their signs
    assert min(brakes[0], brakes[2]) > 10.0 > abs(brakes[1])  # standard deviations: v1 and v3 are negated too
    assert signs[0, 2].words == "the positions of joints 1 and 3 are -q1 and -q3, with v1 and v3 negated"
    assert [signs[own].parameters for own in ((0, 1), (1, 2), (0, 2))] == [3, 3, 4]


def test_gears_of_joints_that_stand_still_or_have_no_limits_are_not_looked_for(sound):
    arm = sound.structure.arm
    for upper, still, some in (
        ([3.0, 2.9, 3.1], 1.0, True),
        ([3.0, 2.9, 3.1], 1e-4, False),
        ([3.0, np.inf, 3.1], 1.0, False),
    ):
        limited = replace(arm, lower=np.full(3, -2.8), upper=np.array(upper))
        wrong = tuple(changed(each, q=each.q * [31.0, 40.0 * still, -17.0] + 0.3) for each in sound.recordings)
        problem = replace(sound.problem, structure=replace(sound.structure, arm=limited))
        assert any(encoding_faults.own_gears(replace(sound, recordings=wrong, problem=problem))) is some


def test_counts_may_be_half_of_a_turn_at_zero_and_a_clock_sixty_times_off(sound):
    limited = replace(sound.structure.arm, lower=np.full(3, -2.9), upper=np.full(3, 2.9))
    structure = replace(sound.structure, arm=limited)
    wrong = tuple(changed(each, q=each.q * 4096.0 / (2.0 * np.pi) + 2048.0) for each in sound.recordings)
    logs = replace(sound, recordings=wrong, problem=replace(sound.problem, structure=structure))
    (found,) = [each for each in encoding_faults.units(logs) if each.words.endswith("4096 per turn, 2048 at zero")]
    np.testing.assert_allclose(found.hypothesis.logs[1].read(wrong[1]).q, sound.recordings[1].q, rtol=0.0, atol=1e-12)
    assert found.advice.startswith("add --state 'q.factor = 0.001533981' --state 'q.zero = -2048'")
    again = found.refined(np.array([0.01, 0.01, 0.01]))
    np.testing.assert_allclose(again.hypothesis.logs[0].zero, -np.pi, rtol=1e-15)
    factors = [each.hypothesis.logs[0].clock for each in column_faults.clocks(sound) if each.logs == (0, 1)]
    assert sorted(factors) == [2.0**k for k in range(-6, 7) if k]


def test_ratios_of_a_fit_are_told_as_equal_and_whole_ones_within_their_deviations():
    def of(ratios, std):
        return list(encoding_faults._special(np.array(ratios), np.array(std) / np.abs(ratios)))[-1]

    turn = 2.0 * np.pi
    np.testing.assert_allclose(of([101.1, -80.4], [0.07, 0.1]), [101.0, -80.4])  # the other is four deviations off
    # equal; the nearest whole number of turns, 40, is a deviation off, but of all ratios half are as near to one
    np.testing.assert_allclose(of([6.352, 6.339, 6.361], [0.02, 0.03, 0.03]), [6.35106] * 3, rtol=1e-5)
    np.testing.assert_allclose(
        of([1.4843, 1.431, 0.9724], [0.05, 0.004, 0.011]), [9 / turn, 9 / turn, 0.9724], rtol=1e-9
    )
    np.testing.assert_allclose(of([31.45, 32.55], [0.1, 0.1]), [31.45, 32.55])  # eight deviations apart
    np.testing.assert_allclose(of([65898.0 / turn], [19.0]), [65898.0 / turn], rtol=1e-4)
    np.testing.assert_allclose(of([-65898.0 / turn], [22.0]), [-65536.0 / turn], rtol=1e-9)
