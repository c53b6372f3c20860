import re
from dataclasses import replace

import numpy as np
import pytest
from plants import CYLINDER, RX90, nominal_plant
from robot_folders import arm_xml, robot_folder

from ident.model.arm import load_arm
from ident.model.structure import Structure, structure_of
from ident.payload.payload import Payload
from scenarios.design.excitation import EXCESS, Design, Limits, Problem, arm_model, robot_limits, worst_of
from scenarios.prediction.deviations import Carried, joint_by_joint
from sim.controller import inverse_dynamics
from sim.errors import TrajectoryError
from sim.plant import Plant, bare_arm
from sim.robot import read_robot
from sim.trajectory import FourierTrajectory, at_rest

WANTED = np.arange(3)


@pytest.fixture(scope="module")
def plant():
    body = replace(CYLINDER, com=(0.05, -0.03, 0.14), inertia=(0.0125, 0.0118, 0.009, 0.0006, -0.0004, 0.0003))
    return nominal_plant(body, gain=np.array([-0.9, 1.2, 1.1, 0.8, -1.3, 1.4]))


def problem(plant: Plant, structure: Structure, limits: Limits, joints: np.ndarray = WANTED) -> Problem:
    body = plant.payload
    believed = Payload(mass=body.mass, com=body.com, inertia=body.inertia)
    return Problem(
        plant=plant,
        structure=structure,
        limits=limits,
        joints=joints,
        carried=Carried.of(body, believed),
        prediction=joint_by_joint,
    )


def motion(scale: float = 1.0, duration: float = 6.0) -> FourierTrajectory:
    rng = np.random.default_rng(2)
    return at_rest(RX90.home, *(0.11 * scale * rng.normal(size=(2, 6, 3))), duration)


def test_limits_are_the_robot_s_and_torques_those_of_its_true_gains_whatever_their_sign(plant):
    limits = robot_limits(plant)
    np.testing.assert_array_equal(limits.torque, np.abs(plant.drives.gain) * plant.drives.current_limit)
    assert (limits.torque > 0).all()
    np.testing.assert_array_equal(limits.velocity, RX90.max_velocity)
    np.testing.assert_array_equal(limits.acceleration, RX90.max_acceleration)
    np.testing.assert_allclose(np.rad2deg(limits.lower), [-160, -137.5, -142.5, -270, -105, -270], rtol=1e-12)
    np.testing.assert_allclose(np.rad2deg(limits.upper), [160, 137.5, 142.5, 270, 120, 270], rtol=1e-12)


def excess_of(plant, structure, limits: Limits) -> np.ndarray:
    design, path = Design(problem(plant, structure, limits)), motion()
    return design.excess(design.rows(path, 50.0))


def test_a_motion_inside_its_limits_has_no_excess_and_each_limit_that_is_broken_counts_by_its_share(plant, structure):
    limits, path = robot_limits(plant), motion()
    assert not excess_of(plant, structure, limits).any()
    design = Design(problem(plant, structure, limits))
    rows = design.rows(path, 50.0)
    (q, dq, ddq), torque = rows.motion, rows.torques(design.problem.carried.chi)
    center = 0.5 * (limits.upper + limits.lower)
    reach = np.abs(q - center).max(axis=0)
    cases = {  # a limit that the motion meets at its full size is used to 100 %, and these shares are allowed
        "velocity": (np.abs(dq).max(axis=0), 0.95),
        "acceleration": (np.abs(ddq).max(axis=0), 0.95),
        "torque": (np.abs(torque).max(axis=(0, 1)), 0.8),
    }
    for name, (used, share) in cases.items():
        for factor, expected in ((1.02 / share, 0.0), (1.0, 1.0 - share), (0.5, 2.0 - share)):
            over = excess_of(plant, structure, replace(limits, **{name: factor * used}))
            np.testing.assert_allclose(over.max(), expected, rtol=0, atol=1e-12)  # rounding of a ratio
    over = excess_of(plant, structure, replace(limits, lower=center - reach, upper=center + reach))
    np.testing.assert_allclose(over.max(), 0.1, rtol=0, atol=1e-12)


