"""A log by itself: clock, samples, noise, clipping, columns, motion, delay."""

import re
from dataclasses import replace

import numpy as np
import pytest
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, arm_of, fourier, known_logs, ur_like

from ident.checks.clipping import clipped, clipping_remarks
from ident.checks.clock import clock_remarks
from ident.checks.columns import column_remarks
from ident.checks.lateness import BENT, Lateness, delay_remark, lateness
from ident.checks.motion import joint_motions, motion_remarks
from ident.checks.noise import acceleration_noise, noise_remarks, noise_std, quantum
from ident.checks.remark import Grade, Remark, worst
from ident.checks.samples import odd_steps, sample_remarks
from ident.observation import ObserveOptions, observe
from ident.recording import Recording
from ident.recording_checks import log_faults
from ident.signals import smooth_motion
from ident.structure import Structure, structure_of

OPTIONS = ObserveOptions()


@pytest.fixture(scope="module")
def ur() -> Structure:
    return structure_of(arm_of(ur_like()))


@pytest.fixture(scope="module")
def log() -> Recording:
    rng = np.random.default_rng(41)
    clean = known_logs(ur_like(), BRICK, UR_GAIN, rng, middle=UR_MIDDLE)[0]
    return Recording(clean.t, clean.q + rng.normal(0.0, 3e-6, clean.q.shape), clean.v, "a/log.csv")


def told(remarks: list[Remark], topic: str) -> Remark:
    (found,) = [each for each in remarks if each.topic == topic]
    return found


def without(log: Recording, rows, *, even: bool = False) -> Recording:
    kept = np.setdiff1d(np.arange(len(log.t)), rows)
    return Recording(log.t[: len(kept)] if even else log.t[kept], log.q[kept], log.v[kept], log.name)


def test_a_clean_log_has_nothing_but_good_lines(ur, log):
    lines = clock_remarks(log) + sample_remarks(log) + clipping_remarks(log) + column_remarks(log, OPTIONS)
    lines += noise_remarks(log, OPTIONS) + motion_remarks(log, joint_motions(log, ur.arm, OPTIONS))
    lines.append(delay_remark(log, observe(log, ur, OPTIONS), OPTIONS))
    assert {each.grade for each in lines} == {Grade.GOOD}
    assert {each.log for each in lines} == {"a/log.csv"}
    assert all(each.advice is None for each in lines)


def test_the_worst_of_several_grades_counts():
    lines = [Remark(topic="x", seen="y", grade=grade) for grade in (Grade.WEAK, Grade.WRONG, Grade.GOOD)]
    assert worst(lines) is Grade.WRONG
    assert worst(lines[::2]) is Grade.WEAK
    assert worst([]) is Grade.GOOD


def test_missing_samples_are_counted_where_the_clock_shows_them(log):
    found = told(clock_remarks(without(log, [300, 301, 302, 700])), "missing samples")
    assert found.seen == "4 in 2 gaps, the longest 0.032 s at t = 2.392 s"  # 125 Hz: row 299 and three more
    assert found.grade is Grade.WEAK


def test_a_hole_is_wrong_and_so_are_many_small_gaps(log):
    # ten intervals of 8 ms and a bit, beyond which nothing is interpolated
    assert told(clock_remarks(without(log, np.arange(500, 509))), "missing samples").grade is Grade.WEAK
    hole = told(clock_remarks(without(log, np.arange(500, 510))), "missing samples")
    assert (hole.grade, hole.advice) == (Grade.WRONG, "use one side of the hole")
    few, many = np.arange(40, 2400, 59), np.arange(40, 2400, 45)  # 40 and 53 of 2500 samples, 2 % are 50
    assert told(clock_remarks(without(log, few)), "missing samples").grade is Grade.WEAK
    found = told(clock_remarks(without(log, many)), "missing samples")
    assert found.grade is Grade.WRONG
    assert str(found.advice).startswith("record again")


