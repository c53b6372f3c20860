from contextlib import nullcontext

import numpy as np
import pytest
from exact import drive_gains, exact_pair, exact_problem, values

from ident.diagnosis.plausibility import check_load, check_positions, prediction_warnings
from ident.estimation.problem import GainOptions
from ident.recordings.recording import Recording
from ident.support.errors import NotIdentifiable, RecordingError

GAIN = np.array([0.94, 0.96, 1.11, 0.91, 1.0, -1.0])


@pytest.fixture(scope="module")
def motions(structure, heavy):
    """Bare, loaded, and bare again, with 2 % noise."""
    rng = np.random.default_rng(7)
    chi = rng.uniform(0.5, 2.0, 84)
    given = [(chi, each, each) for each in (None, heavy, None)]
    return [each.observation for each in exact_problem(structure, given, GAIN, rng, noise=0.02, rows=400).motions]


def log(q: np.ndarray, name: str = "log") -> Recording:
    t = 0.01 * np.arange(len(q))
    return Recording(t, q, np.sin(t)[:, None] + np.zeros(q.shape[1]) + 0.01 * t[:, None], name)


LOADS = {
    "bare and loaded recordings are probably swapped": (1, 0, 0.5, True),
    "finds no torque of the payload on any joint; was it mounted": (0, 2, 0.5, True),
    "no drive gain can be identified; joint 1: predicted standard deviation": (0, 1, 1e-9, True),
    "identified without a bare motion: record one with nothing on the flange": (0, 1, 1e-9, False),
    "without a bare motion the torque of the payload is not identifiable: record one": (0, 2, 0.5, False),
}
"""By refusal: the motions given as bare and as loaded, the largest deviation of a gain, whether one is bare."""


@pytest.mark.parametrize("refusal", LOADS)
def test_motions_without_the_load_that_is_stated_are_refused_and_others_pass(motions, heavy, refusal):
    one, other, most, bare = LOADS[refusal]
    options = GainOptions() if most == 0.5 else GainOptions(max_rel_std=most)
    with pytest.raises(NotIdentifiable, match=refusal):
        check_load(drive_gains(motions[one], motions[other], heavy, options), bare=bare)
    check_load(drive_gains(motions[0], motions[1], heavy, GainOptions()))


def test_an_arm_with_every_drive_wired_backwards_is_not_taken_for_swapped_files(structure, heavy, rng):
    motions = exact_pair(structure, heavy, -np.abs(GAIN), rng, noise=0.02, rows=400)
    estimate = drive_gains(*motions, heavy, GainOptions())
    check_load(estimate)
    assert estimate.identifiable[:5].all()
    assert (values(estimate)[estimate.identifiable] < 0.0).all()


def test_joints_without_significant_friction_do_not_say_whether_files_are_swapped(structure, heavy, rng):
    chi = rng.uniform(0.5, 2.0, 84)
    chi.reshape(6, 14)[[0, 3, 4], 11:13] = 0.0
    gain = np.array([-2.1, 1.7, -0.8, 3.3, -1.4, 0.6])
    problem = exact_problem(structure, [(chi, None, None), (chi, heavy, heavy)], gain, rng, noise=0.02, rows=400)
    bare, loaded = (each.observation for each in problem.motions)
    check_load(drive_gains(bare, loaded, heavy, GainOptions()))
    with pytest.raises(NotIdentifiable, match="probably swapped"):
        check_load(drive_gains(loaded, bare, heavy, GainOptions()))


def test_positions_beyond_the_range_of_a_joint_are_refused_and_those_within_its_slack_are_not(arm):
    q = 1.2 * np.sin(np.arange(200)[:, None] / 30 + np.arange(6))
    check_positions(arm, log(q))
    low, high = arm.lower[2] - q[:, 2].min(), arm.upper[2] - q[:, 2].max()
    cases = [(2, low - 0.11, True), (2, low - 0.09, False), (2, high + 0.09, False), (2, high + 0.11, True)]
    for j, off, refused in (*cases, (4, 3.0, True)):  # 0.1 rad of slack; 4.2 rad are no degrees
        moved = log(q + np.where(np.arange(6) == j, off, 0.0))
        said = rf"q{j + 1} runs from .* range {arm.lower[j]:.4g} to {arm.upper[j]:.4g} rad of joint{j + 1}; check m"
        with pytest.raises(RecordingError, match=said) if refused else nullcontext():
            check_positions(arm, moved)
    with pytest.raises(RecordingError, match=r"log: q1 runs from -68.* looks like degrees"):
        check_positions(arm, log(np.rad2deg(q)))
    with pytest.raises(RecordingError, match="log: 5 joints, but robot rx90 has 6"):
        check_positions(arm, log(q[:, :5]))


def test_a_joint_that_the_other_parts_of_the_motions_do_not_predict_is_warned_of():
    words = prediction_warnings({0: 0.09, 1: 0.149, 2: 0.151, 3: 0.63})
    assert [each.partition(",")[0] for each in words] == [
        "joint 3: the current is predicted with an error of 15 % (good recordings: up to 10 %)",
        "joint 4: the current is predicted with an error of 63 % (good recordings: up to 10 %)",
    ]
