"""Repairs: a damaged log comes back as it was, a sound one as the same object."""

from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import at, without

from ident.diagnosis.channels import values
from ident.diagnosis.diagnosis import Severity
from ident.diagnosis.samples import SPOILING, repaired, restored, split_at_gaps, turned_back, unwrapped
from ident.model.arm import Arm
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording

TURN = 2.0 * np.pi
OPTIONS = ObserveOptions()


@pytest.fixture(scope="module")
def arm(ur) -> Arm:
    return replace(ur.arm, lower=np.full(6, -3.0), upper=np.array([3.0, 3.0, 3.0, 7.0, 3.0, np.inf]))


def test_a_sound_log_comes_back_as_the_same_object(ur_log, arm):
    (whole,), done = repaired(ur_log, arm, OPTIONS)
    assert whole is ur_log
    assert done == ()


def test_wrapped_angles_are_unwrapped(ur_log):
    wide = Recording(ur_log.t, ur_log.q * [1, 1, 1, 5, 1, 9], ur_log.v, "wide")
    around = (wide.q + np.pi) % TURN - np.pi
    around[:, [0, 1, 2, 4]] = wide.q[:, [0, 1, 2, 4]]
    jumps = int((np.abs(np.diff(around, axis=0)) > 5.0).sum())
    assert jumps > 2
    found, said = unwrapped(Recording(wide.t, around, wide.v, "wide"))
    turns = (found.q - wide.q) / TURN
    np.testing.assert_allclose(turns, np.broadcast_to(np.rint(turns[0]), turns.shape), atol=1e-12)  # whole, constant
    assert (said.severity, said.joints, said.logs, said.value) == (Severity.WEAK, (3, 5), ("wide",), jumps)
    assert f"q4, q6 jump by 2 pi {jumps} times" in said.sentence


def test_an_angle_that_dithers_where_it_is_wrapped_is_unwrapped(ur_log):
    q = ur_log.q.copy()
    q[:, 1] = np.pi + 0.01 * np.sin(40.0 * ur_log.t) + 1e-3 * np.random.default_rng(5).normal(size=len(q))
    found, said = unwrapped(replace(ur_log, q=np.where(at(1, 1.0, 0.0) > 0.0, (q + np.pi) % TURN - np.pi, q)))
    np.testing.assert_allclose(np.diff(found.q[:, 1]), np.diff(q[:, 1]), atol=1e-12)
    assert said.value > 100
    assert values(found, OPTIONS)[0].severity is Severity.GOOD


def test_a_jump_that_is_no_turn_and_a_joint_that_turns_once_in_a_gap_stay(ur_log):
    turned = replace(ur_log, q=ur_log.q + np.outer(ur_log.t > 8.0, at(5, TURN, 0.0)))
    log = without(turned, range(1000, 1030))
    assert unwrapped(log) == (log, None)
    log = replace(ur_log, q=ur_log.q + np.outer(np.arange(2500) >= 800, at(1, 5.1, 0.0)))
    assert unwrapped(log) == (log, None)
    assert values(log, OPTIONS)[0].severity is Severity.WRONG
    mask = SPOILING["values"](log)
    np.testing.assert_array_equal(np.flatnonzero(mask.all(axis=1)), [799, 800])
    assert mask.sum() == 12


def test_whole_turns_are_turned_back_and_nothing_else(ur_log, arm):
    far = Recording(ur_log.t, ur_log.q + TURN * np.array([2, 0, -1, 1, 0, 3]), ur_log.v, "far")
    found, said = turned_back(far, arm)
    expected = ur_log.q + TURN * np.array([0, 0, 0, 1, 0, 3])  # joint 4 turns up to 7 rad, joint 6 has no limits
    np.testing.assert_allclose(found.q, expected, atol=1e-14)  # rounding
    assert said.joints == (0, 2)
    assert said.sentence.endswith("limits: q1 by -2, q3 by +1")
    half = replace(ur_log, q=ur_log.q + at(0, 2.9, 0.0))
    assert turned_back(half, arm) == (half, None)  # no whole turn puts it there
    slide = replace(arm, revolute=np.array([False, True, True, True, True, True]))
    assert turned_back(replace(ur_log, q=far.q * [1, 0.1, 0.1, 1, 1, 1]), slide)[1] is None


