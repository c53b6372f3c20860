"""Sentences that results begin with: each has its number."""

from pathlib import Path

import numpy as np
import pytest

from ident.diagnosis.diagnosis import Diagnosed
from ident.estimation.joint_torque import JointTorque
from ident.payload_identification.payload_body import FoundBody, Quantity
from scenarios.design.new_robot import Found
from scenarios.experiments.files.gains import SLIDING, GainEntry, GainsFile
from scenarios.gains_in_use.results import torques
from scenarios.prediction.budget import Cost, PredictedBudget, PredictedBudgetJoint
from scenarios.reports.content import Mood, Paragraph, Table, plus_minus
from scenarios.reports.gains import budget_verdict
from scenarios.reports.new_robot import verdict as robot_verdict
from scenarios.reports.payload_of import verdict as payload_verdict
from scenarios.reports.predict import _within, prediction_report
from scenarios.reports.torque import torque_report
from scenarios.reports.unseen import unseen_verdict
from scenarios.results.models.unseen import ResultUnseen, UnseenJoint
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
            "Expected error 0.5 to 2.2 % rms: all but joints 1 and 3 meet their tolerance; "
            "white dominates joints 1 and 2.",
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