def test_rate_and_jitter_are_those_of_the_intervals_that_miss_nothing(log):
    t = log.t + np.where(np.arange(len(log.t)) % 7 == 3, 0.0016, 0.0)  # a fifth of 8 ms
    lines = clock_remarks(without(Recording(t, log.q, log.v), [500, 501]))
    assert told(lines, "rate").seen == "125 Hz, 2498 samples, 19.99 s"
    assert told(lines, "jitter").seen == "intervals vary by up to 20 %"
    assert told(lines, "jitter").grade is Grade.GOOD
    late = log.t + np.where(np.arange(len(log.t)) % 7 == 3, 0.0048, 0.0)
    found = told(clock_remarks(Recording(np.sort(late), log.q, log.v)), "jitter")
    assert found.grade is Grade.WEAK  # 60 %


def test_the_rate_of_a_clock_of_two_intervals_is_that_of_their_mean(log):
    t = np.cumsum(np.where(np.arange(len(log.t)) % 3 == 2, 0.012, 0.010))  # two of 10 ms, one of 12: 93.75 Hz
    found = told(clock_remarks(without(Recording(t, log.q, log.v), [700])), "rate")
    assert float(found.seen.split()[0]) == pytest.approx(93.75, rel=1e-3)  # a gap of one interval less


def test_one_gap_is_one(log):
    found = told(clock_remarks(without(log, [300, 301])), "missing samples").seen
    assert found.startswith("2 in 1 gap, the longest 0.024 s")  # three intervals of 8 ms


def test_a_slow_log_is_weak(log):
    for step, grade in ((2, Grade.GOOD), (3, Grade.WEAK)):  # 62.5 and 41.7 Hz
        slow = Recording(log.t[::step], log.q[::step], log.v[::step])
        assert told(clock_remarks(slow), "rate").grade is grade


def test_samples_lost_behind_an_even_clock_are_found_where_they_are(log):
    lost = [411, 902, 903, 1700]
    odd = odd_steps(without(log, lost, even=True))
    np.testing.assert_array_equal(odd.long, [410, 900, 1696])  # the row before, in the log that remains
    assert len(odd.still) == 0
    found = told(sample_remarks(without(log, lost, even=True)), "lost samples")
    assert found.grade is Grade.WEAK
    assert "3 times, first after row 411, t = 3.28 s" in found.seen


def test_samples_that_the_clock_shows_to_be_missing_are_not_lost_behind_it(log):
    assert len(odd_steps(without(log, [411, 902, 903, 1700])).long) == 0


def test_a_long_loss_hides_no_short_one_beside_it(log):
    lost = [*range(500, 520), 523]  # a step of 21, two rows on one of 2
    np.testing.assert_array_equal(odd_steps(without(log, lost, even=True)).long, [499, 502])


def test_a_log_that_loses_more_than_one_step_in_five_hundred_is_wrong(log):
    for count, grade in ((4, Grade.WEAK), (7, Grade.WRONG)):
        lost = np.linspace(200, 2300, count).astype(int)
        assert told(sample_remarks(without(log, lost, even=True)), "lost samples").grade is grade


def test_repeated_rows_of_a_moving_arm_are_found(log):
    rows = np.arange(len(log.t))
    rows[[600, 601, 1500]] = [599, 599, 1499]
    again = Recording(log.t, log.q[rows], log.v[rows], log.name)
    np.testing.assert_array_equal(odd_steps(again).still, [599, 600, 1499])
    found = told(sample_remarks(again), "repeated samples")
    assert "repeated 3 times, first after row 600" in found.seen


def test_an_arm_at_rest_repeats_nothing(log):
    started = np.clip((log.t - 3.0) / 2.0, 0.0, 1.0) ** 3
    still = log.q[400] + started[:, None] * (log.q - log.q[400])
    assert (still[:300] == still[0]).all()
    assert len(odd_steps(Recording(log.t, still, log.v)).still) == 0


def test_one_coarse_encoder_is_no_lost_sample(log):
    q = log.q.copy()
    q[:, 3] = np.round(q[:, 3] / 0.004) * 0.004  # about one step a sample
    assert len(odd_steps(Recording(log.t, q, log.v)).long) == 0


def test_an_arm_whose_encoders_all_are_coarse_loses_and_repeats_nothing(log):
    odd = odd_steps(Recording(log.t, np.round(log.q / 0.02) * 0.02, log.v))  # a step in several samples
    assert len(odd.long) == len(odd.still) == 0


