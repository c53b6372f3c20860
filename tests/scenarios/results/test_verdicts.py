"""Sentences that results begin with: each has its number."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ident.estimation.joint_torque import JointTorque
from ident.unseen import Unseen, UnseenJoint
from scenarios.gains_in_use.known_gains import Torques
from scenarios.gains_in_use.weighing import FoundPayload, Quantity
from scenarios.rendering.content import Mood, Paragraph, Table
from scenarios.results.diagnoses import unseen_verdict
from scenarios.results.gains import budget_verdict
from scenarios.results.gains_file import SLIDING, GainEntry, GainsFile


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


def test_torques_are_told_with_rms_peak_and_interval_of_each_joint():
    tau = np.array([[3.0, -40.0], [-5.0, 30.0], [4.0, 0.0]])
    found = JointTorque(t=np.arange(3.0), joints=np.array([0, 2]), tau=tau, std=0.01 * np.abs(tau))
    gains = (
        GainEntry(joint=1, name="base", estimate=2.0, std=0.02),
        GainEntry(joint=2, identifiable=False, reason="too light"),
        GainEntry(joint=3, unit=SLIDING, estimate=9.0, std=0.09),
    )
    file = GainsFile(gains=gains)
    verdict, table, *rest = Torques.of(found, file, Path("tau.parquet")).parts()
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
        verdict, table, *_ = Torques.of(found, file, Path("tau.parquet")).parts()
        return verdict.text, [[cell.text for cell in row[2:5]] for row in table.rows]

    assert said(found)[1] == [["400.0", "400.0", "4.0"], ["0.04123", "0.05000", "0.00020"]]  # root of 34e-4 / 2
    without = replace(found, std=np.zeros((2, 2)))
    assert said(without) == ("Peak 400 N m on joint 1.", [["400.0", "400.0", "-"], ["0.04123", "0.05000", "-"]])


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
    assert "do not determine the mass" in payload(z).verdict().text


def test_a_result_fails_by_what_the_payload_says_of_a_gain_alone():
    def result(error: float, std: float) -> Unseen:
        joint = UnseenJoint(
            joint=2,
            rel_error=0.06,
            explained=0.9964,
            other_rel_error=None,
            fitted_rel_error=0.05,
            largest_rel_error=0.15,
            gain_rel_error=error,
            gain_rel_std=std,
        )
        return Unseen(log="new.csv", loaded=True, verdict=None, rel_error=0.06, other_rel_error=None, joints=(joint,))

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
