"""Each check just inside and just outside its limit, and silent on what robots really log."""

from pathlib import Path

import numpy as np
import pytest

from ident.recordings.checks import BURST, FASTEST, FASTEST_CLOCK, SLOWEST, UNUSUAL, check_log, log_faults
from ident.recordings.files import read_recording
from ident.recordings.recording import LARGEST_CURRENT, LARGEST_POSITION, Recording
from ident.support.errors import RecordingError

H = 0.002
T = H * np.arange(4000)
Q = np.column_stack((0.9 * np.sin(2.1 * T), 0.4 * np.cos(3.3 * T)))
V = np.column_stack((np.cos(1.3 * T), 7.0 + np.sin(2.7 * T)))
INSIDE, OUTSIDE = 1.0 - 1e-9, 1.0 + 1e-9


def log(t: np.ndarray = T, q: np.ndarray = Q, v: np.ndarray = V) -> Recording:
    return Recording(t, q, v, "log")


def changed(values: np.ndarray, rows: slice | int, joint: int, value: float) -> np.ndarray:
    values = values.copy()
    values[rows, joint] = value
    return values


def test_a_smooth_motion_passes():
    check_log(log())


CLOCKS = {
    SLOWEST * OUTSIDE: "milliseconds",
    99.9: "milliseconds",
    100.0 * OUTSIDE: "microseconds",
    99e3: "microseconds",
    1e5 * OUTSIDE: "nanoseconds",
    FASTEST_CLOCK * INSIDE: "hours",
}


@pytest.mark.parametrize("interval", CLOCKS)
def test_a_clock_in_another_unit_is_named(interval):
    with pytest.raises(RecordingError, match=rf"t advances by .* a row; is it in {CLOCKS[interval]}\? t is in seconds"):
        check_log(log(interval * np.arange(4000)))


def test_clocks_just_inside_the_limits_pass():
    for interval in (SLOWEST * INSIDE, FASTEST_CLOCK * OUTSIDE):
        check_log(log(interval * np.arange(4000)))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_step_is_refused_from_the_speed_that_no_joint_has(sign):
    slow = np.column_stack((1e-3 * np.sin(T), Q[:, 1]))
    step = np.where(np.arange(4000) >= 1700, sign * FASTEST * H, 0.0)
    check_log(log(q=slow + np.outer(0.99 * step, [1, 0])))
    with pytest.raises(
        RecordingError, match=r"log: q1 jumps by -?0\.1.* from row 1700 to the next, faster than 50 rad/s or m/s; such"
    ):
        check_log(log(q=slow + np.outer(1.01 * step, [1, 0])))


def test_a_step_must_be_unusual_for_its_channel_too():
    rng = np.random.default_rng(3)
    noisy = rng.normal(size=Q.shape)  # every second step is faster than any robot, none is unusual
    check_log(log(q=noisy))
    usual = np.quantile(np.abs(np.diff(noisy[:, 1])), 0.99)
    with pytest.raises(RecordingError, match=r"q2 jumps by .* from row 50 to the next, .*, and 1 more such steps"):
        check_log(log(q=changed(noisy, 50, 1, noisy[49, 1] + 1.1 * UNUSUAL * usual)))
    check_log(log(q=changed(noisy, 50, 1, noisy[49, 1] + 0.9 * UNUSUAL * usual)))


def test_two_packets_that_arrive_together_are_no_jump():
    t = T.copy()
    t[1000] = t[999] + 1e-7
    step = np.where(np.arange(4000) >= 1000, 0.5 * FASTEST * H, 0.0)  # half the speed, were the clock even
    check_log(log(t=t, q=np.column_stack((1e-3 * np.sin(T) + step, Q[:, 1]))))


TURNS = [(2.0 * np.pi, "2 pi", r"np.unwrap\(q, axis=0\)"), (360.0, "360", r"np.unwrap\(q, period=360, axis=0\)")]


@pytest.mark.parametrize(("turn", "unit", "repair"), TURNS)
def test_wrapped_angles_are_named_with_what_unwraps_them(turn, unit, repair):
    wide = np.column_stack((Q[:, 0], turn * np.sin(2.1 * T)))
    wrapped = (wide + turn / 2.0) % turn - turn / 2.0
    wrapped[:, 0] = Q[:, 0]
    with pytest.raises(RecordingError, match=rf"q2 jumps by -.*, a turn of {unit}: the angles are wrapped; .*{repair}"):
        check_log(log(q=wrapped))
    np.testing.assert_allclose(np.unwrap(wrapped[:, 1], period=turn), wide[:, 1], atol=1e-12 * turn)


@pytest.mark.parametrize(("usual", "off"), [(1e-4, 0.3), (0.2, 1.1)])
def test_a_step_near_a_turn_is_one_only_as_near_as_usual_steps_and_a_tenth_of_it(usual, off):
    q = Q.copy()
    q[:, 1] = np.where(np.arange(4000) % 2, usual, 0.0)
    q[1700:, 1] += 2.0 * np.pi + off
    with pytest.raises(RecordingError, match=r"q2 jumps by .* from row 1700 to the next, faster than 50 rad/s"):
        check_log(log(q=q))
    q[1700:, 1] -= off
    with pytest.raises(RecordingError, match=r"q2 jumps by .* from row 1700 to the next, a turn of 2 pi"):
        check_log(log(q=q))