def test_one_joint_that_jumps_alone_is_no_lost_sample(log):
    q = log.q.copy()
    q[801:, 3] += 9.0 * (q[801, 3] - q[800, 3])
    assert 800 not in odd_steps(Recording(log.t, q, log.v)).long


def test_currents_that_are_logged_more_slowly_are_told(log):
    held = Recording(log.t, log.q, np.repeat(log.v[::2], 2, axis=0))
    assert told(sample_remarks(held), "held currents").grade is Grade.WEAK
    one = np.where(np.arange(6) == 3, held.v, log.v)
    for other in (log.v, one):  # a current that holds alone is coarse, or logged on its own
        assert not [each for each in sample_remarks(replace(log, v=other)) if each.topic == "held currents"]


def test_noise_is_that_which_was_added_whatever_moves_beneath(rng):
    t = np.arange(0.0, 20.0, 0.008)
    q = fourier(rng, np.array([0.3, -1.1]))(t)[0]
    sigma = np.array([3e-3, 7e-3])
    found = noise_std(q + sigma * rng.normal(size=q.shape))
    # a median of 2500 correlated sizes: some 3 % of itself
    np.testing.assert_allclose(found, sigma, rtol=0.12)
    assert (noise_std(np.zeros((4, 2))) == 0.0).all()


def test_the_quantum_is_the_step_of_an_encoder_and_none_where_noise_is_finer(rng):
    angle = np.cumsum(rng.normal(0.0, 0.01, 3000))
    np.testing.assert_allclose(quantum(np.round(angle / 0.0037) * 0.0037), 0.0037, rtol=1e-9)  # rounding
    np.testing.assert_allclose(quantum(np.round(angle, 3)), 0.001, rtol=1e-9)
    assert quantum(angle) is None
    assert quantum(rng.choice([0.0, 1.0, 1.37, 2.9], 1000)) is None  # few values, but of no step
    assert quantum(np.array([0.0, 1.0, 0.0])) is None


def test_a_step_that_a_file_rounds_in_two_ways_is_one(rng):
    counts = np.cumsum(rng.integers(-3, 4, 3000))
    either = rng.random(3000) < 0.5
    angle = np.where(either, counts * 0.001, counts / 1000.0)
    assert len(np.unique(angle)) > len(np.unique(counts))  # some differ by the last digit
    np.testing.assert_allclose(quantum(angle), 0.001, rtol=1e-9)  # rounding


def test_values_are_few_by_the_steps_between_them_not_by_their_last_digits():
    counts = np.arange(3, 40)  # 37 values, 36 steps
    angle = np.concatenate([counts * 0.001, counts / 1000.0])
    np.testing.assert_allclose(quantum(angle[1:]), 0.001, rtol=1e-9)  # 73 samples, two of all values but one
    assert quantum(angle[2:]) is None
    assert quantum(angle[[0, 1, 37, 38]]) is None  # two values


def test_noise_of_an_acceleration_is_that_of_the_filtered_noise(log):
    noise = np.random.default_rng(3).normal(0.0, 3e-4, log.q.shape)
    loud = Recording(log.t, log.q + noise, log.v)
    inner = slice(20, -20)
    ddq, alone = (smooth_motion(x, log.period, OPTIONS.cutoff_hz)[2][inner] for x in (loud.q, noise))
    share = np.sqrt(np.mean(alone**2, axis=0) / np.mean(ddq**2, axis=0))
    np.testing.assert_allclose(acceleration_noise(loud, OPTIONS), share, rtol=0.15)  # 20 s at 15 Hz: 600 values
    assert told(noise_remarks(log, OPTIONS), "noise of q").grade is Grade.GOOD


def test_the_coarsest_encoder_is_named(log):
    step = np.array([0.0, 0.0037, 0.0, 0.0, 0.0011, 0.0])
    q = np.where(step > 0.0, np.round(log.q / np.where(step > 0.0, step, 1.0)) * step, log.q)
    found = told(noise_remarks(Recording(log.t, q, log.v), OPTIONS), "encoder resolution")
    assert found.seen == "steps of 0.0037 (q2)"
    assert told(noise_remarks(log, OPTIONS), "encoder resolution").seen == "finer than noise"


