"""What comes out with gains in use, held against what is put in: scaled gains, scaled weight, arm and torque."""

from dataclasses import replace

import numpy as np
import pytest
from exact import GAIN, TRUSTING, exact_problem
from refusals import refused
from weighings import NAMES, PLAIN, known

from ident.estimation.estimators.nls import all_joints_gains
from ident.estimation.known_gains import stated_gains
from ident.estimation.problem import Problem
from ident.parameters.arm import arm_in_use
from ident.parameters.weighing import UNKNOWN, outcome_of_other_gains, with_unknown_weight
from ident.payload.payload import Payload
from ident.support.errors import GainsError, NotIdentifiable, PayloadError

K = 1.2
# Held gains have a row of the prior of deviation 1e-6 or so, exact rows none: see test_payload_parameters.
CLOSE = 1e-4


@pytest.fixture(scope="module")
def two_weights(structure, heavy) -> tuple[Problem, np.ndarray]:
    """Exact motions bare, light and heavy, whose payloads are known, and the arm's base parameters."""
    rng = np.random.default_rng(8)
    chi = rng.uniform(0.5, 2.0, 84)
    light = replace(heavy, mass=3.1)
    problem = exact_problem(
        structure, [(chi, None, None), (chi, light, light), (chi, heavy, heavy)], GAIN, rng, options=TRUSTING
    )
    return problem, structure.base.regrouping @ chi


def test_friction_of_an_arm_in_use_is_that_of_its_first_motion_with_its_deviation(structure, rng):
    chi, names = rng.uniform(0.5, 2.0, 84), structure.base.names
    rubbed = chi.copy()
    rubbed.reshape(6, 14)[:, 11:13] *= 1.7
    motions = [(chi, None, None), (rubbed, None, None)]
    problem = exact_problem(structure, motions, GAIN, rng, noise=1e-3, options=TRUSTING)
    found = arm_in_use(problem, known(GAIN))
    base, C = found.in_si()
    for j, own in enumerate(found.friction):
        for each in own:
            name, _, motion = each.name.partition(" in motion ")
            if motion != "2":
                at = names.index(f"{name}{j + 1}")
                np.testing.assert_allclose(base[at], GAIN[j] * each.value, rtol=1e-12)
                np.testing.assert_allclose(np.sqrt(C[at, at]), abs(GAIN[j]) * each.std, rtol=1e-3)
    for each in found.inertial:
        at = names.index(each.name)
        np.testing.assert_allclose([base[at], np.sqrt(C[at, at])], [each.value, each.std], rtol=1e-3)


def test_the_heaviest_weight_is_found_again_without_what_is_known_of_it(two_weights, heavy):
    problem, expected = two_weights
    outcome = outcome_of_other_gains(problem, known(K * GAIN), PLAIN, all_joints_gains(problem, PLAIN))
    assert outcome.weighed.payload == heavy
    for each in (outcome.weighed.together, *outcome.weighed.joints):
        np.testing.assert_allclose(each.mass, K * heavy.mass, rtol=CLOSE)
    centre = [outcome.weighed.body.of(axis).value for axis in "xyz"]
    np.testing.assert_allclose(centre, heavy.com, atol=CLOSE)  # the same however the scale is off
    base = outcome.arm.in_si()[0]  # friction included
    np.testing.assert_allclose(base, K * expected, atol=CLOSE * np.abs(base).max())
    asked = with_unknown_weight(problem, [problem.motions[1]])
    assert [motion.payload for motion in asked.motions] == [None, UNKNOWN]
    assert asked.motions[1].observation is problem.motions[1].observation


def test_motions_that_weigh_nothing_are_refused(two_weights, structure):
    problem, _ = two_weights
    for motions, said in ((problem.motions[:1], "no motion carries a payload"), (problem.motions[1:], "no motion is")):
        refused(NotIdentifiable, said, outcome_of_other_gains, replace(problem, motions=motions), known(), PLAIN, "")
    nothing = tuple(
        motion if motion.payload is None else replace(motion, payload=Payload(mass=2.0, known="none"))
        for motion in problem.motions[:2]
    )
    with pytest.raises(PayloadError, match="a verification needs its mass"):
        outcome_of_other_gains(replace(problem, motions=nothing), known(), PLAIN, "")


def test_stated_gains_are_exact_and_one_a_joint(structure):
    gains = stated_gains(structure.arm, GAIN.tolist())
    assert gains.names == structure.arm.joint_names
    assert gains.joints.tolist() == list(range(len(NAMES)))
    np.testing.assert_array_equal(gains.value, GAIN)
    assert not gains.covariance.any()
    refused(GainsError, r"5 gains, but robot \w+ has 6 joints", stated_gains, structure.arm, GAIN[:5])
    refused(GainsError, "joint 2: a gain of 0", stated_gains, structure.arm, [1.0, 0.0, 1.0, 1.0, 1.0, 1.0])
