"""Drives that cannot bear a motion are found on its reference, and nothing is simulated."""

import numpy as np
import pytest
from plants import experiment, nominal_plant

from sim.compile import bare_arm
from sim.controller import inverse_dynamics
from sim.effects import ModelErrors
from sim.errors import Saturated
from sim.feedforward_currents import check_torque_limits
from sim.trajectory import FourierTrajectory

HOME = np.array([[0.2, 0.3, 1.0, 0.1, 0.4, -0.2]])
STILL = FourierTrajectory(HOME[0], np.zeros((6, 2)), np.zeros((6, 2)), 0.5)
SOFT = ModelErrors(joint_compliance=(1e-5,) * 6, backlash=0.01)


def held(loaded: bool) -> np.ndarray:
    """Currents that hold the arm where it is [drive units], shape (6,): gravity, by MuJoCo, over the gain."""
    plant = nominal_plant()
    robot, drives = plant.robot, plant.drives
    model = bare_arm(robot.model, drives.rotor_inertia, robot.flange, plant.payload if loaded else None)
    torque = inverse_dynamics(model, HOME, np.zeros((1, 6)), np.zeros((1, 6)))[0]
    return drives.amplifier_offset + (torque + drives.coulomb_asymmetry) / drives.gain


@pytest.mark.parametrize("loaded", [False, True])
@pytest.mark.parametrize("errors", [None, SOFT])
def test_a_drive_may_need_less_than_its_largest_current_and_no_more(loaded, errors):
    need, limit = np.abs(held(loaded)), nominal_plant().drives.current_limit.copy()
    for share, joint in ((1.001, 2), (0.999, 2)):
        limit[joint - 1] = share * need[joint - 1]
        e = experiment(plant=nominal_plant(current_limit=limit, errors=errors), trajectory=STILL, loaded=loaded)
        if share > 1.0:
            check_torque_limits([e])
    advice = "use a lighter payload or a slower motion" if loaded else "motion: drive.*; use a slower motion"
    said = rf"drive of joint2 would need up to {need[1]:.4g} where its limit is {limit[1]:g}, for more than 0\.1 s from"
    with pytest.raises(Saturated, match=said):
        check_torque_limits([e])
    with pytest.raises(Saturated, match=advice):
        check_torque_limits([e])


def test_the_motion_that_cannot_be_borne_is_named():
    limit = 0.5 * (np.abs(held(False)) + np.abs(held(True)))  # between bare and loaded
    limit[[0, 2, 3, 4, 5]] = 1e3
    plant = nominal_plant(current_limit=limit)
    moves = [experiment(name=name, plant=plant, trajectory=STILL, loaded=name == "heavy") for name in ("bare", "heavy")]
    check_torque_limits(moves[:1])
    with pytest.raises(Saturated, match=r"^heavy: drive of joint2 "):
        check_torque_limits(moves)