def test_noise_that_counts_is_weak_and_names_the_joint(log):
    q = log.q + np.array([0, 0, 0, 0, 2e-3, 0]) * np.random.default_rng(4).normal(size=log.q.shape)
    found = told(noise_remarks(Recording(log.t, q, log.v), OPTIONS), "noise of q")
    assert (found.grade, found.joint) == (Grade.WEAK, 4)
    assert " rad or m on q5, " in found.seen
    v = log.v + np.array([0, 0.6, 0, 0, 0, 0]) * log.v.std(axis=0) * np.random.default_rng(5).normal(size=log.v.shape)
    for standing in (0.0, 50.0):  # a current that holds a weight is not the less noisy
        found = told(noise_remarks(Recording(log.t, log.q, v + standing), OPTIONS), "noise of v")
        assert (found.grade, found.joint) == (Grade.WEAK, 1)
        assert re.fullmatch(r"5[01] % of the deviation of the current of joint 2", found.seen)  # 0.6 / hypot(1, 0.6)


def test_samples_in_a_row_at_an_extreme_value_are_clipped():
    v = np.array([1.0, 5.0, 5.0, 5.0, 5.0, 2.0, 5.0, 5.0, 5.0, 3.0])
    assert clipped(v, 5.0) == 4  # three in a row are a peak
    assert clipped(v, 1.0) == 0


def test_a_few_samples_at_the_extreme_of_a_long_log_are_a_peak():
    for count, grade in ((7_000, Grade.WRONG), (9_000, Grade.GOOD)):  # one in 2000 are 3.5 and 4.5
        t = 0.004 * np.arange(count)
        v = np.sin(7.3 * t)[:, None]
        v[2_000:2_004] = 1.7
        (found,) = clipping_remarks(Recording(t, np.sin(0.9 * t)[:, None], v))
        assert found.grade is grade


@pytest.mark.parametrize(("sign", "word"), [(1.0, "largest"), (-1.0, "smallest")])
def test_a_clipped_current_is_named_with_its_limit(log, sign, word):
    v = log.v.copy()
    limit = 0.7 * float((sign * v[:, 3]).max())
    v[:, 3] = sign * np.minimum(sign * v[:, 3], limit)
    (found,) = clipping_remarks(Recording(log.t, log.q, v))
    assert (found.grade, found.joint) == (Grade.WRONG, 3)
    assert f"v4 stays at its {word} value {sign * limit:.4g}" in found.seen
    first = log.t[np.flatnonzero(sign * log.v[:, 3] >= limit)[0]]
    assert found.seen.endswith(f", first at t = {first:.6g} s")


def test_a_coarse_current_is_not_clipped(log):
    coarse = np.round(log.v / log.v.std(axis=0) * 3.0)
    assert {each.grade for each in clipping_remarks(Recording(log.t, log.q, coarse))} == {Grade.GOOD}


@pytest.mark.parametrize("what", ["position", "speed", "acceleration"])
def test_motion_in_place_of_a_current_is_named(log, what):
    rate = np.gradient(log.q[:, 2], log.t)
    x = {"position": log.q[:, 2], "speed": rate, "acceleration": np.gradient(rate, log.t)}[what]
    v = log.v.copy()
    v[:, 2] = 4.0 - 7.0 * x
    (found,) = column_remarks(Recording(log.t, log.q, v), OPTIONS)
    assert (found.grade, found.joint) == (Grade.WRONG, 2)
    assert f"v3 is the {what} of joint 3" in found.seen
    assert str(found.advice).startswith("log the current")


def test_a_current_that_is_nearly_all_viscous_friction_is_no_speed(log):
    rate, v = np.gradient(log.q[:, 2], log.t), log.v.copy()
    v[:, 2] = 7.0 * rate + 0.05 * np.std(7.0 * rate) * np.sign(rate)  # dry friction leaves 3 %
    (found,) = column_remarks(Recording(log.t, log.q, v), OPTIONS)
    assert found.seen == "none is a copy of another"