@pytest.mark.parametrize("length", [1, BURST])
@pytest.mark.parametrize("at", [0, 1234, 4000 - BURST])
def test_currents_far_out_for_a_few_samples_are_named(length, at):
    with pytest.raises(
        RecordingError, match=rf"v2 = -1e\+06 at row {at + 1}, while 99 % .*; {length} such samples \(rows {at + 1}"
    ):
        check_log(log(v=changed(V, slice(at, at + length), 1, -1e6)))


def test_currents_far_out_for_longer_are_a_motion():
    check_log(log(v=changed(V, slice(100, 100 + BURST + 1), 1, 1e6)))


def test_a_current_is_far_out_relative_to_its_median_and_its_usual_range():
    away = np.abs(V[:, 1] - np.median(V[:, 1]))
    edge = float(np.median(V[:, 1]) + UNUSUAL * np.quantile(away, 0.99))
    check_log(log(v=changed(V, 700, 1, 0.98 * (edge - 7.0) + 7.0)))
    with pytest.raises(RecordingError, match=r"v2 = .* at row 701"):
        check_log(log(v=changed(V, 700, 1, 1.02 * (edge - 7.0) + 7.0)))


def test_many_spikes_are_counted_and_the_first_listed():
    spiky = V.copy()
    spiky[[10, 20, 30, 40, 50, 60, 70], 0] = 500.0
    with pytest.raises(RecordingError, match=r"; 7 such samples \(rows 11, 21, 31, 41, 51, 61, \.\.\); remove"):
        check_log(log(v=spiky))


def test_gaussian_noise_raises_no_alarm():
    # A sample 50 standard deviations out has probability 1e-545: no false alarm in any number of seeds.
    for seed in range(20):
        rng = np.random.default_rng(seed)
        check_log(log(q=Q + 1e-3 * rng.normal(size=Q.shape), v=3.0 * rng.normal(size=V.shape)))


def test_a_joint_at_rest_but_for_a_short_motion_raises_no_alarm():
    rng = np.random.default_rng(1)
    move = (np.arange(4000) > 3000) & (np.arange(4000) < 3030)  # 0.75 % of the samples
    v = 0.01 * rng.normal(size=V.shape) + np.outer(move, [5.0, -8.0])
    check_log(log(q=Q * 1e-5 + 0.1 * np.outer(np.clip((T - 6.0) / 0.06, 0, 1), [1, 1]), v=v))


@pytest.mark.parametrize("field", ["q", "v"])
def test_numbers_beyond_any_unit_are_refused(field):
    largest, what = {"q": (LARGEST_POSITION, "position"), "v": (LARGEST_CURRENT, "current")}[field]
    values = {"q": Q, "v": V}
    log(**{field: changed(values[field], 5, 1, -largest)})
    with pytest.raises(
        RecordingError, match=rf"log: {field}2 = -.* at row 6 \(1 such values\); expected {what}s up to 1e\+"
    ):
        log(**{field: changed(values[field], 5, 1, -1.001 * largest)})


@pytest.mark.real
def test_real_recordings_raise_no_alarm(real: Path):
    files = sorted(each for each in real.glob("*/*.parquet") if each.parent.name != "voraus")  # fragments, no log
    assert len(files) >= 5
    for file in files:
        check_log(read_recording(file))


