"""A payload's centre of mass that lies elsewhere than stated is found by all joints together, in millimetres."""

from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import evidence_of, joint_by_joint, logs_of, problem_of
from ident.consistency.centre import MATTERS, Shift, centre_shift, check_centre, per_metre
from ident.consistency.evidence import Evidence
from known_logs import BRICK
from real_friction import Truth
from scipy import stats

from ident.payload import Payload, standard_parameters
from ident.recording import Recording
from ident.structure import Structure

OFF = {"x": (0.02, 0.0, 0.0), "z": (0.0, 0.0, -0.02)}


@pytest.fixture(scope="module")
def logs() -> list[Recording]:
    return logs_of(Truth(), seed=2)


def stated(off: tuple[float, ...], **more: object) -> Payload:
    return replace(BRICK, com=tuple(np.add(BRICK.com, off)), **more)


def with_payload(axes: Structure, logs: list[Recording], payload: Payload) -> Evidence:
    return evidence_of(problem_of(axes, logs, (None, payload)))


def shift_of(evidence: Evidence, which: int = 0) -> Shift:
    found = centre_shift(evidence, which)
    assert found is not None
    return found


@pytest.mark.parametrize("off", OFF.values(), ids=OFF)
def test_the_shift_and_what_it_makes_of_the_gains_are_found(axes, logs, off):
    sound, wrong = with_payload(axes, logs, BRICK), with_payload(axes, logs, stated(off))
    found = shift_of(wrong)
    # Four deviations, and a tenth for what is of second order in 2 cm of a centre 14 cm away.
    assert (np.abs(found.value + off) < 4.0 * found.std + 0.1 * np.abs(off)).all()
    assert found.shown == 3
    made = sound.estimate.solution.inverse / wrong.estimate.solution.inverse - 1.0
    np.testing.assert_allclose(list(found.moved.values()), made, rtol=0.12, atol=4e-3)  # first order, and noise
    finding = check_centre(wrong)
    assert finding.failed
    assert finding.joint == 2
    moved = {j: abs(each) / wrong.rel_std(j) > MATTERS for j, each in found.moved.items()}
    assert moved == {j: f"joint {j + 1} by " in finding.sentence for j in range(3)}
    assert all(moved.values()) == (off == OFF["z"])
    assert "payload of 4.3 kg seems to lie elsewhere than stated, by x " in finding.sentence
    assert f"joint 3 by {100.0 * found.moved[2]:+.2g} %" in finding.sentence
    millimetres = " +- ".join(f"{1e3 * each[0]:{sign}.2g}" for each, sign in ((found.value, "+"), (found.std, "")))
    assert f"by x {millimetres}, y " in finding.sentence


def test_a_centre_as_stated_is_left_alone_and_so_is_one_as_uncertain_as_it_is_wrong(axes, logs):
    finding = check_centre(with_payload(axes, logs, BRICK))
    assert not finding.failed
    assert finding.statistic < finding.threshold == stats.chi2.isf(0.002, 3)
    unsure = check_centre(with_payload(axes, logs, stated(OFF["z"], com_std=(0.01, 0.01, 0.01))))
    assert not unsure.failed
    # 18 mm are 1.8 deviations of what is stated: noise of under a millimetre adds little.
    np.testing.assert_allclose(unsure.statistic, 1.8**2, rtol=0.2)


def test_each_joint_alone_shows_the_same_shift_together(axes, logs):
    payload = stated(OFF["x"])
    alone = shift_of(joint_by_joint(problem_of(axes, logs, (None, payload))))
    both = shift_of(with_payload(axes, logs, payload))
    assert (np.abs(alone.value - both.value) < 4.0 * both.std).all()  # of the larger of the two fits' deviations


def test_the_shift_is_that_of_a_fit_with_its_columns(axes, logs):
    # A second way: least squares of the weighted residual on all columns of the fit and the three of the shift.
    evidence = with_payload(axes, logs, BRICK)
    solution = evidence.estimate.solution
    rows = solution.rows
    P = rows.weight[:, None] * evidence.payload_currents([per_metre(BRICK)])
    both = np.hstack((rows.explained, P))
    found = np.linalg.lstsq(both, rows.weight * rows.residual)[0][-3:]
    shift = shift_of(evidence)
    # The fit weights rows by deviations of a step before its last.
    np.testing.assert_allclose(shift.value, found, rtol=1e-2, atol=1e-5)
    white = np.sqrt(np.diag(np.linalg.inv(both.T @ both))[-3:])  # of rows of unit deviation
    # Sums over stretches of unrelated residuals add as much again, more or less: forty of them.
    assert (shift.std > 1.15 * white).all()
    assert (shift.std < 2.0 * white).all()


def test_a_fit_that_is_no_least_squares_is_left_alone(axes, logs):
    evidence = with_payload(axes, logs, stated(OFF["x"]))
    solution = evidence.estimate.solution
    crooked = solution.influence + 0.01 * np.random.default_rng(5).normal(size=solution.influence.shape)
    estimate = replace(evidence.estimate, solution=replace(solution, influence=crooked))
    assert centre_shift(replace(evidence, estimate=estimate), 0) is None


def test_a_centre_is_tested_where_no_inertia_is_stated(axes, logs):
    assert check_centre(with_payload(axes, logs, stated(OFF["x"], known="com"))).failed


def test_columns_are_those_of_a_shift_by_a_metre_as_far_as_they_are_known():
    step = np.array([1e-6, -2e-6, 3e-6])
    given = (BRICK.mass, BRICK.inertia)
    moved = standard_parameters(given[0], BRICK.com + step, given[1]) - standard_parameters(
        given[0], BRICK.com, given[1]
    )
    np.testing.assert_allclose(per_metre(BRICK) @ step, moved, atol=1e-10)  # second order: 4.3 kg, 1e-11 m^2
    centre = per_metre(replace(BRICK, known="com", com_std=(0.3, 0.2, 0.1), mass_std=0.7))
    np.testing.assert_allclose(centre @ step, np.r_[np.zeros(6), moved[6:]], atol=1e-10)


def test_nothing_is_said_of_a_centre_that_nobody_stated(axes, logs):
    light = Payload(mass=BRICK.mass, known="mass")
    assert check_centre(with_payload(axes, logs, light)) is None


def test_of_two_payloads_the_one_that_is_off_is_named(axes):
    small = replace(BRICK, mass=2.6, com=(-0.03, 0.02, 0.13))
    logs = logs_of(Truth(), seed=3, payloads=(None, BRICK, small))
    wrong = replace(small, com=(-0.03, 0.02, 0.16))
    evidence = evidence_of(problem_of(axes, logs, (None, BRICK, wrong)))
    finding = check_centre(evidence)
    assert finding.failed
    assert "payload of 2.6 kg" in finding.sentence
    assert finding.threshold == stats.chi2.isf(0.001, 3)
    found = shift_of(evidence, 1)
    np.testing.assert_allclose(found.value[2], -0.03, rtol=0.35)  # the other payload holds the gains where they belong


def test_a_shift_that_moves_no_gain_by_its_deviation_is_not_worth_a_word(axes, logs):
    evidence = with_payload(axes, logs_of(Truth(), seed=3), stated((0.0, 0.02, 0.0)))
    finding = check_centre(evidence)
    assert finding.statistic > finding.threshold
    assert not finding.failed
