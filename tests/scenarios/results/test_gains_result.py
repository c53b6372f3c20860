import re
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from estimates import gain_estimate, gain_of
from page_parts import drawn_intervals, plots, tables

from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Effect, Exclusion, Severity
from ident.diagnosis.motion_quality import JointMotion
from ident.estimation.estimate import GainCurve, JointResult, RefusedGain
from ident.estimation.known_gains import KnownGains
from ident.identification import Identification
from ident.payload.payload import Payload
from scenarios.rendering.content import Mood, Paragraph
from scenarios.rendering.plot import Plot
from scenarios.rendering.result import to_json
from scenarios.results.check import CheckLog, motion_parts
from scenarios.results.cost import CostJoint, CostQuantity, ResultCost
from scenarios.results.diagnoses import horizon_fold
from scenarios.results.gains import Result, ResultGain, common_unit, sources_simulated
from scenarios.results.pages import how_to_identify
from scenarios.results.record import RESULT, read_result

DOUBT = Diagnosis(
    name="zero",
    severity=Severity.WEAK,
    sentence="the zero of q3 is off by 2 degrees",
    advice="correct it",
    joints=(2,),
    logs=("far/b.csv",),
    value=2.0,
    std=0.1,
    unit="degrees",
    z=5.5,
    effects=(Effect(joint=2, percent=-1.5, deviations=-2.0), Effect(joint=1, percent=0.1, deviations=0.1)),
)
GOOD = Diagnosis(name="clipping", sentence="no current is clipped", logs=("far/a.csv",))
FOUND = Diagnosed(
    diagnoses=(DOUBT, GOOD),
    excluded=(
        Exclusion(family="delay", sentence="delays beyond 5 ms", limit=5.0, unit="ms"),
        Exclusion(family="sign", sentence="another sign (7 of 12 cases)"),
    ),
    undetectable=("zero of q1", "whether q4 is negated"),
    largest_undetected="delays up to 5 ms",
)
MASS = CostQuantity(
    quantity="mass", unit="kg", true=None, stated=7.0, assumed=6.5, assumed_std=0.1, found=None, found_std=None
)
identified = partial(gain_of, "j", payload=0.0, model=0.0)
REFUSED = RefusedGain(joint="j", reason="too light", predicted_rel_std=0.35)


def result_of(*found: JointResult, said: Diagnosed = FOUND, notes: tuple[str, ...] = (), **more) -> Result:
    estimate = replace(gain_estimate(*[1.0] * len(found), std=0.1, reason=""), joints=found)
    result = Result.of_identification(Identification(estimate, notes, said), 0.1)
    return result.model_copy(update=more)


def texts(result: Result) -> list[str]:
    return [part.text for part in result.parts() if isinstance(part, Paragraph)]


def plot_of(result: Result, title: str) -> Plot:
    (plot,) = [each for each in plots(result) if each.title.startswith(title)]
    return plot


def intervals_of(plot: Plot) -> list[dict[int, tuple[float, float, float]]]:
    return drawn_intervals(plot.figure().axes[0])


def test_a_result_begins_with_its_number_and_a_warning_stands_before_the_notes():
    said = texts(result_of(identified(0.8, 0.02), REFUSED, notes=("clock jitters",)))
    assert said[0] == "1 of 2 gains identified, ±5 %. See 1 warning below."  # 2 x 0.02 / 0.8
    assert said[2:4] == ["WARNING b.csv: the zero of q3 is off by 2 degrees. Correct it.", "Note: clock jitters."]
    assert said[4].startswith("Note: the largest fault that these logs do not exclude: delays up to 5 ms; rx90 check ")
    assert said[-1] == "Joint 2: too light."
    assert "See" not in texts(result_of(identified(0.8, 0.02), said=Diagnosed(diagnoses=(GOOD,))))[0]
    (fold,) = horizon_fold(FOUND.excluded, FOUND.undetectable)
    assert [[cell.text for cell in row] for row in fold.rows] == [
        ["delays beyond 5 ms", "excluded"],
        ["another sign (7 of 12 cases)", "excluded"],
        ["zero of q1", "not revealed"],
        ["whether q4 is negated", "not revealed"],
    ]