def spiky(values: np.ndarray, joint: int, share: float, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Values with spikes of either sign in a share of the rows, none beside another, and the rows."""
    rng = np.random.default_rng(3)
    rows = 11 + 8 * rng.choice(480, round(share * len(values)), replace=False)
    values = values.copy()
    values[rows, joint] += size * rng.choice([-1.0, 1.0], len(rows))
    return values, np.sort(rows)


@pytest.mark.parametrize("share", [0.015, 0.11])
def test_spikes_in_many_samples_of_a_current_are_counted_and_the_first_is_named(share):
    v, rows = spiky(V, 1, share, 1.7)
    message = rf"v2 has {len(rows)} spikes \({100 * share:.2g} % of its samples\), the first at row {rows[0] + 1}, t = "
    with pytest.raises(RecordingError, match=message):
        check_log(log(v=v))


def test_spikes_in_many_samples_of_a_position_are_counted_and_the_first_is_named():
    q, rows = spiky(Q, 0, 0.02, 1.01 * FASTEST * H + 0.01)  # and what the motion itself does in three samples
    with pytest.raises(RecordingError, match=rf"q1 has {len(rows)} spikes \(2 % of its samples\), the first at row"):
        check_log(log(q=q))
    check_log(log(q=spiky(Q, 0, 0.02, 0.9 * FASTEST * H)[0]))


def test_spikes_smaller_than_half_of_what_a_current_does_anyway_pass():
    low, high = np.quantile(V[:, 1], [0.05, 0.95])
    check_log(log(v=spiky(V, 1, 0.02, 0.48 * (high - low))[0]))
    with pytest.raises(RecordingError, match="v2 has 80 spikes"):
        check_log(log(v=spiky(V, 1, 0.02, 0.53 * (high - low))[0]))


def test_spikes_that_rise_and_fall_in_two_samples_are_as_large_as_their_peaks():
    v, peaks = V.copy(), slice(20, None, 50)
    v[peaks, 1] += 1.3
    v[19::50, 1] += 0.65
    v[21::50, 1] += 0.65
    with pytest.raises(RecordingError, match=f"v2 has {len(T[peaks])} spikes"):
        check_log(log(v=v))


@pytest.mark.parametrize(("kind", "size"), [("normal", 1.0), ("laplace", 0.7)])
def test_noise_however_large_is_no_spike(kind, size):
    noise = getattr(np.random.default_rng(8), kind)(size=V.shape)
    check_log(log(v=V + size * noise))  # 13 deviations of Gaussian noise, probability 1e-38


COARSE = 0.25 * np.rint(1.6 * np.sin(1.7 * T))  # five values


def coarse(step: float, rows: slice | list[int]) -> np.ndarray:
    """A current of few values that is away by a step in some rows."""
    v = V.copy()
    v[:, 1] = 0.3 + COARSE
    v[rows, 1] += step
    return v


@pytest.mark.parametrize("rows", [slice(40, None, 190), [700]])
def test_a_coarse_current_that_flickers_by_a_step_has_no_spikes(rows):
    still = V.copy()
    still[:, 1] = 0.3
    still[2000:2100, 1] = 0.55
    still[rows, 1] -= 0.25
    for v in (coarse(0.25, rows), still):
        check_log(log(v=v))


def test_a_coarse_current_that_is_away_by_more_than_a_step_has_spikes():
    with pytest.raises(RecordingError, match="v2 has 21 spikes"):
        check_log(log(v=coarse(1.25, slice(40, None, 190))))


def test_of_two_values_one_may_be_a_fault():
    v = V.copy()
    v[:, 1] = 0.3
    v[40::190, 1] = 0.55
    with pytest.raises(RecordingError, match="v2"):
        check_log(log(v=v))


def test_a_current_at_rest_that_flickers_to_either_side_now_and_then_has_no_spikes():
    v = V.copy()
    v[:, 1] = 0.3
    v[[300, 900, 1500], 1], v[[700, 2100], 1] = 0.55, 0.05
    check_log(log(v=v))
    v[[700, 2100], 1] = 0.1  # no multiple of a step
    with pytest.raises(RecordingError, match="5 such samples"):
        check_log(log(v=v))


def test_spikes_of_one_size_in_a_fine_current_are_no_steps_of_it():
    v = V.copy()
    v[:, 1] = np.where(np.arange(4000) % 190 == 40, 0.8, 0.1 * np.rint(T) * 1e-3)
    with pytest.raises(RecordingError, match="v2"):
        check_log(log(v=v))


def test_a_step_of_friction_is_no_spike():
    check_log(log(v=V + 9.0 * np.sign(np.sin(2.7 * T))[:, None]))


def stepping(later: int, every: int = 37) -> tuple[np.ndarray, np.ndarray]:
    """A coarse encoder of joint 2, and a current that spikes some samples after each of its steps."""
    q, v = Q.copy(), V.copy()
    q[:, 1] = 1e-3 * (np.arange(len(T)) // every)
    rows = np.arange(every, len(T) - later, every) + later
    v[rows, 1] += 4.0 * np.ptp(V[:, 1])
    return q, v


@pytest.mark.parametrize("later", [0, 3])
def test_a_current_that_answers_each_step_of_its_encoder_has_no_spikes(later):
    q, v = stepping(later)
    check_log(log(q=q, v=v))


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_few_spikes_may_follow_steps_by_chance_but_not_where_another_joint_of_the_arm_answers_its_own(order):
    def doubted(*, beside: bool, late: int = 0) -> str:
        q, v = stepping(later=1)
        if not beside:
            q[:, 1], v[:, 1] = Q[:, 1], V[:, 1]
        q[:, 0] = 1e-3 * (np.arange(len(T)) // 8 % 2)  # half of all samples follow one of these steps
        rows = np.arange(80, len(T) - 8, 160) + 2  # 25 spikes
        rows[7] += late
        v[rows, 0] += 4.0 * np.ptp(V[:, 0])
        return "; ".join(each.sentence for each in log_faults(log(q=q[:, order], v=v[:, order])))

    spiky = f"v{order[0] + 1} has 25 spikes"
    assert spiky in doubted(beside=False)
    assert not doubted(beside=True)
    assert spiky in doubted(beside=True, late=4)  # one of them follows no step


@pytest.mark.parametrize(("later", "every"), [(4, 37), (-1, 37), (0, 1)])
def test_spikes_that_do_not_follow_a_step_or_do_so_by_chance_are_refused(later, every):
    q, v = stepping(later)
    q[:, 1] = 1e-3 * (np.arange(len(T)) // every)
    with pytest.raises(RecordingError, match=r"v2 has \d+ spikes"):
        check_log(log(q=q, v=v))
