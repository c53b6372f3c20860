"""Each check just inside and just outside its limit, and silent on what robots really log."""

from pathlib import Path

import numpy as np
import pytest

from ident.recordings.checks import BURST, FASTEST, FASTEST_CLOCK, SLOWEST, UNUSUAL, check_log, log_faults, spikes
from ident.recordings.files import read_recording
from ident.recordings.recording import Recording
from ident.support.errors import RecordingError

H = 0.002
T = H * np.arange(4000)
Q = np.column_stack((0.9 * np.sin(2.1 * T), 0.4 * np.cos(3.3 * T)))
V = np.column_stack((np.cos(1.3 * T), 7.0 + np.sin(2.7 * T)))
INSIDE, OUTSIDE = 1.0 - 1e-9, 1.0 + 1e-9


def passes(t: np.ndarray = T, q: np.ndarray = Q, v: np.ndarray = V) -> None:
    check_log(Recording(t, q, v, "log"))


def refused(message: str, t: np.ndarray = T, q: np.ndarray = Q, v: np.ndarray = V) -> None:
    with pytest.raises(RecordingError, match=rf"^log: {message}"):
        check_log(Recording(t, q, v, "log"))


def changed(values: np.ndarray, rows: slice | int | list[int], joint: int, value: float) -> np.ndarray:
    values = values.copy()
    values[rows, joint] = value
    return values


CLOCKS = {
    SLOWEST * OUTSIDE: r"in ms\? Then add --state 't.factor = 0.001'$",
    4e3: r"in us\? Then add --state 't.factor = 1e-06'$",
    4e6: r"in ns\? Then add --state 't.factor = 1e-09'$",
    14.0: r"in ms\? Then add --state 't.factor = 0.001'; or in us\? Then add --state 't.factor = 1e-06'$",
    FASTEST_CLOCK * INSIDE: "a time",
    1.0: "in ms.*; or the number of",
}


def test_a_clock_in_another_unit_is_named():
    for interval, unit in CLOCKS.items():
        refused(rf"t advances by .* s a row, .*is it {unit}", t=interval * np.arange(4000))
    for interval in (SLOWEST * INSIDE, FASTEST_CLOCK * OUTSIDE):
        passes(t=interval * np.arange(4000))
    with pytest.raises(RecordingError, match=r"advances by 3\.7e\+03 ms a row, .*; is it in us\? .*= 0\.001'"):
        check_log(Recording(3.7 * np.arange(4000), Q, V), t_unit="ms")


def test_a_step_is_refused_from_the_speed_that_no_joint_has_if_it_is_unusual_for_its_channel_too():
    slow = np.column_stack((1e-3 * np.sin(T), Q[:, 1]))
    for sign in (1.0, -1.0):
        step = np.outer(np.where(np.arange(4000) >= 1700, sign * FASTEST * H, 0.0), [1, 0])
        passes(q=slow + 0.99 * step)
        refused(r"q1 jumps by -?0\.1.* from row 1700 to the next, faster than 50", q=slow + 1.01 * step)
    noisy = np.random.default_rng(3).normal(size=Q.shape)  # every second step is faster than any robot
    passes(q=noisy)
    usual = np.quantile(np.abs(np.diff(noisy[:, 1])), 0.99)
    far = changed(noisy, 50, 1, noisy[49, 1] + 1.1 * UNUSUAL * usual)
    refused(r"q2 jumps by .* from row 50 to the next, .*, and 1 more such steps", q=far)
    passes(q=changed(noisy, 50, 1, noisy[49, 1] + 0.9 * UNUSUAL * usual))


def test_two_packets_that_arrive_together_are_no_jump():
    t = T.copy()
    t[1000] = t[999] + 1e-7
    step = np.where(np.arange(4000) >= 1000, 0.5 * FASTEST * H, 0.0)  # half the speed, were the clock even
    passes(t=t, q=np.column_stack((1e-3 * np.sin(T) + step, Q[:, 1])))