@pytest.mark.parametrize(("name", "doubted"), [("residual", [2]), ("link masses", [1, 2]), ("autocorrelation", [])])
def test_a_warning_of_a_gain_itself_is_in_its_row_and_in_the_first_sentence(name, doubted):
    weak = Diagnosis(name=name, severity=Severity.WEAK, sentence="so", joints=(1, 2))
    gains = identified(0.8, 0.02), identified(0.7, 0.03), REFUSED
    result = result_of(*gains, said=Diagnosed(diagnoses=(weak, replace(DOUBT, joints=(0,)))))
    moods = {"in doubt": Mood.DOUBTFUL, "identified": Mood.GOOD, "refused": Mood.DOUBTFUL}
    verdicts = [row[-1].text for row in tables(result)[0].rows]
    expected = ["in doubt" if j in doubted else "identified" for j in (1, 2)]
    assert verdicts == [*expected, "refused"]
    assert [row[-1].mood for row in tables(result)[0].rows] == [moods[each] for each in verdicts]
    assert texts(result)[0].partition("; ")[2].startswith("joint") == bool(doubted)


def test_gains_have_the_unit_of_their_joints():
    for revolute, unit in (([True, True], "N m/unit"), ([False, False], "N/unit"), ([True, False], "N (m)/unit")):
        estimate = gain_estimate(0.8, std=0.1, reason="")
        gains = [ResultGain.of(0, estimate, revolute=turns) for turns in revolute]
        assert common_unit([gain.unit for gain in gains]) == unit
        table = tables(result_of(identified(0.8, 0.02), gains=gains))[0]
        assert {column.title: column.unit for column in table.columns}["Gain"] == unit


def verdict(joint: int, **more) -> ResultGain:
    given = {"true": -0.5, "estimate": -0.52, "std": 0.015, "rel_error": 0.04, "z": -1.3}
    judged = {"tolerance": 0.07, "identifiable": True, "passed": True, "reason": None}
    return ResultGain(joint=joint, **{**given, **judged, **more})


NONE = dict.fromkeys(("estimate", "std", "rel_error", "z")) | {"identifiable": False}


def test_a_run_begins_with_its_verdict_and_the_worst_gain():
    for gains, said, mood in (
        (
            [verdict(1), verdict(2, rel_error=-0.06), verdict(3, **NONE)],
            r"PASSED: 2 gains .*joint 2, -6 %, tolerance 7 %.*joint 3 refused",
            Mood.GOOD,
        ),
        (
            [verdict(1), verdict(2, rel_error=-0.36, passed=False), verdict(4, rel_error=0.3, passed=False)],
            r"FAILED: joints 2 and 4 .*joint 2, -36 %, tolerance 7 %",
            Mood.BAD,
        ),
        (
            [verdict(2, passed=False), verdict(5, **NONE, passed=False), verdict(6, rel_error=0.08, passed=False)],
            r"FAILED: joint 6 .*\+8 %, tolerance 7 %.*joint 2 identified, .*joint 5 refused, ",
            Mood.BAD,
        ),
    ):
        first, *_ = result_of(identified(0.8, 0.02), gains=gains).parts()
        assert re.match(said, first.text)
        assert (first.mood, first.strong) == (mood, True)


def test_tolerances_are_shown_if_they_differ_and_every_row_has_its_verdict():
    gains = [verdict(1), verdict(2, tolerance=0.09), verdict(3, **NONE), verdict(4, passed=False)]
    result = result_of(identified(0.8, 0.02), gains=gains)
    (allowed,) = [k for k, column in enumerate(tables(result)[0].columns) if column.title == "Tolerance"]
    assert [row[allowed].text for row in tables(result)[0].rows] == ["7", "9", "7", "7"]
    table = tables(result)[0]
    assert [row[-1].text for row in table.rows] == ["passed", "passed", "refused", "FAILED"]
    assert [cell.text for cell in table.rows[0][:5]] == ["1", "-0.500", "-0.520", "5.77", "+4.000"]
    same = result_of(identified(0.8, 0.02), gains=gains[::2])
    assert [tables(each)[0].columns[allowed].file_only for each in (result, same)] == [False, True]