def test_a_log_of_which_no_part_is_long_enough_stays(ur_log):
    short = Recording(ur_log.t[:500], ur_log.q[:500], ur_log.v[:500])
    log = without(short, range(240, 270))
    assert split_at_gaps(log) == ((log,), None)
    faster = ObserveOptions(cutoff_hz=30.0, decimation_cutoff_hz=20.0, rows_per_second=50.0)
    assert len(split_at_gaps(log, faster)[0]) == 2


def hidden(log: Recording, lost: list[int]) -> Recording:
    """The log without some rows, whose intervals are not logged either."""
    t = np.cumsum(np.concatenate((log.t[:1], np.delete(np.diff(log.t), [row - 1 for row in lost]))))
    return replace(without(log, lost), t=t)


def test_lost_samples_beside_gaps_that_the_clock_shows_get_their_time_back(ur_log):
    seen, lost = without(ur_log, [640, 641, 1300]), [411, 902, 903]
    found, _ = restored(hidden(seen, lost))
    np.testing.assert_allclose(found.t, np.delete(seen.t, lost), atol=1e-12)
    both = without(ur_log, range(700, 704))  # of which the clock shows two
    t = np.where(both.t > both.t[699], both.t - 0.016, both.t)
    found, said = restored(Recording(t, both.q, both.v))
    np.testing.assert_allclose(found.t, both.t, atol=1e-12)
    assert said.value == 2.0


def test_time_stamps_stay_where_the_number_lost_is_not_plain_or_most_lost_samples_would_not_show(ur_log):
    late = ur_log.t + np.where(np.arange(2500) >= 1200, 0.55 * 0.008, 0.0)  # an instant between two
    q = np.column_stack([np.interp(late, ur_log.t, each) for each in ur_log.q.T])
    log = Recording(ur_log.t[:2400], q[:2400], ur_log.v[:2400])
    assert restored(log) == (log, None)
    long = without(ur_log, range(900, 912), even=True)
    assert restored(long) == (long, None)
    rows = np.arange(2500)
    rows[[600, 601, 1500]] = [599, 599, 1499]
    again = Recording(ur_log.t, ur_log.q[rows], ur_log.v[rows])
    assert restored(again) == (again, None)  # nothing was lost: old rows were written again
    lost = np.linspace(200, 2300, 40).astype(int)
    for step, same in ((2e-4, False), (6e-4, True)):  # of the latter about half would show
        coarse = Recording(ur_log.t, np.round(ur_log.q / step) * step, ur_log.v)
        log = without(coarse, lost, even=True)
        assert (restored(log)[0] is log) == same


def test_everything_at_once_is_repaired(ur_log, arm):
    q = ur_log.q + TURN * np.array([2, 0, 0, 0, 0, 0])
    q[1100:, 2] += TURN
    log = without(Recording(ur_log.t, q, ur_log.v, "x"), range(1500, 1560))
    parts, done = repaired(hidden(log, [300, 301, 1900]), arm, OPTIONS)
    assert [each.name for each in done] == ["wrapped", "lost samples", "whole turns", "missing samples"]
    assert (done[1].severity, done[1].value, done[3].value) == (Severity.WEAK, 3.0, 63.0)  # of the gap as well
    assert [each.name for each in parts] == ["x, part 1", "x, part 2"]
    assert done[1].sentence.startswith("3 samples are lost without a gap in the time stamps, first after row 300, 2.39")
    whole = np.setdiff1d(np.arange(2500), [*range(1500, 1560), 300, 301, 1960])
    for x in ("t", "q", "v"):
        found = np.concatenate([getattr(each, x) for each in parts])
        np.testing.assert_allclose(found, getattr(ur_log, x)[whole], atol=1e-12)
