"""What gains themselves give to doubt."""

from dataclasses import replace

import numpy as np
import pytest
from estimates import gain_estimate

from ident.diagnosis.diagnosis import Severity
from ident.diagnosis.gain_checks import FAR, SURE_LOAD_Z, UNEXPLAINED, far_off, gain_diagnoses, negative
from ident.estimation.estimate import FRICTION_Z, GainEstimate


def estimate(*gains: float | None) -> GainEstimate:
    return gain_estimate(*gains, std=0.01, reason="no load")


def test_a_negative_gain_is_a_doubt_and_no_error():
    (found,) = negative({0: 13.2, 3: -7.1})
    assert (found.severity, found.joints, found.value, found.unit) == (Severity.WEAK, (3,), -7.1, "N m/unit")
    assert found.sentence.startswith("joint 4: the gain is negative; v4 and q4 have opposite signs")


def test_a_gain_far_from_the_median_of_the_others_is_named_with_the_ratio():
    gains = {0: 13.2, 1: 9.7 / FAR / 1.4, 2: -9.7}
    (found,) = far_off(gains)
    assert found.joints == (1,)
    np.testing.assert_allclose(found.value, 9.7 / FAR / 1.4 / 11.45, rtol=1e-12)  # the median of 13.2 and 9.7
    (found,) = far_off({**gains, 1: 11.45 * FAR * 1.01})
    assert found.joints == (1,)
    assert list(far_off({**gains, 1: 11.45 * FAR * 0.99})) == []
    assert list(far_off({0: 13.2, 1: 11.4 / FAR * 1.2})) == []
    assert list(far_off({4: 5e-6})) == []


@pytest.mark.parametrize(
    ("load", "friction", "contradicted"),
    [
        (1.1 * SURE_LOAD_Z, -1.1 * FRICTION_Z, True),
        (-1.1 * SURE_LOAD_Z, 1.1 * FRICTION_Z, True),
        (-1.1 * SURE_LOAD_Z, -1.1 * FRICTION_Z, False),
        (0.9 * SURE_LOAD_Z, -1.1 * FRICTION_Z, False),
        (1.1 * SURE_LOAD_Z, -0.9 * FRICTION_Z, False),
    ],
)
def test_signs_by_load_and_by_friction_contradict_each_other_where_both_are_sure(
    monkeypatch, load, friction, contradicted
):
    class Signs:
        load_z, friction_z = np.array([30.0, load]), np.array([30.0, friction])

    monkeypatch.setattr("ident.diagnosis.gain_checks.joint_signs", lambda _: Signs)
    found = [each for each in gain_diagnoses(estimate(3.0, None, 2.0)) if each.name == "sign of the gain"]
    assert [(each.severity, each.joints) for each in found] == ([(Severity.WRONG, (2,))] if contradicted else [])


@pytest.mark.parametrize(("share", "told"), [(1.01 * UNEXPLAINED, True), (0.99 * UNEXPLAINED, False)])
def test_a_joint_whose_current_is_badly_explained_is_named(share, told):
    given = estimate(3.0, 2.0)
    rows = given.solution.rows
    left = np.where(rows.joint == 1, share * rows.V, 0.01)
    given = replace(given, solution=replace(given.solution, rows=replace(rows, residual=left)))
    found = [each for each in gain_diagnoses(given) if each.name == "residual"]
    assert [each.joints for each in found] == ([(1,)] if told else [])
    if told:
        np.testing.assert_allclose(found[0].value, 100.0 * share, rtol=1e-9)
