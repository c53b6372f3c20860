"""What an arm of given kinematics leaves of the currents, against a plain second way."""

from dataclasses import replace

import numpy as np
import pytest
from ident.explanation import explanations, unknowns_of
from ident.instants import instants
from ident.readings import readings
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, known_logs, ur_like

from ident import explanation
from ident.observation import ObserveOptions
from ident.recording import Recording, resampled
from ident.regressor import regressor
from ident.signals import smooth_motion

OPTIONS = ObserveOptions()


@pytest.fixture(scope="module")
def logs() -> tuple[Recording, Recording]:
    return known_logs(ur_like(), BRICK, UR_GAIN, np.random.default_rng(11), middle=UR_MIDDLE)


@pytest.mark.parametrize("words", ["the log as it is", "q3 negated plus 90 degrees", "joints 2 and 5 exchanged"])
def test_what_is_left_is_what_least_squares_with_every_column_leaves(ur, logs, words):
    family = next(f for f in readings(ur.arm) if any(r.words == words for r in f))
    bare, loaded = (instants(log, 150, OPTIONS) for log in logs)
    found = next(e for e in explanations(ur.arm, unknowns_of(ur), (bare, loaded), family) if e.reading.words == words)
    order, sign, zero = {
        "the log as it is": ([0, 1, 2, 3, 4, 5], 1.0, 0.0),
        "q3 negated plus 90 degrees": ([0, 1, 2, 3, 4, 5], np.array([1, 1, -1, 1, 1, 1]), np.eye(6)[2] * np.pi / 2),
        "joints 2 and 5 exchanged": ([0, 4, 2, 3, 1, 5], 1.0, 0.0),
    }[words]
    parts = [
        regressor(ur.arm, sign * at.q[:, order] + zero, sign * at.dq[:, order], sign * at.ddq[:, order])
        for at in (bare, loaded)
    ]
    for joint in range(6):
        kept = [at.moving[:, order[joint]] for at in (bare, loaded)]
        arm = np.vstack([part[mask, joint] for part, mask in zip(parts, kept, strict=True)])
        friction = 14 * joint + np.array([11, 12, 13])  # Fv, Fc and offset of this joint
        load = arm[:, [*ur.payload_columns, *friction]]
        load[: kept[0].sum()] = 0.0
        W = np.hstack((arm, load))  # every standard column, dependent ones included
        V = np.concatenate([at.v[mask, order[joint]] for at, mask in zip((bare, loaded), kept, strict=True)])
        size = np.linalg.norm(W, axis=0)
        felt = size > 1e-9 * size.max()  # less is rounding
        W = W[:, felt] / size[felt]
        U, s, _ = np.linalg.svd(W, full_matrices=False)
        U = U[:, s > 1e-9 * s[0]]  # exact dependence leaves 1e-15, the weakest combination 1e-5
        residual = V - U @ (U.T @ V)
        assert found.freedom[joint] == len(V) - U.shape[1]
        expected = np.linalg.norm(residual) / np.sqrt(found.freedom[joint]) / np.sqrt(np.mean(V**2))
        np.testing.assert_allclose(found.left[joint], expected, rtol=1e-6)  # two factorisations of condition 1e5


def test_gravity_and_lengths_of_a_reading_are_those_of_the_arm_it_describes(ur, logs):
    bare, loaded = (instants(log, 120, OPTIONS) for log in logs)
    families = {f[0].words: f for f in readings(ur.arm)}
    as_is = next(readings(ur.arm))[:1]
    for words, other in (
        ("every length times 0.8", replace(ur.arm, translation=0.8 * ur.arm.translation)),
        ("gravity along (0, 0, 1) of the base", replace(ur.arm, gravity=-ur.arm.gravity)),
    ):
        left = explanations(ur.arm, unknowns_of(ur), (bare, loaded), families[words])[0].left
        plain = replace(as_is[0], gravity=other.gravity)
        direct = explanations(other, unknowns_of(ur), (bare, loaded), [plain])[0].left
        np.testing.assert_allclose(left, direct, rtol=1e-9)  # the same sums
        assert np.abs(left / explanations(ur.arm, unknowns_of(ur), (bare, loaded), as_is)[0].left - 1.0).max() > 0.02


