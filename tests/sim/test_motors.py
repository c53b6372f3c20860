"""Motors that several joints turn: their currents by Pinocchio, and robots that differ in their units alone."""

from dataclasses import fields, replace

import numpy as np
import pytest
from pinocchio_arms import pinocchio_arm, rnea
from plants import BELIEF, RX90, experiment, nominal_plant, short_motion, streams
from refusals import refused

from sim.controller import ControllerBelief
from sim.effects import ModelErrors
from sim.errors import PlantError
from sim.experiment import Experiment
from sim.feedforward_currents import feedforward_currents, inertia_along
from sim.plant import plant_model
from sim.record import record
from sim.robot import DriveTruth, Robot
from sim.sensors import SensorOptions

WRIST = np.diag([1.0, -1.2, 1.0, 2.0, 1.0, 1.0])
WRIST[2, 1], WRIST[4:, 4:] = 0.8, ((0.7, 0.4), (0.6, -0.9))
UNITS, PLACE = np.array([2.0, 16.0, -0.5, 4.0, 1.0, 0.25]), [0, 1, 2, 4, 5, 3]
"""Positions of motors per position of their joints, powers of two, which round nothing; and the joint of each motor."""


def robot_with(A: np.ndarray) -> Robot:
    return RX90.model_copy(update={"coupling": [], "transmission": tuple(map(tuple, A.tolist()))})


def motion_of(A: np.ndarray, errors: ModelErrors | None = None, **drives: np.ndarray) -> Experiment:
    plant = replace(nominal_plant(errors=errors, **drives), robot=robot_with(A))
    believed = plant.robot.model_copy(update={"drives": replace(RX90.drives, **drives)})
    belief = ControllerBelief(robot=believed, gain=tuple(drives["gain"].tolist()) if "gain" in drives else BELIEF.gain)
    return experiment(plant=plant, belief=belief, trajectory=short_motion())


def test_currents_are_those_that_virtual_work_and_friction_of_the_motors_need():
    moved = motion_of(WRIST)
    t = np.arange(0.0, moved.trajectory.duration + 1e-9, 0.01)
    q, dq, ddq = moved.trajectory(t)
    arm = pinocchio_arm(payload=moved.loaded)
    joints = np.array([rnea(arm, *state) for state in zip(q, dq, ddq, strict=True)])
    drives, (turned, speed, pull) = moved.plant.drives, (x @ WRIST.T for x in (q, dq, ddq))
    tau = np.linalg.solve(WRIST.T, joints.T).T + drives.rotor_inertia * pull
    tau += drives.viscous_friction * speed + drives.coulomb_friction * np.sign(speed)
    expected = drives.amplifier_offset + (tau + drives.coulomb_asymmetry) / drives.gain
    (v,) = feedforward_currents([moved], 100.0)
    # Splines between torques, as for any robot.
    np.testing.assert_allclose(v, expected, rtol=0, atol=1e-4 * np.abs(expected).max())
    assert turned.shape == v.shape
    M = inertia_along(moved, 100.0)
    plain = inertia_along(replace(moved, plant=replace(moved.plant, robot=RX90)), 100.0)
    links = plain - np.diag(drives.rotor_inertia)
    work = WRIST.T @ (M - np.diag(drives.rotor_inertia)) @ WRIST
    np.testing.assert_allclose(work, links, rtol=0, atol=1e-9 * np.abs(links).max())


@pytest.mark.parametrize("errors", [None, ModelErrors(transmitted_friction=0.04, coulomb_drift=0.2, gain_by_sign=0.03)])
def test_a_robot_with_motors_in_other_units_and_places_has_the_same_currents(errors):
    own = {each.name: np.asarray(getattr(RX90.drives, each.name))[PLACE] for each in fields(DriveTruth)}
    plain = experiment(
        plant=nominal_plant(errors=errors), belief=replace(BELIEF, gain=tuple(RX90.drives.gain.tolist())), earlier=1,
        sensors=SensorOptions(),
    )  # fmt: skip
    for name in ("gain", "coulomb_asymmetry", "coulomb_friction"):
        own[name] = own[name] / (np.abs(UNITS) if name == "coulomb_friction" else UNITS)
    for name in ("rotor_inertia", "viscous_friction"):
        own[name] = own[name] / UNITS**2
    turned = replace(motion_of(UNITS[:, None] * np.eye(6)[PLACE], errors, **own), earlier=1, sensors=SensorOptions())
    one, other = record([plain, turned], streams(3, 3), threads=1)
    # MuJoCo solves friction, a soft constraint, for tendons instead of joints.
    np.testing.assert_allclose(other.q / UNITS, one.q[:, PLACE], rtol=0, atol=1e-6)
    np.testing.assert_allclose(other.v, one.v[:, PLACE], rtol=0, atol=1e-3 * np.abs(one.v).max())


def test_joints_have_neither_friction_nor_rotors_of_their_own(tmp_path):
    text = RX90.model.read_text(encoding="utf-8").replace("<joint ", '<joint damping="3.7" frictionloss="2.1" ')
    (tmp_path / "arm.xml").write_text(text, encoding="utf-8")
    plant = nominal_plant()
    moved = replace(plant, robot=robot_with(WRIST).model_copy(update={"model": tmp_path / "arm.xml"}))
    model = plant_model(moved, loaded=True, step=1e-3)
    assert not np.any((model.dof_damping, model.dof_frictionloss, model.dof_armature))
    np.testing.assert_array_equal(model.tendon_damping, plant.drives.viscous_friction)


def test_elastic_joints_behind_such_motors_are_not_simulated():
    refused(PlantError, "joint_compliance", motion_of, WRIST, ModelErrors(joint_compliance=(1e-5,) * 6))