@pytest.mark.parametrize("kind", ["q", "v"])
def test_a_column_that_is_there_twice_is_named(log, kind):
    x = getattr(log, kind).copy()
    x[:, 4] = 2.0 - 3.0 * x[:, 1]
    (found,) = column_remarks(replace(log, **{kind: x}), OPTIONS)
    assert f"{kind}5 and {kind}2 hold the same numbers" in found.seen
    assert found.grade is Grade.WRONG
    assert str(found.advice).startswith({"q": "log each joint's own", "v": "log the current"}[kind])
    x[:, 4] += 0.03 * np.std(x[:, 4]) * np.sin(5.3 * log.t)  # two joints that move alike
    (found,) = column_remarks(replace(log, **{kind: x}), OPTIONS)
    assert found.grade is Grade.GOOD


def test_how_a_joint_moved_is_that_of_the_motion(ur):
    t = np.arange(0.0, 30.0, 0.008)
    rate, size = 2.0 * np.pi * 0.3, 0.7
    q = np.column_stack([0.2 + size * np.sin(rate * t)] * 6)
    arm = replace(ur.arm, lower=np.full(6, -1.5), upper=np.array([2.0, np.inf, 2.0, 2.0, 2.0, 2.0]))
    log = Recording(t, q, np.cos(rate * q) + 3.0)
    first, second, *_ = joint_motions(log, arm, OPTIONS)
    np.testing.assert_allclose((first.low, first.high), (-0.5, 0.9), rtol=1e-3)  # samples beside the extremes
    np.testing.assert_allclose(first.covered, 1.4 / 3.5, rtol=1e-3)
    assert second.covered is None
    np.testing.assert_allclose(first.speed, size * rate, rtol=1e-3)
    np.testing.assert_allclose(first.speed_rms, size * rate / np.sqrt(2.0), rtol=0.01)  # no whole periods
    np.testing.assert_allclose(first.acceleration_rms, size * rate**2 / np.sqrt(2.0), rtol=0.01)
    # |cos| below 0.1 / sqrt(2) for a share 2/pi arcsin(0.0707) of the time
    np.testing.assert_allclose(first.slow, 2.0 / np.pi * np.arcsin(0.1 / np.sqrt(2.0)), rtol=0.1)
    np.testing.assert_allclose(first.current_rms, np.sqrt(np.mean((np.cos(rate * q[:, 0]) + 3.0) ** 2)), rtol=1e-9)


def test_joints_that_move_little_or_rest_long_are_weak(ur, log):
    small = Recording(log.t, log.q * [1, 1, 1, 1, 0.02, 1], log.v)
    found = told(motion_remarks(small, joint_motions(small, ur.arm, OPTIONS)), "range")
    assert (found.grade, found.joint) == (Grade.WEAK, 4)
    rest = np.concatenate((np.repeat(log.q[:1, 1], 1400), log.q[:1100, 1]))
    q = log.q.copy()
    q[:, 1] = rest
    resting = Recording(log.t, q, log.v)
    found = told(motion_remarks(resting, joint_motions(resting, ur.arm, OPTIONS)), "reversals")
    assert (found.grade, found.joint) == (Grade.WEAK, 1)


@pytest.mark.parametrize("rows", [2, -3, 4])
def test_currents_that_come_late_or_early_are_timed(ur, log, rows):
    late = Recording(log.t[5:-5], log.q[5:-5], np.roll(log.v, rows, axis=0)[5:-5])
    found = lateness(late, observe(late, ur, OPTIONS), OPTIONS)
    assert found is not None
    assert found.std is not None
    assert BENT < found.std < 0.01
    np.testing.assert_allclose(found.value, 0.008 * rows, atol=3.0 * found.std)  # missed by 3 in 1000
    remark = delay_remark(late, observe(late, ur, OPTIONS), OPTIONS)
    assert remark.grade is not Grade.GOOD
    assert ("later" if rows > 0 else "earlier") in remark.seen


def test_a_delay_between_two_samples_is_placed_between_them(ur):
    quiet = known_logs(ur_like(), BRICK, UR_GAIN, np.random.default_rng(42), middle=UR_MIDDLE, noise=0.0005)[0]
    late = Recording(quiet.t[1:], quiet.q[1:], 0.4 * quiet.v[:-1] + 0.6 * quiet.v[1:])  # 3.2 ms
    found = lateness(late, observe(late, ur, OPTIONS), OPTIONS)
    assert found is not None
    np.testing.assert_allclose(found.value, 0.0032, atol=0.001)  # of steps of 8 ms


