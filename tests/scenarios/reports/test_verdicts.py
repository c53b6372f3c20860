"""Sentences that results begin with: each has its number."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import ROOT

from ident.diagnosis.diagnosis import Diagnosed
from ident.estimation.joint_torque import JointTorque
from ident.payload_identification.payload_body import FoundBody, Quantity
from scenarios.design.new_robot import Given
from scenarios.design.robot_folder import Found, new_robot
from scenarios.experiments.gains_file import SLIDING, GainEntry, GainsFile
from scenarios.gains_in_use.results import torques
from scenarios.prediction.budget import Cost, PredictedBudget, PredictedBudgetJoint
from scenarios.rendering.content import Mood, Paragraph, Table, plus_minus
from scenarios.reports.new_robot import new_robot_report
from scenarios.reports.new_robot import verdict as robot_verdict
from scenarios.reports.payload_of import verdict as payload_verdict
from scenarios.reports.predict import _within, prediction_report
from scenarios.reports.torque import torque_report
from scenarios.results.gains import budget_verdict
from scenarios.results.unseen import ResultUnseen, UnseenJoint, unseen_verdict
from sim.trajectory import FourierTrajectory


@pytest.mark.parametrize(
    ("value", "spread", "text"),
    [
        (7.0531, 0.0482, "7.05 ± 0.05"),
        (7.0531, 0.0142, "7.053 ± 0.014"),
        (-0.00034, 0.00061, "-0.0003 ± 0.0006"),
        (4.2, 0.0996, "4.20 ± 0.10"),
        (1234.0, 23.0, "1234 ± 23"),
        (7.025, 0.0, "7.025"),
    ],
)
def test_a_number_is_rounded_by_what_it_may_be_off(value, spread, text):
    assert plus_minus(value, spread) == text


@pytest.mark.parametrize(
    ("joints", "text", "mood"),
    [
        (
            [(1, 0.022, 0.01, "elasticity"), (2, 0.0163, 0.01, "elasticity"), (4, 0.0178, 0.01, "drift")],
            "Expected error 1.6 to 2.2 % rms: no joint meets 1 %; elasticity dominates joints 1 and 2, drift joint 4.",
            Mood.BAD,
        ),
        (
            [(1, 0.022, 0.01, "white"), (2, 0.005, 0.03, "white"), (3, None, 0.03, None)],
            "Expected error 0.5 to 2.2 % rms: only joint 2 meets its tolerance; white dominates joints 1 and 2.",
            Mood.DOUBTFUL,
        ),
        (
            [(1, 0.022, 0.01, None), (2, 0.005, 0.03, None), (3, 0.006, 0.03, None)],
            "Expected error 0.5 to 2.2 % rms: all but joint 1 meet their tolerance.",
            Mood.DOUBTFUL,
        ),
        (
            [*((k, 0.022, 0.01, None) for k in (1, 3, 5)), (2, 0.005, 0.01, None), (6, 0.005, 0.01, None)],
            "Expected error 0.5 to 2.2 % rms: only joints 2 and 6 meet 1 %.",
            Mood.DOUBTFUL,
        ),
        ([(1, 0.005, 0.01, None)], "Expected error 0.5 % rms: every joint meets 1 %.", Mood.GOOD),
        ([(1, None, 0.01, None)], "No joint has a gain with all sources on.", Mood.BAD),
    ],
)
def test_a_budget_begins_with_the_error_to_expect_what_meets_its_tolerance_and_what_dominates(joints, text, mood):
    assert budget_verdict(joints) == Paragraph(text, mood, strong=True)


def test_a_predicted_budget_has_its_totals_first_and_sources_of_nothing_in_a_line():
    def cost(source: str, rms: float) -> Cost:
        return Cost(source=source, bias=-rms, std=0.0, rms=rms)

    joints = [
        PredictedBudgetJoint(
            joint=k,
            costs=[cost("tilt", 0.02), cost("drift", 0.004 * (k - 1)), cost("encoder", 1e-7), cost("ripple", 0.0)],
            together=cost("all together", 0.021),
            tolerance=0.03,
            within=0.9,
        )
        for k in (1, 2)
    ]
    budget = PredictedBudget(
        scenario="s", method="m", remarks=[], joints=joints, refused=[], unpredicted=[], excluded=[], untold=[]
    )
    verdict, table, nothing, *_ = prediction_report(budget, Diagnosed()).parts
    assert verdict.text == "Expected error 2.1 % rms: every joint meets 3 %; tilt dominates joints 1 and 2."
    sources = [row[0].text.strip() for row in table.rows]
    assert sources == ["all together", "of which bias", "tolerance", "within", "tilt", "drift"]
    assert nothing.text == "Below 0.0005 % on every joint: encoder, ripple."


def test_torques_are_told_with_rms_peak_and_interval_of_each_joint():
    tau = np.array([[3.0, -40.0], [-5.0, 30.0], [4.0, 0.0]])
    found = JointTorque(t=np.arange(3.0), joints=np.array([0, 2]), tau=tau, std=0.01 * np.abs(tau))
    gains = (
        GainEntry(joint=1, name="base", estimate=2.0, std=0.02),
        GainEntry(joint=2, identifiable=False, reason="too light"),
        GainEntry(joint=3, unit=SLIDING, estimate=9.0, std=0.09),
    )
    file = GainsFile(gains=gains)
    verdict, table, *rest = torque_report(torques(found, file, Path("tau.parquet")), found, file).parts
    assert verdict.text == "Peak 5.00 ± 0.10 N m on joint 1 and 40.0 ± 0.8 N on joint 3 (2 sigma)."
    assert isinstance(table, Table)
    assert [[cell.text for cell in row] for row in table.rows] == [
        ["1", "base", "4.08", "5.00", "0.10", "N m", "2.00"],  # root of 50 / 3
        ["3", "", "28.87", "40.00", "0.80", "N", "2.00"],  # root of 2500 / 3
    ]
    assert rest[-1].text == "Joint 2 has no column: too light."


def test_a_small_torque_keeps_the_digits_of_its_own_interval_and_a_torque_without_one_has_four():
    found = JointTorque(
        t=np.arange(2.0),
        joints=np.arange(2),
        tau=np.array([[400.0, 0.03], [400.0, 0.05]]),
        std=np.array([[2.0, 1e-4]] * 2),
    )
    file = GainsFile(gains=tuple(GainEntry(joint=j, estimate=1.0, std=0.01) for j in (1, 2)))

    def said(found: JointTorque) -> tuple[str, list[list[str]]]:
        verdict, table, *_ = torque_report(torques(found, file, Path("tau.parquet")), found, file).parts
        return verdict.text, [[cell.text for cell in row[2:5]] for row in table.rows]

    assert said(found)[1] == [["400.0", "400.0", "4.0"], ["0.04123", "0.05000", "0.00020"]]  # root of 34e-4 / 2
    without = replace(found, std=np.zeros((2, 2)))
    assert said(without) == ("Peak 400 N m on joint 1.", [["400.0", "400.0", "-"], ["0.04123", "0.05000", "-"]])


def test_a_payload_begins_with_its_mass_and_where_it_is():
    def quantity(name: str, unit: str, value: float, std: float) -> Quantity:
        return Quantity(name=name, unit=unit, value=value, residual_std=std, gain_std=0.0, model_std=0.0)

    mass, z = quantity("mass", "kg", 7.0531, 0.0241), quantity("z", "m", 0.1432, 0.0008)
    body = FoundBody(quantities=(mass, z), refused={}, possible=None)
    said = payload_verdict(body, Mood.PLAIN)
    assert said.text == "7.05 ± 0.05 kg (2 sigma); centre of mass at z 143.2 ± 1.6 mm."
    without = FoundBody(quantities=(z,), refused={}, possible=None)
    assert "do not determine the mass" in payload_verdict(without, Mood.PLAIN).text


@pytest.mark.parametrize(
    ("predicted", "text", "mood"),
    [
        ([0.0034, 0.0142], "2 of 2 gains are identifiable; predicted standard deviation 0.34 to 1.4 %.", Mood.GOOD),
        (
            [0.4, 0.0034, 0.5],
            "1 of 3 gains are identifiable, not of joints 1 and 3; predicted standard deviation 0.34 %.",
            Mood.DOUBTFUL,
        ),
        ([0.4, 0.5], "No gain is identifiable with this motion and payload.", Mood.BAD),
    ],
)
def test_a_new_robot_begins_with_the_gains_that_are_identifiable(predicted, text, mood):
    still = np.zeros((len(predicted), 3))
    motion = FourierTrajectory(still[:, 0], still, still, 1.0)
    said = robot_verdict(Found(motion=motion, predicted=np.array(predicted)))
    assert (said.text, said.mood, said.strong) == (text, mood, True)


def test_a_result_fails_by_what_the_payload_says_of_a_gain_alone():
    def result(error: float, std: float) -> ResultUnseen:
        joint = UnseenJoint(
            joint=3,
            rel_error=0.06,
            explained=0.9964,
            other_rel_error=None,
            fitted_rel_error=0.05,
            largest_rel_error=0.15,
            gain_rel_error=error,
            gain_rel_std=std,
        )
        return ResultUnseen(
            log="new.csv", loaded=True, verdict=None, rel_error=0.06, other_rel_error=None, joints=[joint],
            diagnoses=[], excluded=[], untold=[],
        )  # fmt: skip

    for error, std, passed, said in (
        (-0.21, 0.03, False, "FAILED: prediction error 6 % of the currents of new.csv"),
        (-0.21, 0.08, True, "Prediction error 6 %"),  # within three deviations
        (0.14, 0.02, True, "on this motion, gains are off by +14 % (joint 3)"),
    ):
        found = result(error, std)
        assert found.passed is passed
        told = unseen_verdict(found)
        assert said in " ".join(each.text for each in told)
        assert len(told) == (2 if error > 0.0 else 1)


@pytest.mark.parametrize(
    ("share", "mood"), [(0.951, Mood.GOOD), (0.949, Mood.DOUBTFUL), (0.501, Mood.DOUBTFUL), (0.499, Mood.BAD)]
)
def test_a_share_of_runs_within_the_tolerance_is_good_from_95_per_cent_and_bad_below_half(share, mood):
    assert _within(share).mood is mood


@pytest.mark.parametrize(("rated", "moods"), [(0.7, [Mood.DOUBTFUL]), (1.9, [])])
def test_a_payload_above_the_rated_load_is_a_warning_that_stands_out(tmp_path, rated, moods):
    new = new_robot(ROOT / "examples" / "arm.urdf", tmp_path, Given(rated_load=rated, payload=1.3))
    still = np.zeros((new.arm.n, 3))
    motion = FourierTrajectory(still[:, 0], still, still, 1.0)
    parts = new_robot_report(new, Found(motion=motion, predicted=np.full(new.arm.n, 0.01)), tmp_path).parts
    warnings = [part for part in parts if isinstance(part, Paragraph) and part.text.startswith("WARNING")]
    assert [part.mood for part in warnings] == moods
    assert all(part.text == "WARNING: payload: 1.3 kg is above the rated load, 0.7 kg." for part in warnings)
