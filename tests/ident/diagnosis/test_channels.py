"""Content of columns: clipped currents, copies, motion in place of a current, columns that stop."""

from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np
import pytest
from consistency_logs import at
from scipy.interpolate import make_interp_spline

from ident.diagnosis.channels import columns, continuous, unmeasured
from ident.diagnosis.diagnosis import Severity
from ident.diagnosis.samples import SPOILING
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording

OPTIONS = ObserveOptions()
clipping, frozen, stopped = partial(unmeasured, "clipping"), partial(unmeasured, "frozen"), SPOILING["frozen"]


@pytest.mark.parametrize(("row", "grade"), [(4, Severity.WRONG), (3, Severity.GOOD)])
def test_samples_in_a_row_at_an_extreme_value_are_clipped_and_a_few_of_a_long_log_are_a_peak(row, grade):
    v = np.array([1.0, *[5.0] * row, 2.0, 5.0, 5.0, 3.0])[:, None]  # three in a row are a peak
    t = 0.004 * np.arange(9_000)
    (found,) = clipping(Recording(t[: len(v)], t[: len(v), None] ** 2, v), OPTIONS)
    assert found.severity is grade
    count = 7_000 if row == 4 else 9_000  # one in 2000 are 3.5 and 4.5
    v = np.sin(7.3 * t[:count])[:, None]
    v[2_000:2_004] = 1.7
    (found,) = clipping(Recording(t[:count], np.sin(0.9 * t[:count])[:, None], v), OPTIONS)
    assert found.severity is grade


@pytest.mark.parametrize(("sign", "word"), [(1.0, "largest"), (-1.0, "smallest")])
def test_a_clipped_current_is_named_with_its_limit(ur_log, sign, word):
    size = sign * ur_log.v
    limit = 0.7 * float(size[:, 3].max())
    (found,) = clipping(replace(ur_log, v=sign * np.minimum(size, at(3, limit, np.inf))), OPTIONS)
    assert (found.severity, found.joints) == (Severity.WRONG, (3,))
    assert f"v4 is clipped at its {word} value {sign * limit:.4g}: " in found.sentence
    assert found.sentence.endswith(f", first at {ur_log.t[np.flatnonzero(size[:, 3] >= limit)[0]]:.6g} s")


def test_spikes_spoil_their_own_current_and_clipping_its_own(ur_log):
    v = ur_log.v.copy()
    v[[433, 1200], 2] += 3e4
    v[:, 4] = np.maximum(v[:, 4], 0.6 * v[:, 4].min())
    log = Recording(ur_log.t, ur_log.q, v)
    spikes, clipped = SPOILING["values"](log), SPOILING["clipping"](log)
    np.testing.assert_array_equal(np.argwhere(spikes), [[433, 2], [1200, 2]])
    np.testing.assert_array_equal(clipped[:, 4], v[:, 4] == v[:, 4].min())
    assert not np.delete(clipped, 4, axis=1).any()
    coarse = np.round(ur_log.v / ur_log.v.std(axis=0) * 3.0)
    assert {each.severity for each in clipping(Recording(ur_log.t, ur_log.q, coarse), OPTIONS)} == {Severity.GOOD}


def test_currents_without_a_sign_are_named_where_all_joints_move_to_and_fro(ur_log):
    def named(q: np.ndarray, v: np.ndarray) -> list[tuple[int, ...]]:
        found = columns(Recording(ur_log.t, q, v), OPTIONS)
        return [each.joints for each in found if "never negative" in each.sentence]

    sized = np.abs(ur_log.v)
    assert named(ur_log.q, sized) == [(0, 1, 2, 3, 4, 5)]
    held = np.column_stack((sized[:, :5], ur_log.v[:, 5]))  # gravity may hold all others one way
    one_way = np.column_stack((ur_log.q[:, :5], 0.4 * ur_log.t))
    assert named(ur_log.q, held) == named(one_way, sized) == named(ur_log.q, ur_log.v) == []
    assert named(ur_log.q[:, :3], sized[:, :3]) == [(0, 1, 2)]
    assert named(ur_log.q[:, :2], sized[:, :2]) == []  # gravity may hold both


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_current_that_noise_never_takes_beyond_zero_has_no_sign(ur_log, rng, side):
    def named(v: np.ndarray) -> list[tuple[int, ...]]:
        found = columns(Recording(ur_log.t, ur_log.q, np.column_stack((ur_log.v[:, :5], v))), OPTIONS)
        return [each.joints for each in found if "never changes its sign" in each.sentence]

    noise = rng.normal(size=len(ur_log.t))
    course = 9.0 * np.sin(2.3 * ur_log.t)
    assert named(side * np.abs(course + noise)) == [(5,)]
    assert named(course + noise) == []
    assert named(side * (9.0 + np.abs(course) + noise)) == []  # held against gravity
    for off in (0.01, 0.0):
        assert named(side * np.where(ur_log.t < 2.0, off, 16.0 + course + noise)) == []  # off at first


