"""A log by itself: its clock, lost and repeated samples, its motion."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from consistency_logs import at, named, without
from scipy.interpolate import make_interp_spline

from ident.diagnosis.diagnosis import Diagnosis, Severity
from ident.diagnosis.motion_quality import joint_motions, motion
from ident.diagnosis.samples import SAMPLE_CHECKS, SPOILING
from ident.diagnosis.timing import clock, least_seconds, lost_samples, timestamp_anomalies
from ident.observation.observation import ObserveOptions, observe
from ident.recordings.checks import log_faults
from ident.recordings.recording import Recording
from ident.support.errors import RecordingError

OPTIONS = ObserveOptions()


def clocked(log: Recording, name: str) -> Diagnosis:
    return named(clock(log, OPTIONS), name)


gaps = partial(clocked, name="missing samples")


def test_a_clean_log_has_nothing_but_good_lines(ur_log):
    lines = [each for check in SAMPLE_CHECKS.values() for each in check(ur_log, OPTIONS)]
    assert {each.severity for each in lines} == {Severity.GOOD}
    assert {each.logs for each in lines} == {("a/log.csv",)}
    assert all(each.advice is None for each in lines)
    assert not any(spoilt(ur_log).any() for spoilt in SPOILING.values())
    assert set(SPOILING) <= {each.name for each in lines}  # every check that spoils samples says so under its name


def test_a_hole_splits_a_log_and_small_gaps_are_bridged(ur_log):
    # ten intervals of 8 ms and a bit, beyond which nothing is interpolated
    assert "used" not in gaps(without(ur_log, np.arange(900, 909))).sentence
    hole = gaps(without(ur_log, np.arange(900, 910)))
    assert (hole.severity, hole.sentence[-14:]) == (Severity.WEAK, "used as 2 logs")  # of 7 and 13 s
    early = gaps(without(ur_log, np.arange(90, 110)))
    assert early.sentence.endswith("; used from 0.88 to 19.99 s")  # .7 s are too short for six joints
    assert gaps(without(ur_log, [*range(280, 310), *range(600, 2500)])).severity is Severity.WRONG
    many = gaps(without(ur_log, np.arange(40, 2400, 45)))  # bridged, each alone
    assert (many.severity, many.value) == (Severity.WEAK, 53.0)


@pytest.mark.parametrize("options", [OPTIONS, ObserveOptions(cutoff_hz=1.5)])
def test_a_log_as_short_as_is_used_can_be_observed_and_one_shorter_by_a_third_cannot(ur, ur_log, options):
    rows = int(np.ceil(least_seconds(options, 6) / 0.008)) + 1
    cut = [Recording(ur_log.t[:k], ur_log.q[:k], ur_log.v[:k]) for k in (rows, 2 * rows // 3)]
    observe(cut[0], ur, options)
    with pytest.raises(RecordingError, match="give"):
        observe(cut[1], ur, options)


def test_rate_and_jitter_are_those_of_the_intervals_that_miss_nothing_and_a_slow_clock_is_weak(ur_log):
    t = np.cumsum(np.where(np.arange(len(ur_log.t)) % 3 == 2, 0.012, 0.010))  # two of 10 ms, one of 12: 93.75 Hz
    found = clocked(without(replace(ur_log, t=t), [700]), "rate")
    assert float(found.value) == pytest.approx(93.75, rel=1e-3)  # a gap of one interval less
    for step, grade in ((2, Severity.GOOD), (3, Severity.WEAK)):  # 62.5 and 41.7 Hz
        slow = Recording(ur_log.t[::step], ur_log.q[::step], ur_log.v[::step])
        assert clocked(slow, "rate").severity is grade
    seventh = np.arange(len(ur_log.t)) % 7 == 3
    late = restamped(ur_log, 0.2 * seventh, [500, 501])
    assert clocked(late, "rate").sentence == "sampled at 125 Hz: 2498 samples in 19.99 s"
    jitter = clocked(late, "jitter")
    assert (jitter.sentence, jitter.severity) == ("sampling intervals vary by up to 20 %", Severity.GOOD)
    assert clocked(restamped(ur_log, 0.6 * seventh), "jitter").severity is Severity.WEAK  # 60 %


def restamped(log: Recording, lateness, rows=()) -> Recording:
    """The log without some rows, stamps late by so many of its periods of 8 ms."""
    return without(replace(log, t=log.t + 0.008 * lateness), rows)


def test_stamps_that_jitter_and_intervals_of_which_each_is_random_miss_nothing_but_holes(ur_log, rng):
    late = np.clip(rng.normal(0.0, 0.25, len(ur_log.t)), -0.37, 0.37)
    row = np.arange(len(late))
    single = 0.8 * (row % 23 == 11)
    stalled = 1.8 * (row % 311 == 40) + 0.9 * (row % 311 == 41)  # two samples wait, and are stamped at once
    for lateness in (late, single, stalled):
        log = restamped(ur_log, lateness)
        intervals = np.diff(log.t)
        assert intervals.max() > 1.6 * 0.008
        assert gaps(log).sentence == "the time stamps show no missing samples"
        varied = 100.0 * np.abs(intervals / np.median(intervals) - 1.0).max()
        assert clocked(log, "jitter").sentence == f"sampling intervals vary by up to {varied:.3g} %"
    t = 0.008 * np.cumsum(np.maximum(1.0 + rng.normal(0.0, 0.23, len(ur_log.t)), 0.05))
    assert np.diff(t).max() > 1.6 * 0.008
    assert gaps(replace(ur_log, t=t)).severity is Severity.GOOD
    found = gaps(without(replace(ur_log, t=t), np.arange(700, 714)))
    assert float(found.value) == pytest.approx(14.0, abs=4.0)  # deviation of 15 such intervals, four times: 3.6


@pytest.mark.parametrize("stalled", [False, True])
def test_samples_that_are_missing_are_counted_beside_stamps_as_late_as_a_gap_is_long(ur_log, rng, stalled):
    late = np.where(rng.random(len(ur_log.t)) < 0.04, 0.65, 0.0)
    late[580:620] = 0.0
    late[[593, 606]] = 0.65  # beside the gap
    if stalled:  # an interval longer than the gap, which misses nothing
        late[:] = 0.0
        late[[40, 41]] = 1.8, 0.9
    log = restamped(ur_log, late, [600])
    assert (np.diff(log.t).argmax() == 39) == stalled
    said = "1 sample is missing in 1 gap, the longest 0.016 s at t = 4.792 s"  # row 599, of 8 ms
    assert gaps(log).sentence == said


LOST = [411, 902, 903, 1700]


def test_samples_lost_behind_an_even_clock_are_found_where_they_are(ur_log):
    whole = without(ur_log, LOST, even=True)
    coarse = replace(whole, q=np.round(whole.q / 8e-4) * 8e-4)  # sure beside what rounding deviates by, and no more
    for log, before in (
        (whole, [410, 900, 1696]),  # the row before, in the log that remains
        (coarse, [410, 900, 1696]),
        (without(ur_log, [*range(500, 520), 523], even=True), [499, 502]),  # a step of 21, two rows on one of 2
    ):
        odd, spoilt = timestamp_anomalies(log), SPOILING["lost samples"](log)
        assert (odd.long.tolist(), odd.still.tolist()) == (before, [])
        assert np.flatnonzero(spoilt.all(axis=1)).tolist() == sorted({*before, *(row + 1 for row in before)})
    found = named(lost_samples(whole), "lost samples")
    assert found.severity is Severity.WEAK
    assert "4 samples are lost without a gap in the time stamps, first after row 411, 3.28 s" in found.sentence


def test_an_arm_that_sags_when_it_is_switched_on_has_lost_nothing_however_slowly_it_is_logged(ur_log):
    for samples in (3.0, 4.5, 7.0):  # of the peak of speed; all joints alike
        for begins in (-0.4, 2.3, 900.0):
            row = np.arange(len(ur_log.t)) - begins
            bump = np.exp(-0.5 * (row / (0.42 * samples)) ** 2)
            q = ur_log.q[0] + np.outer(np.cumsum(bump), [3e-3, -7e-4, 2e-3, 5e-4, -4e-3, 9e-4])
            odd = timestamp_anomalies(replace(ur_log, q=q + 2e-6 * np.sin(7.0 * ur_log.q / 1e-3)))
            assert len(odd.long) == 0


@pytest.mark.parametrize("honest", [False, True])
def test_jitter_of_the_stamps_is_no_lost_sample_and_hides_none(ur_log, rng, honest):
    late = np.clip(rng.normal(0.0, 0.04 if honest else 0.13, len(ur_log.t)), -0.3, 0.3)
    t = ur_log.t + 0.008 * late
    taken = make_interp_spline(ur_log.t, ur_log.q, k=3)(t) if honest else ur_log.q
    log = replace(ur_log, t=t, q=taken)
    for sound in (log, without(log, [640, 641, 1300])):  # by honest stamps
        assert len(timestamp_anomalies(sound).long) == len(timestamp_anomalies(sound).still) == 0
    lost = np.array(LOST)
    kept = np.setdiff1d(np.arange(len(t)), lost)
    unseen = Recording(t[kept] - 0.008 * np.searchsorted(lost, kept), log.q[kept], log.v[kept])
    odd = timestamp_anomalies(unseen)
    np.testing.assert_array_equal(odd.long, [410, 900, 1696])
    np.testing.assert_array_equal(odd.lost, [1, 2, 1])


def test_samples_that_a_gap_of_the_stamps_hides_are_counted_beside_those_that_it_shows(ur_log):
    log = without(ur_log, np.arange(899, 904))  # five rows, two of them by the stamps
    log = replace(log, t=log.t - np.where(np.arange(len(log.t)) > 898, 3.0 * 0.008, 0.0))
    assert gaps(log).value == 2.0
    odd = timestamp_anomalies(log)
    assert (odd.long.tolist(), odd.lost.tolist()) == ([898], [3])


def test_a_log_that_loses_too_much_to_be_restored_is_wrong_from_one_step_in_five_hundred(ur_log):
    for count, severity in ((4, Severity.WEAK), (7, Severity.WRONG)):
        rows = np.linspace(200, 2300, count).astype(int)
        lost = (rows[:, None] + np.arange(14)).ravel()  # more than straight lines may stand in for
        found = named(lost_samples(without(ur_log, lost, even=True)), "lost samples")
        assert (found.severity, "jump ahead" in found.sentence) == (severity, True)
        assert "stamps corrected" in lost_samples(without(ur_log, rows, even=True))[0].sentence


def test_repeated_rows_of_a_moving_arm_are_found(ur_log):
    rows = np.arange(len(ur_log.t))
    rows[[600, 601, 1500]] = [599, 599, 1499]
    again = Recording(ur_log.t, ur_log.q[rows], ur_log.v[rows], ur_log.name)
    odd = timestamp_anomalies(again)
    assert (odd.still.tolist(), odd.long.tolist()) == ([599, 600, 1499], [])  # the row after them catches up
    spoilt = SPOILING["repeated samples"](again).any(axis=1)
    np.testing.assert_array_equal(np.flatnonzero(spoilt), [599, 600, 601, 1499, 1500])
    assert "repeat 3 times, first after row 600" in named(lost_samples(again), "repeated samples").sentence


def test_coarse_encoders_an_arm_at_rest_and_one_joint_that_jumps_lose_and_repeat_nothing(ur_log):
    q, started = ur_log.q, np.clip((ur_log.t - 3.0) / 2.0, 0.0, 1.0) ** 3
    still = q[400] + started[:, None] * (q - q[400])
    assert (still[:300] == still[0]).all()
    one = np.where(np.arange(6) == 3, np.round(q / 0.004) * 0.004, q)  # about one step a sample
    every = np.round(q / 0.02) * 0.02  # a step in several samples
    odd = [timestamp_anomalies(replace(ur_log, q=each)) for each in (one, every, still)]
    assert [len(each.long) for each in odd[:2]] == [0, 0]
    assert [len(each.still) for each in odd[1:]] == [0, 0]
    alone = np.outer(np.arange(len(q)) > 800, 9.0 * at(3, q[801, 3] - q[800, 3], 0.0))  # one joint jumps
    assert 800 not in timestamp_anomalies(replace(ur_log, q=q + alone)).long


def test_currents_that_are_logged_more_slowly_are_named(ur_log):
    held = Recording(ur_log.t, ur_log.q, np.repeat(ur_log.v[::2], 2, axis=0))
    assert named(lost_samples(held), "held currents").severity is Severity.WEAK
    one = np.where(np.arange(6) == 3, held.v, ur_log.v)
    for other in (ur_log.v, one):  # a current that holds alone is coarse, or logged on its own
        assert not [each for each in lost_samples(replace(ur_log, v=other)) if each.name == "held currents"]


def test_how_a_joint_moved_is_that_of_the_motion(ur):
    t = np.arange(0.0, 30.0, 0.008)
    rate, size = 2.0 * np.pi * 0.3, 0.7
    q = np.column_stack([0.2 + size * np.sin(rate * t)] * 6)
    arm = replace(ur.arm, lower=np.full(6, -1.5), upper=np.array([2.0, np.inf, 2.0, 2.0, 2.0, 2.0]))
    ur_log = Recording(t, q, np.cos(rate * q) + 3.0)
    first, second, *_ = joint_motions(ur_log, arm, OPTIONS)
    np.testing.assert_allclose((first.low, first.high), (-0.5, 0.9), rtol=1e-3)  # samples beside the extremes
    np.testing.assert_allclose(first.covered, 1.4 / 3.5, rtol=1e-3)
    assert second.covered is None
    np.testing.assert_allclose(first.speed, size * rate, rtol=1e-3)
    np.testing.assert_allclose(first.speed_rms, size * rate / np.sqrt(2.0), rtol=0.01)  # no whole periods
    np.testing.assert_allclose(first.acceleration_rms, size * rate**2 / np.sqrt(2.0), rtol=0.01)
    # |cos| below 0.1 / sqrt(2) for a share 2/pi arcsin(0.0707) of the time
    np.testing.assert_allclose(first.slow, 2.0 / np.pi * np.arcsin(0.1 / np.sqrt(2.0)), rtol=0.1)
    np.testing.assert_allclose(first.current_rms, np.sqrt(np.mean((np.cos(rate * q[:, 0]) + 3.0) ** 2)), rtol=1e-9)


def test_joints_that_move_little_or_rest_long_are_weak(ur_log):
    resting = np.where(np.arange(6) == 1, np.vstack((np.repeat(ur_log.q[:1], 1400, 0), ur_log.q[:1100])), ur_log.q)
    for q, name, joint in ((ur_log.q * at(4, 0.02, 1.0), "range", 4), (resting, "reversals", 1)):
        found = named(motion(replace(ur_log, q=q), OPTIONS), name)
        assert (found.severity, found.joints) == (Severity.WEAK, (joint,))


def test_every_fault_of_a_log_is_listed_not_the_first_alone(ur_log):
    row = np.arange(len(ur_log.t))
    q, v = ur_log.q + np.outer(row >= 800, at(1, 2.0 * np.pi, 0.0)), ur_log.v + np.outer(row == 900, at(3, 5e4, 0.0))
    one, other = (each.sentence for each in log_faults(Recording(ur_log.t, q, v, "x")))
    assert ("q2 jumps" in one, "v4 = " in other, list(log_faults(ur_log))) == (True, True, [])
