"""What a payload would add to bare motions, against motions that carry it."""

from dataclasses import replace

import numpy as np
import pytest
from exact import GAIN, TRUSTING, exact_observation, exact_problem, lopsided
from weighings import known

from ident.estimation.estimators.nls import AllJointsOptions, all_joints_gains
from ident.estimation.problem import ObservedMotion, Problem
from ident.parameters.arm import arm_in_SI, as_if_loaded, forecast_gains, gain_ratios
from ident.support.errors import NotIdentifiable

OPTIONS = AllJointsOptions(friction_per_motion=False)
NOISE, STD = 0.02, (0.03,) * 6


@pytest.fixture
def bare(structure, chi, rng) -> Problem:
    return exact_problem(structure, [(chi, None, None)], GAIN, rng, noise=NOISE, options=TRUSTING)


def test_rows_as_if_loaded_are_those_of_the_loaded_motion(structure, payload, chi):
    bare, loaded = (
        exact_observation(structure, chi, carried, GAIN, np.random.default_rng(2), noise=0.0, rows=40)
        for carried in (np.zeros(10), payload.known_part().chi)
    )
    rows = as_if_loaded(ObservedMotion(bare, None), payload, GAIN).observation.joints
    for mine, true in zip(rows, loaded.joints, strict=True):
        np.testing.assert_allclose(mine.V, true.V, rtol=1e-9, atol=1e-9)  # rounding


def test_what_is_expected_is_what_a_loaded_motion_gives(structure, payload, chi, rng):
    payload = replace(lopsided(payload), mass=0.9)
    bare = exact_problem(structure, [(chi, None, None)], GAIN, rng, noise=NOISE, rows=300, options=TRUSTING)
    gains = known(rel_std=STD)
    ratios = gain_ratios(bare, OPTIONS).ratios
    expected = forecast_gains(bare, OPTIONS, payload, arm_in_SI(bare, OPTIONS, gains), ratios)
    carrying = exact_problem(structure, [(chi, payload, payload)], GAIN, rng, noise=NOISE, rows=300, options=TRUSTING)
    found = all_joints_gains(replace(bare, motions=(*bare.motions, *carrying.motions)), OPTIONS)
    seen = np.array([abs(each.std / each.value) for each in found.joints])
    # Other states and noise of 300 rows, a share of currents that a light payload hardly raises.
    np.testing.assert_allclose(expected, seen, rtol=0.35)


def test_a_gain_that_the_payload_would_not_show_is_refused_with_the_estimators_reason(payload, bare):
    light = replace(payload, mass=0.002, mass_std=0.0, com=(0.0, 0.0, 0.001), inertia=(1e-9,) * 3 + (0.0,) * 3)
    bare = replace(bare, options=replace(TRUSTING, max_rel_std=0.1))
    ratios = gain_ratios(bare, OPTIONS).ratios
    expected = forecast_gains(bare, OPTIONS, light, arm_in_SI(bare, OPTIONS, known(rel_std=STD)), ratios)
    assert all("exceeds 10 %" in each for each in expected)


def test_a_gain_that_is_not_about_known_has_no_expectation(payload, bare):
    ratios, in_si = gain_ratios(bare, OPTIONS).ratios, arm_in_SI(bare, OPTIONS, known(rel_std=STD, joints=[1, 3]))
    for shown, tied in (
        ((0, 1, 3, 5), (0, 1, 3, 5)),
        ((0, 1, 5), (0, 1, 3, 5)),  # one given gain ties them
        ((0, 5), (1, 3)),  # nothing ties these to the two that are given
    ):
        part = replace(ratios, given=np.isin(np.arange(6), shown))
        expected = forecast_gains(bare, OPTIONS, payload, in_si, part)
        untold = ["neither given nor identifiable" in str(each) for each in expected]
        assert untold == [j not in tied for j in range(6)]
    with pytest.raises(NotIdentifiable, match="no parameter of the payload"):
        forecast_gains(bare, OPTIONS, replace(payload, known="none"), in_si, ratios)
