"""What a column holds: a current that is clipped, a motion in its place, another column's numbers."""

from dataclasses import replace

import numpy as np
import pytest

from ident.diagnosis.channels import clipping, columns
from ident.diagnosis.diagnosis import Severity
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording

OPTIONS = ObserveOptions()


@pytest.mark.parametrize(("row", "grade"), [(4, Severity.WRONG), (3, Severity.GOOD)])
def test_samples_in_a_row_at_an_extreme_value_are_clipped(row, grade):
    v = np.array([1.0, *[5.0] * row, 2.0, 5.0, 5.0, 3.0])[:, None]  # three in a row are a peak
    t = 0.004 * np.arange(len(v))
    (found,) = clipping(Recording(t, t[:, None] ** 2, v), OPTIONS)
    assert found.severity is grade


def test_a_few_samples_at_the_extreme_of_a_long_log_are_a_peak():
    for count, grade in ((7_000, Severity.WRONG), (9_000, Severity.GOOD)):  # one in 2000 are 3.5 and 4.5
        t = 0.004 * np.arange(count)
        v = np.sin(7.3 * t)[:, None]
        v[2_000:2_004] = 1.7
        (found,) = clipping(Recording(t, np.sin(0.9 * t)[:, None], v), OPTIONS)
        assert found.severity is grade


@pytest.mark.parametrize(("sign", "word"), [(1.0, "largest"), (-1.0, "smallest")])
def test_a_clipped_current_is_named_with_its_limit(ur_log, sign, word):
    v = ur_log.v.copy()
    limit = 0.7 * float((sign * v[:, 3]).max())
    v[:, 3] = sign * np.minimum(sign * v[:, 3], limit)
    (found,) = clipping(Recording(ur_log.t, ur_log.q, v), OPTIONS)
    assert (found.severity, found.joints) == (Severity.WRONG, (3,))
    assert f"v4 is clipped at its {word} value {sign * limit:.4g}: " in found.sentence
    first = ur_log.t[np.flatnonzero(sign * ur_log.v[:, 3] >= limit)[0]]
    assert found.sentence.endswith(f", first at {first:.6g} s")


def test_a_coarse_current_is_not_clipped(ur_log):
    coarse = np.round(ur_log.v / ur_log.v.std(axis=0) * 3.0)
    assert {each.severity for each in clipping(Recording(ur_log.t, ur_log.q, coarse), OPTIONS)} == {Severity.GOOD}


def test_currents_without_a_sign_are_named_where_all_joints_move_to_and_fro(ur_log):
    def named(q: np.ndarray, v: np.ndarray) -> list[tuple[int, ...]]:
        found = columns(Recording(ur_log.t, q, v), OPTIONS)
        return [each.joints for each in found if "never negative" in each.sentence]

    sized = np.abs(ur_log.v)
    assert named(ur_log.q, sized) == [(0, 1, 2, 3, 4, 5)]
    held = np.column_stack((sized[:, :5], ur_log.v[:, 5]))  # gravity may hold all others one way
    assert named(ur_log.q, held) == []
    one_way = np.column_stack((ur_log.q[:, :5], 0.4 * ur_log.t))
    assert named(one_way, sized) == []
    assert named(ur_log.q, ur_log.v) == []


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
    assert named(side * np.where(ur_log.t < 2.0, 0.01, 16.0 + course + noise)) == []  # off at first
    assert named(side * np.where(ur_log.t < 2.0, 0.0, 16.0 + course + noise)) == []


@pytest.mark.parametrize("what", ["position", "speed", "acceleration"])
def test_motion_in_place_of_a_current_is_named(ur_log, what):
    rate = np.gradient(ur_log.q[:, 2], ur_log.t)
    x = {"position": ur_log.q[:, 2], "speed": rate, "acceleration": np.gradient(rate, ur_log.t)}[what]
    v = ur_log.v.copy()
    v[:, 2] = 4.0 - 7.0 * x
    (found,) = columns(Recording(ur_log.t, ur_log.q, v), OPTIONS)
    severity = Severity.WEAK if what == "acceleration" else Severity.WRONG  # that may be an inertia's current
    assert (found.severity, found.joints) == (severity, (2,))
    assert f"v3 is the {what} of joint 3" in found.sentence
    assert str(found.advice).startswith("log the current")


def test_a_current_that_is_nearly_all_viscous_friction_is_no_speed(ur_log):
    rate, v = np.gradient(ur_log.q[:, 2], ur_log.t), ur_log.v.copy()
    v[:, 2] = 7.0 * rate + 0.05 * np.std(7.0 * rate) * np.sign(rate)  # dry friction leaves 3 %
    (found,) = columns(Recording(ur_log.t, ur_log.q, v), OPTIONS)
    assert found.sentence == "no column is a copy of another"


@pytest.mark.parametrize("kind", ["q", "v"])
def test_a_column_that_is_there_twice_is_named(ur_log, kind):
    x = getattr(ur_log, kind).copy()
    x[:, 4] = 2.0 - 3.0 * x[:, 1]
    (found,) = columns(replace(ur_log, **{kind: x}), OPTIONS)
    assert f"{kind}5 is a copy of {kind}2" in found.sentence
    assert found.severity is Severity.WRONG
    assert str(found.advice).startswith({"q": "log the position of each joint", "v": "log the current"}[kind])
    x[:, 4] += 0.03 * np.std(x[:, 4]) * np.sin(5.3 * ur_log.t)  # two joints that move alike
    (found,) = columns(replace(ur_log, **{kind: x}), OPTIONS)
    assert found.severity is Severity.GOOD