def test_plots_show_two_deviations_in_percent_of_the_gain():
    result = result_of(REFUSED, identified(-0.8, 0.012, payload=0.02))
    plot = plot_of(result, "Interval of each gain")
    assert plot.y == "Gain [% from the gain]"
    # hypot(0.012, 0.02 * 0.8) = 0.02, of which two: 5 % of 0.8.
    assert intervals_of(plot) == [{2: pytest.approx((0.0, -5.0, 5.0), abs=1e-9)}]
    rest = dict.fromkeys(CostJoint.model_fields)
    joints = [CostJoint(**{**rest, "joint": j, "assumed_gain": gain}) for j, gain in ((1, 3.0), (2, -0.5))]
    cost = ResultCost.model_construct(joints=joints, payload=[MASS], arm=[], tolerance=None, passed=None)
    plot = plot_of(result.model_copy(update={"cost": cost}), "Interval of each gain")
    assert intervals_of(plot) == [{2: pytest.approx((60.0, 52.0, 68.0), rel=1e-9)}]
    assert list(plot.figure().axes[0].lines[-1].get_ydata()) == [0.0, 0.0]  # the assumed gain
    gains = [verdict(1, **NONE, tolerance=0.03), verdict(2)]
    plot = plot_of(result_of(identified(0.8, 0.02), gains=gains), "Error of each gain")
    # The refused joint does not stretch the axis; 0.015 is 3 % of 0.5.
    error, tolerance = intervals_of(plot)
    assert error == {2: pytest.approx((4.0, -2.0, 10.0), rel=1e-9)}
    assert tolerance == {2: pytest.approx((0.0, -7.0, 7.0), rel=1e-9)}


def test_what_would_show_a_joint_follows_from_what_its_gain_was_refused_for():
    # A deviation falls with the torque, and with the root of the rows: 3.5 times, 12.25 times.
    enough = "its standard deviation is small enough"
    cases = (
        (0.35, r"3\.5 times the torque.* 12 times as many rows"),
        (None, "do not determine"),
        (0.04, enough),
        (0.105, r"with 1\.05 times the torque.* 1\.1 times as many rows"),
        (0.1, enough),  # as large as is allowed
        (1.04, "with 10 times the torque"),
    )
    refused = [RefusedGain(joint="b", reason="", predicted_rel_std=each) for each, _ in cases]
    parts = how_to_identify(result_of(identified(0.9, 0.01), *refused).gains, 0.1)[1:]
    for joint, (part, (_, words)) in enumerate(zip(parts, cases, strict=True), 2):
        assert re.match(rf"Joint {joint}: .*{words}", part.text)


def test_gains_that_are_kept_beside_a_fault_are_told_with_what_it_does_to_them():
    def result(said: Diagnosed) -> Result:
        found = gain_estimate(None, 4.4, 5.5, std=0.1, reason="")
        return Result.of_identification(Identification(found, (), said), 0.1)

    def wrong(*effects: tuple[int, float, float]) -> Diagnosis:
        each = tuple(Effect(joint=j, percent=percent, deviations=z) for j, percent, z in effects)
        return replace(DOUBT, severity=Severity.WRONG, effects=each)

    both = (wrong((0, -8.1, -6.0), (1, 0.41, 1.4)), wrong((0, -9.3, -7.0), (1, -0.62, -2.1), (2, 0.1, 0.3)))
    told = result(Diagnosed(diagnoses=both))  # joint 2 once, with the larger effect
    (kept,) = [text for text in texts(told) if text.startswith("Gains kept")]
    assert kept.endswith("by less than 3 standard deviations: joint 2 by -0.62 %.")
    assert not any(text.startswith("Gains kept") for text in texts(result(FOUND)))
    said, *_ = told.parts()
    assert re.match("2 of 3 gains .* % .worst: joint 2.; joint 1 refused because of a fault .*2 faults", said.text)
    assert said.mood is Mood.BAD


