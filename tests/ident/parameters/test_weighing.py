"""A stated payload against the one that is weighed: which gain is off, and when nothing can be said."""

import re
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from exact import GAIN, TRUSTING, exact_problem
from joint_masses import SCALE, weighing
from refusals import refused
from scipy.stats import norm
from weighings import NAMES, PLAIN, estimated, known, weighed

from ident.estimation.estimate import IdentifiedGain, RefusedGain
from ident.estimation.estimators.nls import all_joints_gains
from ident.estimation.known_gains import KnownGains, stated_gains
from ident.estimation.problem import Problem
from ident.parameters.arm import arm_in_use
from ident.parameters.payload import FoundBody, Quantity, payload_of
from ident.parameters.weighing import (
    AGREES,
    DIFFERS,
    SAYS_NOTHING,
    UNKNOWN,
    as_load,
    as_stated,
    common_error,
    masses_of_joints,
    outcome_of_other_gains,
    verified,
    with_unknown_weight,
)
from ident.payload.payload import INERTIA_KEYS, Payload
from ident.support.errors import Contradiction, GainsError, NotIdentifiable, PayloadError


def test_the_scale_tells_which_gain_is_off(structure, heavy, rng):
    noisy = weighed(structure, heavy, rng, noise=0.005)
    rel_std = np.full(6, 0.003)
    given, shown = known(rel_std=rel_std), estimated(noisy, heavy)
    right = verified(payload_of(noisy, given, PLAIN), heavy, given, shown)
    assert right.passed
    assert right.together.verdict == AGREES
    assert all(each.mass is not None for each in right.joints)
    mass, found = right.body.of("mass"), right.together
    assert (found.residual_std, found.gain_std) == (mass.residual_std, mass.gain_std)
    assert (found.std, found.model_std) == (mass.std, mass.model_std)
    np.testing.assert_allclose(2.0 * norm.sf(right.limit), 0.05 / 7, rtol=1e-9)  # seven masses, wrong once in twenty
    wrong = known(GAIN * np.array([1.0, 1.0, 1.0, 1.0, 1.08, 1.0]), rel_std)
    off = verified(payload_of(noisy, wrong, PLAIN), heavy, wrong, shown)
    assert [each.joint for each in off.joints if each.verdict == DIFFERS] == [4]
    assert not off.passed
    # The residual of 0.5 % and the gain's 0.3 % beside the 8 % that were injected.
    np.testing.assert_allclose(off.joints[4].rel_error, 0.08, atol=4 * off.joints[4].rel_std)


def test_deviation_of_the_scale_is_part_of_the_verdict(weighed_payload, heavy):
    found, gains = weighed_payload, known()
    light = replace(heavy, mass=7.2, mass_std=0.1)
    one = verified(found, light, gains, "").together
    np.testing.assert_allclose(one.rel_error, 7.025 / 7.2 - 1.0, rtol=1e-4)
    np.testing.assert_allclose(one.rel_std, 0.1 / 7.2, rtol=1e-4)
    assert one.verdict == AGREES  # 1.75 deviations
    assert verified(found, replace(light, mass_std=0.05), gains, "").together.verdict == DIFFERS  # 3.5 of them


def test_a_mass_that_is_not_sure_says_nothing(weighed_problem, heavy):
    vague = KnownGains(names=NAMES, joints=np.arange(6), value=GAIN, covariance=0.2**2 * np.outer(GAIN, GAIN))
    shown = estimated(weighed_problem, heavy)
    one = verified(payload_of(weighed_problem, vague, PLAIN), heavy, vague, shown)
    assert one.together.verdict == SAYS_NOTHING
    assert "standard deviation is 20 %, above 10 %" in str(one.together.reason)
    assert {(each.verdict, each.reason) for each in one.joints} == {(AGREES, None)}  # a joint alone shows a wrong gain
    assert not one.passed
    hopeless = replace(vague, covariance=13.2**2 * np.outer(GAIN, GAIN))
    nothing = verified(payload_of(weighed_problem, hopeless, PLAIN), heavy, hopeless, shown).together
    assert "standard deviation is 1320 %" in str(nothing.reason)


