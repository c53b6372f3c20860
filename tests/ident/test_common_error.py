"""Joints that agree with each other against the scale: the weight is suspect, and no single gain."""

import numpy as np
import pytest

from ident.payload import Payload
from ident.weighing.body import FoundBody, Quantity
from ident.weighing.common import common_error
from ident.weighing.verification import AGREES, DIFFERS, Verification, Weighed
from scenarios.reports.verify import verification_report

STATED, SCALE = 7.3, 0.002


def mass(rel_error: float, rel_std: float, gain_share: float = 0.0) -> Quantity:
    return Quantity(
        name="mass",
        unit="kg",
        value=STATED * (1.0 + rel_error),
        residual_std=STATED * rel_std,
        gain_std=STATED * gain_share,
        model_std=0.0,
    )


def weighing(*errors: float | None, stds: float | tuple[float, ...] = 0.01, gain_share: float = 0.0) -> Verification:
    """What a verification finds where joints alone are off by so much, 2.7 deviations being too much."""
    each = np.broadcast_to(stds, len(errors)).tolist()
    joints = tuple(
        Weighed(joint=j, mass=None, rel_error=None, rel_std=None, verdict="says nothing", reason="it is weak")
        if off is None
        else Weighed(
            joint=j,
            mass=mass(off, std, gain_share),
            rel_error=off,
            rel_std=float(np.hypot(std, SCALE)),
            verdict=DIFFERS if abs(off) > 2.7 * np.hypot(std, SCALE) else AGREES,
        )
        for j, (off, std) in enumerate(zip(errors, each, strict=True))
    )
    known = [off for off in errors if off is not None]
    return Verification(
        payload=Payload(mass=STATED, mass_std=STATED * SCALE, known="mass"),
        together=Weighed(joint=None, mass=mass(known[0], 0.01), rel_error=known[0], rel_std=0.01, verdict=DIFFERS),
        joints=joints,
        body=FoundBody(quantities=(), refused={}, possible=None),
        limit=2.7,
        remarks=(),
    )


def conclusion(found: Verification) -> str:
    return verification_report(found).parts[-1].text


def test_joints_that_agree_on_another_mass_leave_the_weight_suspect_and_blame_no_joint():
    found = weighing(-0.077, -0.074, -0.081, -0.076, stds=(0.004, 0.006, 0.009, 0.02))
    common = common_error(found)
    assert common.joints == (0, 1, 2, 3)
    # The mean weighted by what variances are of logarithms, by hand.
    x, w = (
        np.log([0.923, 0.926, 0.919, 0.924]),
        (np.array([0.923, 0.926, 0.919, 0.924]) / (0.004, 0.006, 0.009, 0.02)) ** 2,
    )
    np.testing.assert_allclose(common.rel_error, np.expm1(w @ x / w.sum()), rtol=1e-9)
    np.testing.assert_allclose(common.rel_std, np.exp(w @ x / w.sum()) * np.hypot(w.sum() ** -0.5, SCALE), rtol=1e-9)
    assert common.apart == ()
    said = conclusion(found)
    assert said.startswith("MISSED: all joints alike are off by -7.7 % (2 sigma ")
    assert "suspect the weight" in said
    assert "joint 4" not in said


def test_a_joint_that_departs_from_the_others_is_named_beside_what_they_have_in_common():
    found = weighing(0.051, 0.049, 0.052, -0.14, None)
    common = common_error(found)
    assert common.joints == (0, 1, 2)
    assert [each.joint for each in common.apart] == [3]
    np.testing.assert_allclose(common.apart[0].rel_error, 0.86 / 1.05066 - 1.0, atol=2e-4)
    # sqrt(1 / 0.86^2 + 1 / (3 * 1.05^2)) % of the mass, times 0.86 / 1.05
    np.testing.assert_allclose(common.apart[0].rel_std, 0.01057, atol=5e-5)
    said = conclusion(found)
    assert "joints 1, 2 and 3 alike are off by +5.1 %" in said
    assert "; joint 4 departs from the others by -18 % (2 sigma 2.1): its gain is off" in said


def test_a_gain_that_is_off_alone_is_named_alone():
    found = weighing(0.003, 0.09, -0.004, 0.002)
    assert common_error(found) is None
    assert conclusion(found).startswith("MISSED: gains are off: joint 2 by +9 %")


def test_one_sure_joint_among_unsure_ones_does_not_speak_for_all():
    assert common_error(weighing(-0.08, -0.05, -0.06, stds=(0.005, 0.05, 0.05))) is None


def test_two_joints_that_disagree_have_nothing_in_common():
    assert common_error(weighing(0.08, -0.08)) is None
    assert common_error(weighing(0.08, None)) is None
    assert common_error(weighing(0.08, 0.081)).joints == (0, 1)


@pytest.mark.parametrize(("gain_share", "agree"), [(0.0, False), (0.03, True)])
def test_errors_that_gains_have_in_common_do_not_average_out(gain_share, agree):
    found = weighing(0.05, 0.051, 0.052, 0.049, 0.048, gain_share=gain_share)
    assert (common_error(found) is None) == agree


def test_masses_without_a_logarithm_or_a_deviation_are_left_out():
    found = weighing(-1.2, 0.08, 0.081, stds=(0.01, 0.01, 0.0))
    assert common_error(found) is None