def test_programs_are_given_every_diagnosis_with_joints_from_1_and_it_is_read_back_as_it_was(tmp_path):
    found = Identification(gain_estimate(3.3, 4.4, 5.5, std=0.1, reason=""), ("clock jitters",), FOUND)
    result = Result.of_identification(found, 0.1)
    document = result.model_dump(mode="json")
    assert document["notes"] == ["clock jitters"]
    assert [each["joints"] for each in document["diagnoses"]] == [[3], []]
    assert [each["joint"] for each in document["diagnoses"][0]["effects"]] == [3, 2]
    (tmp_path / RESULT).write_text(to_json(document))
    again = read_result(tmp_path, Result)
    assert again == result
    assert again.found == FOUND


def test_the_motion_of_a_joint_has_its_unit(arm):
    span = arm.upper[1] - arm.lower[1]
    motion = JointMotion(
        low=float(arm.lower[1] + 0.25 * span), high=float(arm.lower[1] + 0.75 * span), covered=0.5, speed=1.0,
        speed_rms=0.5, acceleration_rms=2.0, slow=0.1, current_rms=3.0,
    )  # fmt: skip
    large = CheckLog.of("log", [replace(motion, current_rms=123.4)] * arm.n, arm)
    assert motion_parts([large])[1].rows[0][-1].text == "123"  # and no "123."
    rail = replace(arm, revolute=np.arange(arm.n) != 1)
    both = CheckLog.of("log", [motion] * 2, rail)
    _, table = motion_parts([both])
    both = ["rad, m", "rad, m", "%", "rad/s, m/s", "rad/s^2, m/s^2", "% of time", "units"]
    assert [column.unit for column in table.columns] == ["", "", *both]


