"""How well gains would come out: predicted deviations, and what is said of them."""

from dataclasses import replace

import numpy as np
from consistency_logs import LOOSE, joint_by_joint
from known_logs import BRICK
from real_friction import GAIN

from ident.diagnosis.diagnosis import Severity
from ident.diagnosis.joint_fits import excitation, predicted_rel_std
from ident.estimation.gain_options import GainOptions
from ident.payload.payload import Payload

GAINS = GainOptions()


def test_the_deviation_that_is_predicted_is_that_of_the_loaded_motion(sound):
    """The same motion, recorded with the payload, gives deviations of the same size by the estimator itself."""
    bare = sound.problem.motions[0].observation
    predicted = predicted_rel_std(bare, BRICK, np.abs(GAIN), GAINS)
    expected = [joint.predicted_rel_std for joint in joint_by_joint(sound.problem).joints]
    # The loaded motion is another, of larger currents, and 5 % of them is the floor.
    np.testing.assert_allclose(predicted, expected, rtol=0.5)
    assert predicted_rel_std(bare, BRICK, GAIN, GAINS) == predicted  # one is wired backwards


def test_a_lighter_payload_makes_deviations_larger_in_proportion(sound):
    bare = sound.problem.motions[0].observation
    heavy = Payload(mass=4.2, com=(0.05, -0.02, 0.11), known="com")
    light = replace(heavy, mass=0.7)
    found = [predicted_rel_std(bare, each, np.abs(GAIN), LOOSE) for each in (heavy, light)]
    # The torque of the known part goes with the mass at a given centre; the residual is of the bare motion.
    np.testing.assert_allclose(np.divide(found[1], found[0]), 6.0, rtol=1e-6)


def test_joints_whose_gain_would_not_be_good_enough_are_listed():
    options = replace(GAINS, max_rel_std=0.07)
    found = excitation("bare", (0.0123, None, 0.071, 0.069, 0.5), options)
    assert (found.severity, found.logs, found.joints) == (Severity.WEAK, ("bare",), (1, 2, 4))
    assert found.sentence.endswith("joint by joint: 1.2, -, 7.1, 6.9, 50 %")
    assert str(found.advice).startswith("for joint 2, 3, 5, mount")
    found = excitation("bare", (0.0123, 0.069), options)
    assert (found.severity, found.advice, found.joints) == (Severity.GOOD, None, ())