def test_too_few_instants_leave_infinity_not_a_fit(ur, logs):
    bare, loaded = (instants(log, 15, OPTIONS) for log in logs)
    found = explanations(ur.arm, unknowns_of(ur), (bare, loaded), next(readings(ur.arm)))[0]
    few = found.freedom <= 0
    assert few[0]
    assert not few[5]
    np.testing.assert_array_equal(np.isinf(found.left), few)


def test_as_many_instants_as_unknowns_are_too_few(rng):
    W, V = rng.normal(size=(7, 7)), rng.normal(size=(7, 3))
    np.testing.assert_array_equal(explanation.shares_left(W, V), [np.inf] * 3)
    assert np.isfinite(explanation.shares_left(W[:, :6], V)).all()


def test_what_is_left_does_not_depend_on_the_unit_of_a_current(ur, logs):
    as_is = next(readings(ur.arm))[:1]
    scaled = [Recording(log.t, log.q, log.v * [3.0, -0.2, 7.0, 0.01, 5.0, 40.0], log.name) for log in logs]
    left = [
        explanations(ur.arm, unknowns_of(ur), [instants(log, 120, OPTIONS) for log in each], as_is)[0].left
        for each in (logs, scaled)
    ]
    np.testing.assert_allclose(left[0], left[1], rtol=1e-9)  # rounding of the factorisation


def test_instants_are_of_the_filtered_motion_and_as_many_as_asked_for_at_most(logs):
    log = logs[0]
    at = instants(log, 150, OPTIONS)
    # 2 samples and 2 periods of 10 Hz at 125 Hz are 27 at either end; 2500 - 54 in at most 150 are every 17th
    q, dq, ddq = smooth_motion(log.q, log.period, OPTIONS.cutoff_hz)
    v = smooth_motion(log.v, log.period, OPTIONS.decimation_cutoff_hz)[0]
    chosen = slice(27, 2500 - 27, 17)
    assert len(at.q) <= 150
    for found, expected in ((at.q, q), (at.dq, dq), (at.ddq, ddq), (at.v, v)):
        np.testing.assert_array_equal(found, expected[chosen])
    slow = np.abs(dq) <= 0.2 * np.sqrt(np.mean(dq[27:-27] ** 2, axis=0))
    np.testing.assert_array_equal(at.moving, ~slow[chosen])


def test_instants_are_no_closer_than_rows(logs):
    assert len(instants(logs[0], 10_000, OPTIONS).q) == -(-(2500 - 54) // 6)  # 20 a second of 125


def test_a_current_that_acts_late_is_looked_at_late(logs):
    late = instants(logs[0], 150, replace(OPTIONS, current_delay=2 * logs[0].period))
    shifted = Recording(logs[0].t, logs[0].q, np.vstack((logs[0].v[[0, 0]], logs[0].v[:-2])))
    np.testing.assert_allclose(late.v, instants(shifted, 150, OPTIONS).v, rtol=1e-9, atol=1e-12)  # rounding


def test_a_jittered_clock_is_made_even_first(logs, rng):
    log = logs[0]
    t = log.t + rng.uniform(-0.002, 0.002, len(log.t))
    uneven = Recording(t, log.q, log.v)
    even = instants(resampled(uneven), 150, OPTIONS)
    np.testing.assert_array_equal(instants(uneven, 150, OPTIONS).q, even.q)
    careless = Recording(np.linspace(t[0], t[-1], len(t)), log.q, log.v)  # the samples at times that are not theirs
    assert np.abs(instants(careless, 150, OPTIONS).q - even.q).max() > 1e-4
