from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from plants import BELIEF, RX90, experiment, nominal_plant, short_motion, streams

import rx90_mjcf
from sim.controller import ControllerBelief, ControllerOptions, tuned
from sim.errors import PlantError
from sim.record import record
from sim.trajectory import at_rest


def test_the_feedforward_is_the_believed_arm_s_inverse_dynamics_over_the_believed_gain():
    gain = np.array([1.1, 0.9, -1.0, 1.2, 0.8, 1.0])
    motion, options = short_motion(), ControllerOptions()
    controller = tuned(replace(BELIEF, gain=tuple(gain.tolist())), motion, options)
    arm = pin.buildModelFromMJCF(str(rx90_mjcf.MJCF))
    arm.armature = np.array(BELIEF.rotor_inertia)
    data = arm.createData()
    for k in (0, 400, 1300):
        q, dq, ddq = (x[0] for x in motion(np.array([1e-3 * k])))
        torque = gain * (controller.reference[k] - controller.kp * q - controller.kd * dq)
        # Subtracting the position term, 1e4 N m, costs four digits of 16.
        np.testing.assert_allclose(torque, pin.rnea(arm, data, q, dq, ddq), rtol=0, atol=1e-9)


def test_one_motion_is_tabulated_once():
    motion, options = short_motion(), ControllerOptions()
    equal = ControllerBelief(mjcf=BELIEF.mjcf, gain=BELIEF.gain, rotor_inertia=BELIEF.rotor_inertia)
    assert tuned(BELIEF, motion, options) is tuned(equal, motion, ControllerOptions())
    assert tuned(BELIEF, short_motion(), options) is not tuned(BELIEF, motion, options)


def test_the_controller_does_not_know_the_true_rotors():
    # The first current depends on the controller alone: the arm has not moved yet.
    true, heavier = (nominal_plant(rotor_inertia=k * RX90.drives.rotor_inertia) for k in (1.0, 1.5))
    first, second = (record([experiment(plant=p)], streams(0), threads=1)[0] for p in (true, heavier))
    assert np.abs(first.q[500] - second.q[500]).max() > 1e-6
    exact = replace(experiment().sensors, current_white=0.0, current_coloured=0.0)
    v = [record([experiment(plant=p, sensors=exact)], streams(0), threads=1)[0].v[0] for p in (true, heavier)]
    np.testing.assert_array_equal(*v)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"gain": (1.0, 1.0)}, "2 gains and 6 rotor inertias; expected one per joint"),
        ({"gain": (1.0, 0.0, 1.0, 1.0, 1.0, 1.0)}, "has a zero; expected nonzero gains"),
    ],
)
def test_impossible_beliefs_are_refused(values, message):
    with pytest.raises(PlantError, match=message):
        replace(BELIEF, **values)


def test_a_belief_in_another_arm_is_refused():
    belief = replace(BELIEF, gain=(1.0, 1.0), rotor_inertia=(1.0, 1.0))
    with pytest.raises(PlantError, match="6 joints, but the controller's model has 2"):
        tuned(belief, short_motion(), ControllerOptions())


def test_a_motion_of_another_arm_is_refused():
    motion = at_rest(np.zeros(5), np.zeros((5, 2)), np.full((5, 2), 0.1), 2.0)
    with pytest.raises(PlantError, match="the motion moves 5 joints of an arm with 6"):
        tuned(BELIEF, motion, ControllerOptions())