def test_the_torque_of_the_bare_arm_has_friction_and_offsets_of_its_drives(plant, structure):
    offset, asymmetry = np.array([0.3, -0.2, 0.5, 0.1, -0.4, 0.7]), np.array([-2.0, 3.0, 1.0, 0.5, 0.4, -0.3])
    drives = replace(plant.drives, amplifier_offset=offset, coulomb_asymmetry=asymmetry)
    rows = arm_model(replace(plant, drives=drives), structure).rows(motion(), 7.0)
    q, dq, ddq = rows.motion
    rigid = inverse_dynamics(bare_arm(RX90.model, drives.rotor_inertia, RX90.flange), q, dq, ddq)
    friction = drives.viscous_friction * dq + drives.coulomb_friction * np.sign(dq)
    np.testing.assert_allclose(rows.rigid, rigid, rtol=0, atol=1e-9)  # N m, of some hundred
    np.testing.assert_allclose(rows.bare, rigid + friction + drives.gain * offset + asymmetry, rtol=0, atol=1e-9)


def test_the_cost_is_the_log_of_the_wanted_deviations_mostly_of_the_worst_and_thirty_times_the_excess(plant, structure):
    limits, path = robot_limits(plant), motion()
    free = Design(problem(plant, structure, limits))
    rel = free.deviations(free.rows(path, 10.0)).total[WANTED]
    expected = np.log((rel**8).sum() ** 0.125) + 0.2 * np.mean(np.log(rel))
    np.testing.assert_allclose(free.cost(path), expected, rtol=1e-12)  # rounding
    slow = Design(problem(plant, structure, replace(limits, velocity=0.1 * limits.velocity)))
    over = slow.excess(slow.rows(path, 10.0))
    assert over.any()
    np.testing.assert_allclose(slow.cost(path) - free.cost(path), 30.0 * (over**2).sum() / 10.0, rtol=1e-9)


def test_a_motion_a_little_too_fast_is_shrunk_and_one_far_too_fast_is_refused(plant, structure):
    path, limits = motion(), robot_limits(plant)
    fastest = np.abs(path(np.arange(0.0, path.duration, 1 / 200.0))[1]).max(axis=0)
    roomy = replace(limits, velocity=fastest / (0.95 + EXCESS) / 1.001 * 0.96)  # 4 % too fast
    fitted = Design(problem(plant, structure, roomy)).fitted(path)
    shrunk = fitted.sine / path.sine
    assert (shrunk == shrunk[0, 0]).all() or np.ptp(shrunk) < 1e-12
    assert 0.9 < shrunk.mean() < 0.975
    np.testing.assert_array_equal(fitted.center, path.center)
    said = r"even scaled to 91 %, the motion takes 182 % of the speed of joint joint\d, where 95 % may"  # 2 * 0.91
    with pytest.raises(TrajectoryError, match=said):
        Design(problem(plant, structure, replace(limits, velocity=0.5 * fastest))).fitted(path)


def test_the_largest_excess_is_named_with_its_joint():
    for kind, (name, may) in enumerate([("range", 90), ("speed", 95), ("acceleration", 95), ("torque", 80)]):
        excess = np.full((4, 5, 3), 0.02)
        excess[kind, 3, kind % 3] = 0.07
        used = f"takes {may + 7} % of the {name} of joint {'bsw'[kind % 3]}, where {may} % may be used"
        assert worst_of(excess, ("b", "s", "w")) == used


@pytest.mark.parametrize("weight", [1.0, 1e-4])
def test_a_model_that_identification_and_simulation_read_differently_is_refused_however_light_the_arm(tmp_path, weight):
    robot = read_robot(robot_folder(tmp_path, 2))
    drives = replace(robot.drives, rotor_inertia=weight * robot.drives.rotor_inertia)
    plant = Plant(robot=robot, drives=drives, payload=CYLINDER)

    def lighter(found: re.Match[str]) -> str:
        return f'{found[1]}="{" ".join(str(weight * float(x)) for x in found[2].split())}"'

    robot.model.write_text(re.sub(r'(mass|fullinertia)="([^"]*)"', lighter, arm_xml(2)))
    arm = load_arm(robot.model)
    assert arm_model(plant, structure_of(arm)).chi.shape == (28,)
    bent = replace(arm, axis=np.array([[0.0, 0.0, 1.0], [0.0, np.cos(1e-3), np.sin(1e-3)]]))
    with pytest.raises(TrajectoryError, match=r"read .*arm\.xml differently: torques differ by 0\.0\d+ %"):
        arm_model(plant, structure_of(bent))