@pytest.mark.parametrize(("what", "finer"), [("position", 1), ("speed", 6), ("acceleration", 1), ("acceleration", 6)])
def test_motion_in_place_of_a_current_is_named(ur_log, what, finer):
    t = np.linspace(ur_log.t[0], ur_log.t[-1], finer * (len(ur_log.t) - 1) + 1)
    q, v = (make_interp_spline(ur_log.t, x)(t) for x in (ur_log.q, ur_log.v))
    rate = np.gradient(q[:, 2], t)
    x = {"position": q[:, 2], "speed": rate, "acceleration": np.gradient(rate, t)}[what]
    v[:, 2] = 4.0 - 7.0 * x
    (found,) = columns(Recording(t, q, v), OPTIONS)
    severity = Severity.WEAK if what == "acceleration" else Severity.WRONG  # that may be an inertia's current
    assert (found.severity, found.joints) == (severity, (2,))
    assert f"v3 is the {what} of joint 3" in found.sentence
    v[:, 2] = 7.0 * rate + 0.05 * np.std(7.0 * rate) * np.sign(rate)  # viscous friction, of which dry one leaves 3 %
    (found,) = columns(Recording(t, q, v), OPTIONS)
    assert found.sentence == "no column is a copy of another"


@pytest.mark.parametrize("kind", ["q", "v"])
def test_a_column_that_is_there_twice_is_named(ur_log, kind):
    x = getattr(ur_log, kind).copy()
    x[:, 4] = 2.0 - 3.0 * x[:, 1]
    (found,) = columns(replace(ur_log, **{kind: x}), OPTIONS)
    assert f"{kind}5 is a copy of {kind}2" in found.sentence
    assert found.severity is Severity.WRONG
    x[:, 4] += 0.03 * np.std(x[:, 4]) * np.sin(5.3 * ur_log.t)  # two joints that move alike
    (found,) = columns(replace(ur_log, **{kind: x}), OPTIONS)
    assert found.severity is Severity.GOOD


def stopping(log: Recording, kind: str, j: int, rows: slice) -> Recording:
    x = getattr(log, kind).copy()
    x[rows, j] = x[rows.start, j]
    return replace(log, **{kind: x})


def alarms(log: Recording) -> list[str]:
    return [each.sentence for each in frozen(log) if each.severity is not Severity.GOOD]


OF_TEN = slice(450, 460)


def test_a_column_that_stops_no_longer_than_by_chance_is_not_frozen(ur_log):
    assert alarms(stopping(ur_log, "v", 2, OF_TEN)) == alarms(stopping(ur_log, "q", 2, slice(450, 459))) == []


@pytest.mark.parametrize(
    ("kind", "rows"), [*product("qv", [slice(700, 783), slice(0, 61), slice(1600, 2500)]), ("q", OF_TEN)]
)
def test_a_column_that_stops_and_jumps_is_frozen_and_spoils_its_joint_or_of_positions_every_one(ur_log, kind, rows):
    log, count = stopping(ur_log, kind, 2, rows), rows.stop - rows.start
    (found,) = frozen(log)
    assert (found.severity, found.joints) == (Severity.WRONG, (2,))
    assert found.sentence.startswith(f"{kind}3 stays constant for {count} samples")
    np.testing.assert_allclose(found.value, 100.0 * count / 2500, rtol=1e-12)  # rounding
    expected = np.zeros((2500, 6), dtype=bool)
    expected[rows, slice(None) if kind == "q" else 2] = True
    np.testing.assert_array_equal(stopped(log), expected)


@pytest.mark.parametrize("moving", [80, 6])
def test_a_current_that_stays_through_a_rest_is_frozen_if_its_joint_moves_for_longer_than_chance_before(ur_log, moving):
    q = ur_log.q.copy()
    q[1000:1400, 4] = q[1000, 4]  # it rests
    q[1400:, 4] += q[999, 4] - q[1399, 4]
    found = frozen(stopping(replace(ur_log, q=q), "v", 4, slice(1000 - moving, 1400)))
    told = [each.sentence.split(" while")[0] for each in found if each.sentence.startswith("v5")]
    assert told == ([f"v5 stays constant for {400 + moving} samples"] if moving == 80 else [])