NAMES = ("mass", "x", "y", "z", "ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def outcome(mass: float, std: float, *alone: tuple[float, float], gains: tuple[float, ...]) -> SimpleNamespace:
    """An outcome of two joints, with only the mass identifiable."""
    found = SimpleNamespace(value=mass, std=std)
    weighed = SimpleNamespace(
        payload=Payload(mass=5.0, mass_std=0.01, known="mass"),
        body=SimpleNamespace(of=lambda name: found if name == "mass" else None),
        joints=[SimpleNamespace(mass=value, std=each) for value, each in alone],
    )
    k = len(gains)
    known = KnownGains(names=("a", "b")[:k], joints=np.arange(k), value=np.array(gains), covariance=np.zeros((k, k)))
    return SimpleNamespace(weighed=weighed, gains=known)


def test_gains_are_compared_with_assumed_ones_at_the_same_current():
    mine, its = (
        GainCurve(current=each, largest=9.0, slope=0.03, by_sign=0.02, covariance=((0.0,) * 3,) * 2) for each in (4, 7)
    )
    assumed = outcome(5.6, 0.12, (5.9, 0.2), gains=(2.0,))
    assumed.gains = replace(assumed.gains, curves={0: its})
    (joint,) = ResultCost.of(assumed, (replace(identified(1.7, 0.02), curve=mine),)).joints
    np.testing.assert_allclose(joint.rel_change, 1.7 / (2.0 * 1.09) - 1.0, rtol=1e-12)


def test_estimates_with_either_gains_keep_their_own_deviations():
    joints = (identified(0.8, 0.02), RefusedGain(joint="b", reason="light", predicted_rel_std=None))
    assumed = outcome(5.6, 0.12, (5.9, 0.2), (4.0, 0.3), gains=(1.0, 1.1))
    arm = SimpleNamespace(quantity="inertias of the arm", assumed=0.3, assumed_std=0.11, found=0.05, found_std=0.02)
    verdict = SimpleNamespace(
        found=outcome(5.02, 0.03, (5.1, 0.07), (4.9, 0.09), gains=(0.8,)), arm=(arm,), tolerance=0.02, passed=True,
        torque_assumed={0: 0.21}, torque_found={0: 0.013}, true=dict.fromkeys(NAMES, 4.97),
    )  # fmt: skip
    cost = ResultCost.of(assumed, joints, verdict)
    mass = cost.payload[0]
    assert (mass.assumed, mass.assumed_std, mass.found, mass.found_std) == (5.6, 0.12, 5.02, 0.03)
    assert (mass.true, mass.stated) == (4.97, 5.0)
    first, second = cost.joints
    np.testing.assert_allclose(first.rel_change, 0.8 / 1.0 - 1.0, rtol=1e-12)
    assert (second.gain, second.rel_change) == (None, None)
    assert (first.assumed_torque_error, first.found_torque_error) == (0.21, 0.013)
    said, (weights, errors, alone, _) = cost.verdict(), cost.parts("N m/unit")
    # The joint whose mass is off by most beyond two deviations: 4.97 - 4.0 - 0.6 and 5.9 - 4.97 - 0.4.
    assert said.text == (
        "PASSED: the payload of 4.97 kg: with the assumed gains 5.600 kg (+13 %) from all joints, 5.900 kg (+19 %) "
        "from joint 1 alone; with identified gains 5.020 kg (+1 %), tolerance 2 %."
    )
    for table, row in (
        (weights, ["mass", "5.60", "0.24", "5.020", "0.060", "4.970", "kg"]),
        (errors, ["inertias of the arm", "30.0", "22.0", "5.0", "4.0"]),
        (alone, ["1", "1.0000", "0.8000", "-20.0", "5.900", "0.400", "5.100", "0.140", "21.0", "1.3"]),
    ):
        assert [cell.text for cell in table.rows[0]] == row
    # Off 4.97 kg by 0.93 and 0.13, by -0.97 and -0.07; two deviations of 0.2 and 0.07, of 0.3 and 0.09.
    ends = [[(93, 53, 133), (-97, -157, -37)], [(13, -1, 27), (-7, -25, 11)]]
    assert intervals_of(cost.plot_of_masses()) == [
        {j: pytest.approx([x / 4.97 for x in each], rel=1e-9) for j, each in enumerate(own, 1)} for own in ends
    ]
    same = ResultCost.of(assumed, joints)
    assert (same.passed, same.payload[0].true, same.payload[0].found) == (None, None, None)
    said, weights, alone, _ = same.parts("N m/unit")
    assert said.text.startswith("The payload of 5 kg: with the assumed gains 5.600 kg (+12 %)")
    assert [cell.text for cell in weights.rows[0]] == ["mass", "5.60", "0.24", "5.00", "kg"]
    assert len(alone.columns) == 6


def test_an_identification_prints_its_gains_with_two_deviations_its_refusals_and_its_findings():
    estimate = replace(gain_estimate(1.0, 1.0, std=0.1, reason=""), joints=(identified(0.8, 0.02), REFUSED))
    first, one, two, last = repr(Identification(estimate, (), FOUND)).splitlines()
    assert first == f"Identification by {estimate.method}: 1 of 2 gains, +- 2 sigma"
    assert one == "  joint 1: 0.8 +- 0.04 N (m)/unit"
    assert two == "  joint 2: too light"
    assert last == "  weak: the zero of q3 is off by 2 degrees"


def test_sources_of_a_run_are_the_noises_that_the_scenario_has_without_a_size_of_their_own():
    noise, sized, drawn = (
        SimpleNamespace(stream=stream, size=size) for stream, size in (("a", None), ("b", 0.3), (None, None))
    )
    said = "Errors simulated: hiss (1 of 3 sources; rx90 predict estimates the others)"
    assert sources_simulated({"hiss": noise, "clock": sized, "tilt": drawn}) == said
    assert sources_simulated({"tilt": drawn}).startswith("Errors simulated: none (0 of 1 ")
    assert sources_simulated({}) is None
