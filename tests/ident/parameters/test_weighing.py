"""A stated payload against the one that is weighed: which gain is off, and when nothing can be said."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from exact import GAIN
from scipy.stats import norm
from weighings import NAMES, PLAIN, known, weighed

from ident.estimation.known_gains import KnownGains
from ident.parameters.payload import FoundBody, Quantity, payload_of
from ident.parameters.weighing import AGREES, DIFFERS, SAYS_NOTHING, as_stated, joint_agreement, verified
from ident.payload.payload import Payload
from ident.support.errors import Contradiction


def test_the_scale_tells_which_gain_is_off(structure, heavy, rng):
    noisy = weighed(structure, heavy, rng, noise=0.005)
    rel_std = np.full(6, 0.003)
    right = verified(payload_of(noisy, known(rel_std=rel_std), PLAIN), heavy, known(rel_std=rel_std))
    assert right.passed
    assert right.together.verdict == AGREES
    assert all(each.mass is not None for each in right.joints)
    np.testing.assert_allclose(2.0 * norm.sf(right.limit), 0.05 / 7, rtol=1e-9)  # seven masses, wrong once in twenty
    wrong = known(GAIN * np.array([1.0, 1.0, 1.0, 1.0, 1.08, 1.0]), rel_std)
    off = verified(payload_of(noisy, wrong, PLAIN), heavy, wrong)
    assert [each.joint for each in off.joints if each.verdict == DIFFERS] == [4]
    assert not off.passed
    # The residual of 0.5 % and the gain's 0.3 % beside the 8 % that were injected.
    np.testing.assert_allclose(off.joints[4].rel_error, 0.08, atol=4 * off.joints[4].rel_std)


def test_deviation_of_the_scale_is_part_of_the_verdict(weighed_payload, heavy):
    found, gains = weighed_payload, known()
    light = replace(heavy, mass=7.2, mass_std=0.1)
    one = verified(found, light, gains).together
    np.testing.assert_allclose(one.rel_error, 7.025 / 7.2 - 1.0, rtol=1e-4)
    np.testing.assert_allclose(one.rel_std, 0.1 / 7.2, rtol=1e-4)
    assert one.verdict == AGREES  # 1.75 deviations
    assert verified(found, replace(light, mass_std=0.05), gains).together.verdict == DIFFERS  # 3.5 of them


def test_a_mass_that_is_not_sure_says_nothing(weighed_problem, heavy):
    vague = KnownGains(names=NAMES, joints=np.arange(6), value=GAIN, covariance=0.2**2 * np.outer(GAIN, GAIN))
    one = verified(payload_of(weighed_problem, vague, PLAIN), heavy, vague)
    assert one.together.verdict == SAYS_NOTHING
    assert "standard deviation is 20 %, above 10 %" in str(one.together.reason)
    assert {(each.verdict, each.reason) for each in one.joints} == {(AGREES, None)}  # a joint alone shows a wrong gain
    assert not one.passed
    hopeless = replace(vague, covariance=13.2**2 * np.outer(GAIN, GAIN))
    nothing = verified(payload_of(weighed_problem, hopeless, PLAIN), heavy, hopeless).together
    assert "standard deviation is 1320 %" in str(nothing.reason)


def test_joints_agree_on_a_mass_unless_a_gain_is_off(structure, heavy, rng):
    noisy, rel_std = weighed(structure, heavy, rng, noise=0.005), np.full(6, 0.003)
    right, wrong = known(rel_std=rel_std), known(GAIN * np.array([1.0, 2.0, 1.0, 1.0, 1.0, 1.0]), rel_std)
    found = payload_of(noisy, right, PLAIN)
    agreed = joint_agreement(found, found.body, right)
    assert all(each.mass is not None for each in agreed)  # with the centre found, wrist joints show the mass too
    assert len(agreed) == 6
    assert DIFFERS not in [each.verdict for each in agreed]
    found = payload_of(noisy, wrong, PLAIN)
    off = joint_agreement(found, found.body, wrong)[1]
    assert off.verdict == DIFFERS
    # The centre moved with the gains too; the mass of the joint is doubled to within a tenth all the same.
    np.testing.assert_allclose(off.mass, 2.0 * heavy.mass, rtol=0.1)


def centre(x: Sequence[float], std: Sequence[float]) -> list[Quantity]:
    each = zip("xyz", x, std, strict=True)
    return [Quantity(name=k, unit="m", value=v, residual_std=s, gain_std=0.0, model_std=0.0) for k, v, s in each]


def a_mass(value: float, *more: Quantity) -> FoundBody:
    shares = {"residual_std": 0.1, "gain_std": 0.0, "model_std": 0.0}
    return FoundBody(
        quantities=(Quantity(name="mass", unit="kg", value=value, **shares), *more), refused={}, possible=None
    )


def test_a_mass_below_zero_beyond_doubt_is_refused():
    with pytest.raises(Contradiction, match=r"negative: -0\.31 kg, 2 sigma 0\.2 kg; .* probably swapped"):
        a_mass(-0.31).check_mass()
    for value in (-0.29, 0.31):  # three deviations are 0.3
        a_mass(value).check_mass()


@pytest.mark.parametrize("value", [-0.29, 0.29, 2001.0])
def test_of_a_mass_that_is_not_sure_joints_say_nothing(weighed_payload, value):
    assert joint_agreement(weighed_payload, a_mass(value), known()) == ()


def test_what_was_found_is_stated_with_its_deviations():
    expected = Payload(mass=2.3, mass_std=0.1, com=(0.08, -0.03, 0.11), com_std=(0.02, 0.05, 0.03), known="com")
    assert as_stated(a_mass(2.3, *centre((0.08, -0.03, 0.11), (0.02, 0.05, 0.03)))) == expected


def test_without_a_centre_joints_are_asked_for_the_mass_alone(weighed_payload, heavy):
    far, behind = (centre((x,) * 3, (0.2,) * 3) for x in (4.9, -4.9))
    stated = Payload(mass=heavy.mass, mass_std=0.1, known="mass")
    expected = [each.mass for each in verified(weighed_payload, stated, known()).joints]
    for body in (a_mass(heavy.mass), a_mass(heavy.mass, *far), a_mass(heavy.mass, *behind)):
        assert [each.mass for each in joint_agreement(weighed_payload, body, known())] == expected