def test_the_whole_arm_at_rest_is_not_frozen(ur_log):
    started = np.clip((ur_log.t - 3.0) / 2.0, 0.0, 1.0) ** 3
    q = ur_log.q[400] + started[:, None] * (ur_log.q - ur_log.q[400])
    v = np.where(ur_log.t[:, None] < 3.0, ur_log.v[400], ur_log.v)  # brakes hold it
    assert alarms(Recording(ur_log.t, q, v)) == alarms(Recording(ur_log.t, q[::-1], v[::-1])) == []
    q = ur_log.q.copy()
    q[800:860] = q[800]  # all positions repeat: samples do, no column is frozen
    assert alarms(replace(ur_log, q=q)) == []


@pytest.mark.parametrize("middle", [9.0, 18.5])  # the second until the end
def test_a_joint_that_rests_while_others_move_is_not_frozen(ur_log, middle):
    """It slows down within half a second and starts as slowly, with an encoder and without."""
    t, q, v = ur_log.t, ur_log.q.copy(), ur_log.v.copy()
    rest = np.clip((np.abs(t - middle) - 2.0) / 0.5, 0.0, 1.0)  # for 2 s to either side
    speed = np.gradient(q[:, 1], t) * rest**2 * (3.0 - 2.0 * rest)
    q[:, 1] = q[0, 1] + np.cumsum(speed) * 0.008
    v[np.abs(t - middle) < 2.0, 1] = 0.37
    assert (np.diff(q[np.abs(t - middle) < 1.4, 1]) == 0.0).all()
    assert alarms(Recording(t, q, v)) == alarms(Recording(t, np.round(q / 7e-4) * 7e-4, v)) == []


def test_columns_that_are_coarse_clipped_or_logged_more_slowly_are_not_frozen(ur_log):
    t, q, v = ur_log.t, ur_log.q, ur_log.v
    for every in (2, 5, 13):
        assert alarms(Recording(t, q, np.repeat(v[::every], every, axis=0)[:2500])) == []
        for j in range(6):
            held = q[:2483].copy()  # 191 times 13: it ends before a step
            held[:, j] = np.repeat(held[::every, j], every)[:2483]
            assert alarms(Recording(t[:2483], held, v[:2483])) == []
    for step in (3e-4, 4e-3, 2e-2):
        coarse = np.round(q / step) * step
        assert alarms(Recording(t, coarse, v)) == []
        assert alarms(Recording(t, np.where(np.arange(6) == 2, coarse, q), v)) == []
    smooth = v.copy()
    smooth[2:-2] = (v[:-4] + v[1:-3] + v[2:-2] + v[3:-1] + v[4:]) / 5.0
    for steps in (3.0, 11.0):
        size = v.std(axis=0) / steps
        for each in (v, smooth):
            assert alarms(Recording(t, q, np.round(each / size) * size)) == []
    assert alarms(Recording(t, q, np.minimum(v, at(1, 0.6 * v[:, 1].max(), np.inf)))) == []


def test_a_coarse_current_that_vibrates_for_a_while_is_not_frozen_where_it_does_not(ur_log):
    v = ur_log.v.copy()
    step = 0.25 * v[:, 1].std()
    v[:, 1] = np.round((v[:, 1] + 3.0 * step * np.sin(977.0 * ur_log.t)) / step) * step
    v[1900:2100, 1] = v[1899, 1]
    v[2100, 1] = v[1899, 1] + step
    assert alarms(Recording(ur_log.t, ur_log.q, v)) == []
    v[2100, 1] = v[1899, 1] + 3.0 * step
    assert len(alarms(Recording(ur_log.t, ur_log.q, v))) == 1


def test_counts_of_an_encoder_are_not_unwrapped_where_they_step_by_six(rng):
    t = 0.004 * np.arange(3000)
    angle = np.column_stack([np.sin(2.0 * t), 1.3 * np.cos(1.4 * t)])
    counts = Recording(t, np.round(1500.0 * angle), rng.normal(size=(3000, 2)), "log")
    assert (np.abs(np.diff(counts.q, axis=0)) == 6.0).any()
    assert continuous(counts) is counts