@pytest.mark.parametrize(("turn", "unit", "repair"), [(2.0 * np.pi, "2 pi", "axis=0"), (360.0, "360", "period=360")])
def test_wrapped_angles_are_named_with_what_unwraps_them(turn, unit, repair):
    wide = np.column_stack((Q[:, 0], turn * np.sin(2.1 * T)))
    wrapped = (wide + turn / 2.0) % turn - turn / 2.0
    wrapped[:, 0] = Q[:, 0]
    refused(rf"q2 jumps by -.*, a turn of {unit}: the angles are wrapped; .*np\.unwrap\(q, {repair}", q=wrapped)


@pytest.mark.parametrize(("usual", "off"), [(1e-4, 0.3), (0.2, 1.1)])
def test_a_step_near_a_turn_is_one_only_as_near_as_usual_steps_and_a_tenth_of_it(usual, off):
    q = changed(Q, slice(None), 1, 0.0)
    q[1::2, 1] = usual
    q[1700:, 1] += 2.0 * np.pi + off
    refused(r"q2 jumps by .* from row 1700 to the next, faster than 50 rad/s", q=q)
    q[1700:, 1] -= off
    refused(r"q2 jumps by .* from row 1700 to the next, a turn of 2 pi", q=q)


def test_currents_far_out_for_a_few_samples_are_named_and_longer_ones_are_a_motion():
    for length in (1, BURST):
        for at in (0, 1234, 4000 - BURST):
            spiky = changed(V, slice(at, at + length), 1, -1e6)
            refused(rf"v2 = -1e\+06 at row {at + 1}, while 99 % .*; {length} such samples \(rows {at + 1}", v=spiky)
    passes(v=changed(V, slice(100, 100 + BURST + 1), 1, 1e6))
    rows = [10, 20, 30, 40, 50, 60, 70]
    refused(r".*; 7 such samples \(rows 11, 21, 31, 41, 51, 61, \.\.\); remove", v=changed(V, rows, 0, 500.0))


def test_a_current_is_far_out_relative_to_its_median_and_its_usual_range():
    away = np.abs(V[:, 1] - np.median(V[:, 1]))
    edge = float(np.median(V[:, 1]) + UNUSUAL * np.quantile(away, 0.99))
    passes(v=changed(V, 700, 1, 0.98 * (edge - 7.0) + 7.0))
    refused("v2 = .* at row 701", v=changed(V, 700, 1, 1.02 * (edge - 7.0) + 7.0))


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
def test_spikes_in_many_samples_are_counted_and_the_first_is_named(share):
    v, rows = spiky(V, 1, share, 1.7)
    refused(rf"v2 has {len(rows)} spikes \({100 * share:.2g} % .*, the first at row {rows[0] + 1}, t = ", v=v)
    q, rows = spiky(Q, 0, share, 1.01 * FASTEST * H + 0.01)  # and what the motion itself does in three samples
    refused(rf"q1 has {len(rows)} spikes \({100 * share:.2g} % of its samples\), the first at row", q=q)
    passes(q=spiky(Q, 0, share, 0.9 * FASTEST * H)[0])


def test_masks_of_spikes_are_those_of_positions_and_of_few_and_many_of_currents():
    q, of_q = spiky(Q, 0, 0.02, 1.01 * FASTEST * H + 0.01)
    v, of_v = spiky(V, 1, 0.015, 1.7)
    v[[70, 900], 0] = 500.0
    found = spikes(Recording(T, q, v))
    for mask, joint, rows in ((found[0], 0, of_q), (found[1], 1, of_v), (found[1], 0, [70, 900])):
        np.testing.assert_array_equal(np.flatnonzero(mask[:, joint]), rows)
    assert not found[0][:, 1].any()


def test_spikes_smaller_than_half_of_what_a_current_does_anyway_pass():
    low, high = np.quantile(V[:, 1], [0.05, 0.95])
    passes(v=spiky(V, 1, 0.02, 0.48 * (high - low))[0])
    refused("v2 has 80 spikes", v=spiky(V, 1, 0.02, 0.53 * (high - low))[0])