def centre(x: Sequence[float], std: Sequence[float]) -> list[Quantity]:
    each = zip("xyz", x, std, strict=True)
    return [Quantity(name=k, unit="m", value=v, residual_std=s, gain_std=0.0, model_std=0.0) for k, v, s in each]


def a_mass(value: float, *more: Quantity) -> FoundBody:
    shares = {"residual_std": 0.1, "gain_std": 0.0, "model_std": 0.0}
    return FoundBody(
        quantities=(Quantity(name="mass", unit="kg", value=value, **shares), *more), refused={}, possible=None
    )


def test_a_mass_below_zero_beyond_doubt_is_refused_and_one_that_is_not_sure_is_not_stated():
    refused(Contradiction, r"negative: -0\.31 kg, 2 sigma 0\.2 kg; .* probably swapped", a_mass(-0.31).check_mass)
    for value in (-0.29, 0.31):  # three deviations are 0.3
        a_mass(value).check_mass()
    assert [as_stated(a_mass(value)) for value in (-0.29, 0.29, 2001.0)] == [None] * 3
    where = centre((0.08, -0.03, 0.11), (0.02, 0.05, 0.03))
    assert as_stated(a_mass(2.3, *where)) == Payload(mass=2.3, mass_std=0.1, known="mass")


def test_a_body_is_a_load_as_far_as_it_is_known_and_possible():
    def with_inertia(moments: Sequence[float], std: float = 0.001) -> FoundBody:
        found = zip(INERTIA_KEYS, moments, strict=False)
        inertia = [
            Quantity(name=k, unit="kg m^2", value=v, residual_std=0.6 * std, gain_std=0.8 * std) for k, v in found
        ]
        return a_mass(2.3, *centre((0.08, -0.03, 0.11), (0.002, 0.005, 0.003)), *inertia)

    moments = (0.031, 0.027, 0.019, 0.004, -0.003, 0.002)
    load, why = as_load(with_inertia(moments), most=0.1)
    stated = {"mass": 2.3, "mass_std": 0.1, "com": (0.08, -0.03, 0.11), "com_std": (0.002, 0.005, 0.003)}
    assert load == Payload(**stated, inertia=moments, inertia_std=(0.001,) * 6)
    assert why is None
    size = np.linalg.norm(moments)
    for body, most, reason in (
        (with_inertia(moments, 1.01 * 0.1 * size / 6**0.5), 0.1, r"inertia: 0\.0456 kg m\^2 .* more than 10 %"),
        (with_inertia((0.031, 0.027, 0.059, 0.004, -0.003, 0.002)), 0.1, "payload: inertia violates the triangle"),
        (replace(with_inertia(()), refused={"ixx": "XX: not excited"}), 0.1, "inertia: XX: not excited"),
    ):
        load, why = as_load(body, most=most)
        assert load == Payload(**stated, known="com")
        assert re.match(reason, why or "")
    for body, most, reason in (
        (with_inertia(moments), 0.04, r"mass: 2\.3 kg has a standard deviation of 0\.1 kg, more than 4 %"),
        (with_inertia(moments), 0.0439, r"com: 0\.139 m has a standard deviation of 0\.0062 m"),
        (replace(a_mass(2.3), refused={"x": "MX: not excited"}), 0.1, "com: MX: not excited"),
        (replace(a_mass(2300.0, *centre((1.0, 2.0, 3.0), (0.0,) * 3)), refused={"ixx": "none"}), 0.1, "payload: mass"),
    ):
        load, why = as_load(body, most=most)
        assert load is None
        assert re.match(reason, why or "")