def test_a_delay_beyond_the_search_has_no_deviation(ur, log):
    late = Recording(log.t[8:], log.q[8:], log.v[:-8])  # 64 ms
    found = lateness(late, observe(late, ur, OPTIONS), OPTIONS)
    assert found is not None
    assert found.std is None
    assert found.value > 0.045
    assert delay_remark(late, observe(late, ur, OPTIONS), OPTIONS).grade is Grade.WRONG


def test_a_delay_that_cannot_be_seen_is_said_to_be(ur, log):
    q = log.q.copy()
    q[:, 0] = q[900, 0] + np.clip((log.t - 7.0) / 1.5, 0.0, 1.0) ** 3  # no more than 30 rows of joint 1
    resting = Recording(log.t, q, log.v)
    remark = delay_remark(resting, observe(resting, ur, OPTIONS), OPTIONS)
    assert (remark.grade, remark.seen) == (Grade.WEAK, "too few rows show it")


def test_a_delay_that_is_stated_is_none_beyond_it(ur, log):
    late = Recording(log.t[5:-5], log.q[5:-5], np.roll(log.v, -3, axis=0)[5:-5])  # stamped three samples early
    stated = replace(OPTIONS, current_delay=0.024)
    found = lateness(late, observe(late, ur, stated), stated)
    unstated = lateness(late, observe(late, ur, OPTIONS), OPTIONS)
    assert found is not None
    assert unstated is not None
    # the same samples, but three that are left out at the beginning
    np.testing.assert_allclose(found.value - unstated.value, 0.024, atol=1e-3)
    assert found.std is not None
    np.testing.assert_allclose(found.value, 0.0, atol=3.0 * found.std)  # missed by 3 in 1000


def test_every_fault_of_a_log_is_listed_not_the_first_alone(log):
    q, v = log.q.copy(), log.v.copy()
    q[800:, 1] += 2.0 * np.pi
    v[900, 3] += 5e4
    found = [str(each) for each in log_faults(Recording(log.t, q, v, "x"))]
    assert ["q2 jumps" in found[0], "v4 = " in found[1], len(found)] == [True, True, 2]
    assert list(log_faults(log)) == []


def test_a_delay_and_its_deviation_are_those_of_the_peak_of_the_likelihood(ur, log, monkeypatch):
    def peaked(observed, behind, shifted):
        delay = log.period * (np.arange(len(shifted)) - len(shifted) // 2)
        return 17.0 - 0.5 * ((delay - 0.0112) / 0.005) ** 2  # of a normal variable

    monkeypatch.setattr("ident.checks.lateness._likelihood", peaked)
    found = lateness(log, observe(log, ur, OPTIONS), OPTIONS)
    assert found is not None
    # A parabola through three points is the parabola itself.
    np.testing.assert_allclose(
        (found.value, found.std, found.evidence),
        (0.0112, np.hypot(0.005, BENT), 0.5 * (0.0112 / 0.005) ** 2),
        rtol=1e-9,
    )


@pytest.mark.parametrize(
    ("value", "std", "evidence", "grade"),
    [
        (0.0087, 0.004, 12.1, Grade.WEAK),
        (-0.0087, 0.004, 12.1, Grade.WEAK),
        (0.0087, 0.004, 11.9, Grade.GOOD),
        (0.0077, 0.004, 99.0, Grade.GOOD),
        (-0.0123, 0.004, 99.0, Grade.WRONG),
        (0.0116, 0.004, 99.0, Grade.WEAK),
        (3.1 * BENT, None, 99.0, Grade.WRONG),
    ],
)
def test_a_delay_is_told_where_it_is_beyond_two_deviations_and_sure(log, monkeypatch, value, std, evidence, grade):
    monkeypatch.setattr("ident.checks.lateness.lateness", lambda *_: Lateness(value, std, evidence))
    found = delay_remark(log, None, OPTIONS)
    assert found.grade is grade
    assert (found.advice is None) == (grade is Grade.GOOD)
    assert found.seen.startswith(f"{1e3 * value:.2g} ms" + ("" if std is None else ", 2 sigma 8"))
    if grade is not Grade.GOOD:
        assert found.seen.endswith(f"({'later' if value > 0 else 'earlier'} than the positions)")
