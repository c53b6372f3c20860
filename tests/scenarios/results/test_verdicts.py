import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from joint_masses import weighing
from page_parts import tables

from ident.diagnosis.diagnosis import Diagnosed
from ident.estimation.estimators.nls import FRICTION_TERMS
from ident.estimation.known_gains import JointTorque
from ident.estimation.terms import SHARES
from ident.unseen import Unseen, UnseenJoint
from scenarios.experiments.schema import InertiaTable
from scenarios.gains_in_use.known_gains import Torques
from scenarios.gains_in_use.weighing import FoundPayload, Quantity, Verification
from scenarios.rendering.content import Cell, Mood
from scenarios.results.bare import TERMS, Link, Links
from scenarios.results.diagnoses import unseen_verdict
from scenarios.results.gains import budget_verdict
from scenarios.results.gains_file import SLIDING, GainEntry, GainsFile


def test_a_budget_begins_with_the_error_to_expect_what_meets_its_tolerance_and_what_dominates():
    first, slack = (1, 0.022, 0.01, "white"), (2, 0.005, 0.03, None)
    for joints, text, mood in (
        (
            [(1, 0.022, 0.01, "elasticity"), (2, 0.0163, 0.01, "elasticity"), (4, 0.0178, 0.01, "drift")],
            "1.6 to 2.2 % rms; joints 1, 2 and 4 beyond 1 %; .* joints 1 and 2, drift dominates joint 4",
            Mood.BAD,
        ),
        ([first, slack, (3, None, 0.03, None)], "joint 2 within tolerance; joints 1 and 3 beyond", Mood.DOUBTFUL),
        ([first, (2, 0.005, 0.01, None), (3, 0.022, 0.01, None)], "joint 2 within 1 %; joints 1 and 3", Mood.DOUBTFUL),
        ([(1, 0.005, 0.01, None)], "0.5 % rms; joint 1 within 1 %", Mood.GOOD),
        ([(1, None, 0.01, None)], "No joint has a gain", Mood.BAD),
    ):
        said = budget_verdict(joints)
        assert re.search(text, said.text)
        assert (said.mood, said.strong) == (mood, True)


def test_torques_are_told_with_rms_peak_and_interval_of_each_joint_and_four_digits_without_one():
    tau = np.array([[3.0, -40.0], [-5.0, 30.0], [4.0, 0.02]])
    found = JointTorque(t=np.arange(3.0), joints=np.array([0, 2]), tau=tau, std=0.01 * np.abs(tau))
    gains = (
        GainEntry(joint=1, name="base", estimate=2.0, std=0.02),
        GainEntry(joint=2, identifiable=False, reason="too light"),
        GainEntry(joint=3, unit=SLIDING, estimate=9.0, std=0.09),
    )
    file = GainsFile(gains=gains)
    verdict, table, *rest = Torques.of(found, file, Path("tau.parquet")).parts()
    assert verdict.text == "Peak 5.00 ± 0.10 N m on joint 1 and 40.0 ± 0.8 N on joint 3 (2 sigma)."
    assert [[cell.text for cell in row] for row in table.rows] == [
        ["1", "base", "4.08", "5.00", "0.10", "N m", "2.00"],  # root of 50 / 3
        ["3", "", "28.87", "40.00", "0.80", "N", "2.00"],  # root of 2500 / 3
    ]
    assert rest[-1].text == "Joint 2 has no column: too light."
    small = replace(found, tau=np.array([[400.0, 0.03], [400.0, 0.05]]), std=np.array([[2.0, 1e-4]] * 2))
    for stds, rows in (
        (small.std, [["400.0", "400.0", "4.0"], ["0.04123", "0.05000", "0.00020"]]),  # root of 34e-4 / 2
        (np.zeros((2, 2)), [["400.0", "400.0", "-"], ["0.04123", "0.05000", "-"]]),
    ):
        _, table, *_ = Torques.of(replace(small, t=np.arange(2.0), std=stds), file, Path("tau.parquet")).parts()
        assert [[cell.text for cell in row[2:5]] for row in table.rows] == rows


def test_a_payload_begins_with_its_mass_and_where_it_is():
    def quantity(name: str, unit: str, value: float, std: float) -> Quantity:
        shares = {"residual_std": 0.6 * std, "gain_std": 0.8 * std, "model_std": 0.0}
        return Quantity(quantity=name, unit=unit, estimate=value, std=std, **shares)

    def payload(*body: Quantity) -> FoundPayload:
        empty = {"parameters": [], "covariance": [], "refused": {}, "joints": [], "notes": [], "possible": None}
        return FoundPayload(body=list(body), **empty, diagnoses=[], excluded=[], untold=[])

    mass, z = quantity("mass", "kg", 7.0531, 0.0241), quantity("z", "m", 0.1432, 0.0008)
    verdict, table, *_ = payload(mass, z).parts()
    assert verdict.text == "7.05 ± 0.05 kg (2 sigma); centre of mass at z 143.2 ± 1.6 mm."
    rows = [[cell.text for cell in row] for row in table.rows]
    assert rows[0] == ["mass", "7.053", "0.048", "kg", "0.029", "0.039", "0.000"]
    assert "do not determine the mass" in next(iter(payload(z).parts())).text
    for body, negative in ((mass, False), (quantity("mass", "kg", -0.013, 0.0241), True)):
        said = [getattr(each, "text", "") for each in payload(body, z).parts()]
        assert any("the mass is negative" in text for text in said) is negative
    lacking = payload(mass, z).model_copy(
        update={"refused": {"ixx": "XX: unseen", "iyy": "XX: unseen", "x": "MX: unseen"}}
    )
    said = [each.text for each in lacking.parts() if getattr(each, "text", "").startswith("No ")]
    assert said == ["No x: MX: unseen.", "No ixx, iyy: XX: unseen."]


