"""How `rx90 verify` begins: the weight is suspect where joints agree, a joint where it departs from the others."""

from joint_masses import weighing

from ident.diagnosis.diagnosis import Diagnosed
from scenarios.gains_in_use.weighing import Verification
from scenarios.rendering.content import Cell, Mood, Table


def conclusion(*errors: float | None) -> str:
    return Verification.of(weighing(*errors), Diagnosed()).report("").parts[0].text


def test_joints_that_agree_leave_the_weight_suspect_and_blame_no_joint():
    said = conclusion(-0.077, -0.074, -0.081, -0.076)
    assert said.startswith("FAILED: the mass from all joints is off by the same -7.7 % (2 sigma ")
    assert "check the weighed masses" in said
    assert "joint 4" not in said


def test_a_factor_that_no_scale_is_off_by_is_a_unit():
    advice = "times that on the scale: check the units of mass, currents and gains"
    for error, times in ((999.0, "1000"), (16.2, "17"), (-0.95, "0.05")):
        said = Verification.of(weighing(*[error] * 4, stds=0.0002, scale=0.0), Diagnosed()).report("").parts[0].text
        assert f"the mass from all joints is {times} {advice}" in said
    assert "off by the same +1290 %" in conclusion(*[12.9] * 4)


def test_a_joint_that_departs_from_the_others_is_named_beside_what_they_have_in_common():
    said = conclusion(0.051, 0.049, 0.052, -0.14, None)
    assert "the mass from joints 1, 2 and 3 is off by the same +5.1 %" in said
    assert "; joint 4 differs from them by -18 % (2 sigma 2.1 %): its gain is off" in said


def test_a_gain_that_is_off_alone_is_named_alone():
    assert conclusion(0.003, 0.09, -0.004, 0.002).startswith("FAILED: gains are off: joint 2 by +9 %")


def test_each_joint_has_a_verdict_and_one_without_a_mass_is_inconclusive():
    parts = Verification.of(weighing(0.003, 0.09, None), Diagnosed()).report("").parts
    (masses,) = [part for part in parts if isinstance(part, Table)]
    assert [(row[0].text, row[-1]) for row in masses.rows[1:]] == [
        ("joint 1", Cell("agrees", Mood.GOOD)),
        ("joint 2", Cell("differs", Mood.BAD)),
        ("joint 3", Cell("inconclusive", Mood.DOUBTFUL)),
    ]