def test_each_joint_weighs_by_its_gain_over_the_one_that_the_weight_gives(heavy):
    shown = IdentifiedGain(
        joint="", value=4.0, residual_std=0.06, payload_rel_std=0.05, model_rel_std=0.02, predicted_rel_std=0.06
    )
    refused = RefusedGain(joint="", reason="it is weak", predicted_rel_std=None)
    estimate = SimpleNamespace(joints=(shown, refused, shown, shown, shown, shown))
    payload = replace(heavy, mass=7.0, mass_std=0.21)  # 3 % of the 5 % that the payload adds are the scale's
    gains = known(np.array([4.4, 1.0, 1.0, -3.8, 4.1, 4.0]), (0.07, 0.0, 0.0, 0.01, 0.4, 0.0), (0, 1, 3, 4, 5))
    one, weak, unknown, turned, vague, sure = masses_of_joints(payload, gains, estimate)
    assert (weak, unknown) == ("it is weak", "its gain is not known")
    assert vague == f"its estimate of the mass has a standard deviation of {7.0 * 1.025 * 0.4033:.2g} kg"
    np.testing.assert_allclose([one.value, turned.value, sure.value], [7.7, -6.65, 7.0], rtol=1e-12)
    parts = [one.residual_std, one.gain_std, one.model_std]
    np.testing.assert_allclose(parts, 7.7 * np.array([0.015, 0.07, np.hypot(0.02, 0.04)]), rtol=1e-12)
    np.testing.assert_allclose(turned.std, 6.65 * np.linalg.norm([0.015, 0.01, 0.02, 0.04]), rtol=1e-12)
    assert masses_of_joints(payload, gains, "no load")[:3] == ("no load",) * 3


def test_joints_that_agree_on_another_mass_leave_the_weight_suspect_and_blame_no_joint():
    found = weighing(-0.077, -0.074, -0.081, -0.076, stds=(0.004, 0.006, 0.009, 0.02))
    common = common_error(found)
    assert common.joints == (0, 1, 2, 3)
    # The mean weighted by what variances are of logarithms, by hand.
    masses = np.array([0.923, 0.926, 0.919, 0.924])
    x, w = np.log(masses), (masses / (0.004, 0.006, 0.009, 0.02)) ** 2
    np.testing.assert_allclose(common.rel_error, np.expm1(w @ x / w.sum()), rtol=1e-9)
    np.testing.assert_allclose(common.rel_std, np.exp(w @ x / w.sum()) * np.hypot(w.sum() ** -0.5, SCALE), rtol=1e-9)
    assert common.apart == ()


@pytest.mark.parametrize("unweighed", [0, 4])  # joints are numbered with those that do not weigh the payload
def test_a_joint_that_departs_from_the_others_is_named_beside_what_they_have_in_common(unweighed):
    masses = [0.051, 0.049, 0.052, -0.14]
    masses.insert(unweighed, None)
    common = common_error(weighing(*masses))
    first = 0 if unweighed else 1
    assert common.joints == (first, first + 1, first + 2)
    assert [each.joint for each in common.apart] == [first + 3]
    np.testing.assert_allclose(common.apart[0].rel_error, 0.86 / 1.05066 - 1.0, atol=2e-4)
    # sqrt(1 / 0.86^2 + 1 / (3 * 1.05^2)) % of the mass, times 0.86 / 1.05
    np.testing.assert_allclose(common.apart[0].rel_std, 0.01057, atol=5e-5)


def test_joints_that_pass_have_no_error_in_common():
    found = weighing(0.026, 0.025, 0.024, 0.026)
    assert common_error(found) is not None
    assert common_error(replace(found, together=replace(found.together, verdict=AGREES))) is None


def test_what_gains_have_in_common_is_at_most_the_deviation_of_the_surest():
    shares = (0.11, 0.03, 0.07)
    common = common_error(weighing(0.3, 0.3, 0.3, gain_share=shares))
    std = np.hypot(0.01, shares)
    expected = np.linalg.norm((np.sum(std**-2.0) ** -0.5, 0.03, 1.3 * SCALE))
    np.testing.assert_allclose(common.rel_std, expected, rtol=1e-9)


def test_joints_have_a_common_error_if_it_is_significant_without_any_of_them():
    five = 0.05, 0.051, 0.052, 0.049, 0.048
    for found, joints in (
        (weighing(0.003, 0.09, -0.004, 0.002), None),  # a gain that is off alone
        (weighing(-0.08, -0.05, -0.06, stds=(0.005, 0.05, 0.05)), None),  # one sure joint does not speak for all
        (weighing(0.08, -0.08), None),
        (weighing(0.08, None), None),
        (weighing(0.08, 0.081), (0, 1)),
        (weighing(-1.2, 0.08, 0.081, stds=(0.01, 0.01, 0.0)), None),  # no logarithm, no deviation
        (weighing(*five, gain_share=0.0), (0, 1, 2, 3, 4)),
        (weighing(*five, gain_share=0.03), None),  # errors that gains have in common do not average out
    ):
        common = common_error(found)
        assert (None if common is None else common.joints) == joints