def test_a_result_fails_by_what_the_payload_says_of_a_gain_alone():
    given = {"rel_error": 0.06, "fitted_rel_error": 0.05, "largest_rel_error": 0.15}
    for error, std, passed, said in (
        (-0.21, 0.03, False, "FAILED: prediction error 6 % of the currents of new.csv"),
        (-0.21, 0.08, True, "Prediction error 6 %"),  # within three deviations
        (0.14, 0.02, False, "By its payload the gains are off by +14 % (joint 3)"),
    ):
        joint = UnseenJoint(joint=2, **given, gain_rel_error=error, gain_rel_std=std)
        found = Unseen(log="new.csv", loaded=True, verdict=None, rel_error=0.06, other_rel_error=None, joints=(joint,))
        assert found.passed is passed
        (told,) = unseen_verdict(found)
        assert said in told.text


def test_a_weight_is_suspect_where_joints_agree_and_a_joint_where_it_departs_from_the_others():
    sure, one_off = {"stds": 0.0002, "scale": 0.0}, (0.051, 0.049, 0.052, -0.14, None)
    for errors, more, said in (
        ((-0.077, -0.074, -0.081, -0.076), {}, "FAILED: the mass from all joints is off by the same -7.7 % (2 sigma "),
        ([999.0] * 4, sure, "the mass from all joints is 1000 times that on the scale"),
        ([-0.95] * 4, sure, "is 0.05 times that on the scale: check the units"),
        ([12.9] * 4, {}, "off by the same +1290 %"),  # a factor that a scale may be off by is no unit
        (one_off, {}, "; joint 4 differs from them by -18 % (2 sigma 2.1 %): its gain is off"),
        (one_off, {}, "the mass from joints 1, 2 and 3 is off by the same +5.1 %"),
        ((0.003, 0.09, -0.004, 0.002), {}, "FAILED: gains are off: joint 2 by +9 %"),
        ((0.05, 0.003, -0.09, 0.002, -0.004), {}, "gains are off: joint 3 by -9 % (2 sigma 2 %), joint 1 by +5 %"),
    ):
        verdict, *_ = Verification.of(weighing(*errors, **more), Diagnosed()).report("").parts
        assert said in verdict.text
        assert ("joint 4" in verdict.text) == (-0.14 in errors)


def test_each_joint_has_a_verdict_and_one_without_a_mass_is_inconclusive():
    masses, *_ = tables(Verification.of(weighing(0.003, 0.09, None), Diagnosed()))
    assert [(row[0].text, row[-1]) for row in masses.rows[1:]] == [
        ("joint 1", Cell("agrees", Mood.GOOD)),
        ("joint 2", Cell("differs", Mood.BAD)),
        ("joint 3", Cell("inconclusive", Mood.DOUBTFUL)),
    ]


@pytest.mark.parametrize(
    ("turns", "unit"), [((True, True), "kg m^2"), ((False, False), "kg"), ((True, False), "kg (m^2)")]
)
def test_the_motor_of_a_sliding_joint_has_a_mass(turns, unit):
    six = InertiaTable(**dict.fromkeys(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), 0.02))
    given = {"mass": 2.5, "com": (0.1, 0.2, -0.3), "inertia": six, "motor_inertia": 0.7}
    units = ["kg m^2" if turn else "kg" for turn in turns]
    links = [Link.model_construct(joint=j, motor_unit=each, **given) for j, each in enumerate(units, 1)]
    for far, said in ((0.4, "by 0.4 standard deviations."), (4.5, "by 4.5 standard deviations. This is too large; ")):
        found = Links.model_construct(links=links, farthest_parameter="MX2", farthest_deviations=far)
        table, words = found.parts()
        assert {each.title: each.unit for each in table.columns}["Motor"] == unit
        assert f"MX2 differs most from its estimate, {said}" in words.text


def test_every_term_of_friction_has_its_meaning():
    known = {"Fv", "Fc", "off", *SHARES, *FRICTION_TERMS}
    assert set(TERMS) == known


def test_the_parameter_that_gave_way_most_may_have_become_smaller(arm):
    own = np.tile([0.2, 0.01, 0.02, 0.3, 0.03, 0.25, 0.1, -0.2, 0.3, 2.5], (arm.n, 1))
    moved = {"names": ("MX1", "MY1", "ZZ1"), "moved": np.array([0.3, -4.5, 2.1])}
    found = SimpleNamespace(own=own, motor=np.full(arm.n, 0.7), motor_found=np.ones(arm.n, bool), **moved)
    links = Links.of(found, SimpleNamespace(carried=np.zeros((arm.n, 10))), arm)
    assert (links.farthest_parameter, links.farthest_deviations) == ("MY1", 4.5)