def test_spikes_that_rise_and_fall_in_two_samples_are_as_large_as_their_peaks():
    v = V.copy()
    v[20::50, 1] += 1.3
    v[19::50, 1] += 0.65
    v[21::50, 1] += 0.65
    refused(f"v2 has {len(T[20::50])} spikes", v=v)


def still(rows: dict[float, slice | list[int]]) -> np.ndarray:
    """A current of 0.3 at rest, that has other values in some rows."""
    v = changed(V, slice(None), 1, 0.3)
    for value, which in rows.items():
        v[which, 1] = value
    return v


def test_a_coarse_current_that_flickers_by_a_step_has_no_spikes():
    coarse = 0.3 + 0.25 * np.rint(1.6 * np.sin(1.7 * T))  # five values
    for rows in (slice(40, None, 190), [700]):
        v = changed(V, slice(None), 1, 0.0)
        v[:, 1] = coarse
        v[rows, 1] += 0.25
        passes(v=v)
        passes(v=still({0.55: slice(2000, 2100), 0.05: rows}))
    v[40::190, 1] = coarse[40::190] + 1.25
    refused("v2 has 21 spikes", v=v)
    refused("v2", v=still({0.55: slice(40, None, 190)}))  # of two values, one may be a fault
    passes(v=still({0.55: [300, 900, 1500], 0.05: [700, 2100]}))
    refused(".* 5 such samples", v=still({0.55: [300, 900, 1500], 0.1: [700, 2100]}))  # no multiple of a step
    fine = V.copy()
    fine[:, 1] = np.where(np.arange(4000) % 190 == 40, 0.8, 0.1 * np.rint(T) * 1e-3)
    refused("v2", v=fine)


def stepping(later: int, every: int = 37) -> tuple[np.ndarray, np.ndarray]:
    """A coarse encoder of joint 2, and a current that spikes some samples after each of its steps."""
    q, v = Q.copy(), V.copy()
    q[:, 1] = 1e-3 * (np.arange(len(T)) // every)
    rows = np.arange(every, len(T) - later, every) + later
    v[rows, 1] += 4.0 * np.ptp(V[:, 1])
    return q, v


def test_a_current_that_answers_each_step_of_its_encoder_has_no_spikes():
    for later in (0, 3):
        q, v = stepping(later)
        passes(q=q, v=v)
    for later, every in ((4, 37), (-1, 37), (0, 1)):  # late, early, by chance
        q, v = stepping(later)
        q[:, 1] = 1e-3 * (np.arange(len(T)) // every)
        refused(r"v2 has \d+ spikes", q=q, v=v)


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
        return "; ".join(each.sentence for each in log_faults(Recording(T, q[:, order], v[:, order])))

    message = f"v{order[0] + 1} has 25 spikes"
    assert message in doubted(beside=False)
    assert not doubted(beside=True)
    assert message in doubted(beside=True, late=4)  # one of them follows no step


@pytest.mark.parametrize("away", ["against the step", "towards zero", "up", "by chance"])
def test_spikes_of_a_thinned_log_that_oppose_the_last_step_answer_it(rng, away):
    q, v = Q.copy(), V - np.array([0.0, 7.0])
    step = np.where(rng.random(len(T)) < 0.9, 1.0, -1.0) * np.sign(v[:, 1])  # mostly as the current, by friction
    step[rng.random(len(T)) < 0.5] = 0.0
    rows = rng.choice(np.flatnonzero(step[50:-50]), 140, replace=False) + 50
    step[330:334] = 0.0  # one of them follows no step
    rows = np.append(rows, 333)
    q[:, 1] = 1e-3 * np.cumsum(step)
    chance = rng.choice([-1.0, 1.0], len(rows))
    signs = {"against the step": -step[rows], "towards zero": -np.sign(v[rows, 1]), "up": 1.0, "by chance": chance}
    v[rows, 1] += 4.0 * np.ptp(V[:, 1]) * np.where(signs[away] == 0.0, 1.0, signs[away])
    if away == "against the step":
        passes(q=q, v=v)
    else:
        refused(r"v2 has 1\d\d spikes", q=q, v=v)
