"""Currents that come late or early: how late, how sure, and what a check says of it."""

from dataclasses import replace

import numpy as np
import pytest
from ident.checks.lateness import BENT, Lateness, delay_remark, lateness
from ident.checks.remark import Grade
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, known_logs, ur_like

from ident.observation import ObserveOptions, observe
from ident.recording import Recording

OPTIONS = ObserveOptions()


@pytest.mark.parametrize("rows", [2, -3, 4])
def test_currents_that_come_late_or_early_are_timed(ur, ur_log, rows):
    late = Recording(ur_log.t[5:-5], ur_log.q[5:-5], np.roll(ur_log.v, rows, axis=0)[5:-5])
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


def test_a_delay_beyond_the_search_has_no_deviation(ur, ur_log):
    late = Recording(ur_log.t[8:], ur_log.q[8:], ur_log.v[:-8])  # 64 ms
    found = lateness(late, observe(late, ur, OPTIONS), OPTIONS)
    assert found is not None
    assert found.std is None
    assert found.value > 0.045
    assert delay_remark(late, observe(late, ur, OPTIONS), OPTIONS).grade is Grade.WRONG


def test_a_delay_that_cannot_be_seen_is_said_to_be(ur, ur_log):
    q = ur_log.q.copy()
    q[:, 0] = q[900, 0] + np.clip((ur_log.t - 7.0) / 1.5, 0.0, 1.0) ** 3  # no more than 30 rows of joint 1
    resting = Recording(ur_log.t, q, ur_log.v)
    remark = delay_remark(resting, observe(resting, ur, OPTIONS), OPTIONS)
    assert (remark.grade, remark.seen) == (Grade.WEAK, "too few rows show it")


def test_a_delay_that_is_stated_is_none_beyond_it(ur, ur_log):
    late = Recording(ur_log.t[5:-5], ur_log.q[5:-5], np.roll(ur_log.v, -3, axis=0)[5:-5])  # stamped three samples early
    stated = replace(OPTIONS, current_delay=0.024)
    found = lateness(late, observe(late, ur, stated), stated)
    unstated = lateness(late, observe(late, ur, OPTIONS), OPTIONS)
    assert found is not None
    assert unstated is not None
    # the same samples, but three that are left out at the beginning
    np.testing.assert_allclose(found.value - unstated.value, 0.024, atol=1e-3)
    assert found.std is not None
    np.testing.assert_allclose(found.value, 0.0, atol=3.0 * found.std)  # missed by 3 in 1000


def test_a_delay_and_its_deviation_are_those_of_the_peak_of_the_likelihood(ur, ur_log, monkeypatch):
    def peaked(observed, behind, shifted):
        delay = ur_log.period * (np.arange(len(shifted)) - len(shifted) // 2)
        return 17.0 - 0.5 * ((delay - 0.0112) / 0.005) ** 2  # of a normal variable

    monkeypatch.setattr("ident.checks.lateness._likelihood", peaked)
    found = lateness(ur_log, observe(ur_log, ur, OPTIONS), OPTIONS)
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
def test_a_delay_is_told_where_it_is_beyond_two_deviations_and_sure(ur_log, monkeypatch, value, std, evidence, grade):
    monkeypatch.setattr("ident.checks.lateness.lateness", lambda *_: Lateness(value, std, evidence))
    found = delay_remark(ur_log, None, OPTIONS)
    assert found.grade is grade
    assert (found.advice is None) == (grade is Grade.GOOD)
    assert found.seen.startswith(f"{1e3 * value:.2g} ms" + ("" if std is None else ", 2 sigma 8"))
    if grade is not Grade.GOOD:
        assert found.seen.endswith(f"({'later' if value > 0 else 'earlier'} than the positions)")