K = 1.2
# Held gains have a row of the prior of deviation 1e-6 or so, exact rows none: see test_payload_parameters.
CLOSE = 1e-4


@pytest.fixture(scope="module")
def two_weights(structure, heavy) -> tuple[Problem, np.ndarray]:
    """Exact motions bare, light and heavy, whose payloads are known, and the arm's base parameters."""
    rng = np.random.default_rng(8)
    chi = rng.uniform(0.5, 2.0, 84)
    light = replace(heavy, mass=3.1)
    problem = exact_problem(
        structure, [(chi, None, None), (chi, light, light), (chi, heavy, heavy)], GAIN, rng, options=TRUSTING
    )
    return problem, structure.base.regrouping @ chi


def test_friction_of_an_arm_in_use_is_that_of_its_first_motion_with_its_deviation(structure, rng):
    chi, names = rng.uniform(0.5, 2.0, 84), structure.base.names
    rubbed = chi.copy()
    rubbed.reshape(6, 14)[:, 11:13] *= 1.7
    motions = [(chi, None, None), (rubbed, None, None)]
    problem = exact_problem(structure, motions, GAIN, rng, noise=1e-3, options=TRUSTING)
    found = arm_in_use(problem, known(GAIN))
    base, C = found.in_si()
    for j, own in enumerate(found.friction):
        for each in own:
            name, _, motion = each.name.partition(" in motion ")
            if motion != "2":
                at = names.index(f"{name}{j + 1}")
                np.testing.assert_allclose(base[at], GAIN[j] * each.value, rtol=1e-12)
                np.testing.assert_allclose(np.sqrt(C[at, at]), abs(GAIN[j]) * each.std, rtol=1e-3)
    for each in found.inertial:
        at = names.index(each.name)
        np.testing.assert_allclose([base[at], np.sqrt(C[at, at])], [each.value, each.std], rtol=1e-3)


def test_the_heaviest_weight_is_found_again_without_what_is_known_of_it(two_weights, heavy):
    problem, expected = two_weights
    outcome = outcome_of_other_gains(problem, known(K * GAIN), PLAIN, all_joints_gains(problem, PLAIN))
    assert outcome.weighed.payload == heavy
    for each in (outcome.weighed.together, *outcome.weighed.joints):
        np.testing.assert_allclose(each.mass, K * heavy.mass, rtol=CLOSE)
    centre = [outcome.weighed.body.of(axis).value for axis in "xyz"]
    np.testing.assert_allclose(centre, heavy.com, atol=CLOSE)  # the same however the scale is off
    base = outcome.arm.in_si()[0]  # friction included
    np.testing.assert_allclose(base, K * expected, atol=CLOSE * np.abs(base).max())
    asked = with_unknown_weight(problem, [problem.motions[1]])
    assert [motion.payload for motion in asked.motions] == [None, UNKNOWN]
    assert asked.motions[1].observation is problem.motions[1].observation


def test_motions_that_weigh_nothing_are_refused(two_weights):
    bare, light, _ = two_weights[0].motions
    unknown = replace(light, payload=Payload(mass=2.0, known="none"))
    for motions, error, said in (
        ((bare,), NotIdentifiable, "no motion carries a payload"),
        ((bare, unknown), PayloadError, "a verification needs its mass"),
    ):
        refused(error, said, outcome_of_other_gains, replace(two_weights[0], motions=motions), known(), PLAIN, "")


def test_stated_gains_are_exact_and_one_a_joint(structure):
    gains = stated_gains(structure.arm, GAIN.tolist())
    assert gains.names == structure.arm.joint_names
    assert gains.joints.tolist() == list(range(len(NAMES)))
    np.testing.assert_array_equal(gains.value, GAIN)
    assert not gains.covariance.any()
    refused(GainsError, r"5 gains, but robot \w+ has 6 joints", stated_gains, structure.arm, GAIN[:5])
    refused(GainsError, "joint 2: a gain of 0", stated_gains, structure.arm, [1.0, 0.0, 1.0, 1.0, 1.0, 1.0])
