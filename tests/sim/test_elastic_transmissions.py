"""Transmissions that yield: links and motors, rest, what is too stiff, too soft or of another arm."""

import re
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from accelerations import SOLVER, STEP, acceleration, coupling, drive_torque
from drive_states import COMPLIANCE, DQ, Q
from pinocchio_arms import pinocchio_arm, rnea
from plants import experiment, nominal_plant, streams, try_record

from sim.compile import plant_model, resting
from sim.effects import ModelErrors
from sim.effects.transmissions import FASTEST_MODE
from sim.engine import Engine, Simulation
from sim.errors import PlantError
from sim.plant import Plant


@pytest.mark.parametrize("share", [0.0, 1.0])
@pytest.mark.parametrize("loaded", [False, True])
def test_links_and_motors_of_an_elastic_arm_obey_spong_s_equations(share, loaded):
    # M ddq + h = Ke (q_m - q) + De (dq_m - dq), Ia ddq_m + friction = tau - the same, De = 2 * 0.05 sqrt(Ke Ia).
    plant = nominal_plant(errors=ModelErrors(joint_compliance=COMPLIANCE, wrist_coupling=share))
    q_motor, dq_motor = Q + 1e-3 * np.array([1, -2, 1, 0.5, -0.3, 0.2]), DQ + np.array([0.02, 0, -0.03, 0.1, 0.05, 0])
    ddq = acceleration(plant, np.append(Q, q_motor), np.append(DQ, dq_motor), loaded=loaded)
    stiffness = 1.0 / np.array(COMPLIANCE)
    damping = 0.1 * np.sqrt(stiffness * plant.drives.rotor_inertia)
    transmitted = stiffness * (q_motor - Q) + damping * (dq_motor - DQ)
    np.testing.assert_allclose(rnea(pinocchio_arm(payload=loaded), Q, DQ, ddq[:6]), transmitted, rtol=0, atol=SOLVER)
    motors = drive_torque(plant, dq_motor, ddq[6:]) - coupling(share, dq_motor, ddq[6:])
    np.testing.assert_allclose(motors, transmitted, rtol=0, atol=SOLVER)


def test_an_elastic_arm_at_rest_hangs_below_its_motors_by_gravity_times_compliance():
    plant = nominal_plant(errors=ModelErrors(joint_compliance=COMPLIANCE))
    state = resting(plant, plant_model(plant, loaded=True, step=STEP), Q)
    np.testing.assert_array_equal(state[6:], Q)
    gravity = rnea(pinocchio_arm(payload=True), state[:6], np.zeros(6), np.zeros(6))
    # Converged: the iteration contracts by 0.03, 20 times; what is left is rounding of 300 N m over 5e4 N m/rad.
    np.testing.assert_allclose(state[:6] - Q, -np.array(COMPLIANCE) * gravity, rtol=0, atol=1e-14)
    assert np.abs(state[:6] - Q).max() > 1e-4


def test_encoders_of_an_elastic_arm_read_the_motors():
    plant = nominal_plant(errors=ModelErrors(joint_compliance=COMPLIANCE))
    model = plant_model(plant, loaded=True, step=STEP)
    start = resting(plant, model, Q)
    engine = Engine([Simulation(model=model, start=start)], substeps=1, threads=1)
    np.testing.assert_array_equal(engine.q[0], Q)


@pytest.mark.parametrize("share", [0.0, 1.0])
@pytest.mark.parametrize("loaded", [False, True])
def test_the_stiffest_transmission_that_is_taken_is_stable(share, loaded):
    inertia = nominal_plant().drives.rotor_inertia
    stiffest = STEP**2 / (FASTEST_MODE**2 * inertia)

    def elastic(factor: float) -> Plant:
        return nominal_plant(errors=ModelErrors(joint_compliance=tuple(factor * stiffest), wrist_coupling=share))

    plant = elastic(1.001)
    model = plant_model(plant, loaded=loaded, step=STEP)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:6] = resting(plant, model, Q), 0.3
    for _ in range(1000):
        mujoco.mj_step(model, data)
    # The arm falls; an unstable link would leave its motor by many rad/s.
    assert np.abs(data.qvel[:6] - data.qvel[6:]).max() < 0.1
    with pytest.raises(PlantError, match=r"joint_compliance of joint \d = .* too stiff for a step of 0\.001 s; use a"):
        plant_model(elastic(0.99), loaded=loaded, step=STEP)


def test_the_stiffest_of_several_transmissions_is_named_with_a_step_and_a_compliance_that_are_taken():
    stiffest = STEP**2 / (FASTEST_MODE**2 * np.asarray(nominal_plant().drives.rotor_inertia))
    factor = np.array([3.0, 0.9, 1.4, 0.8, 0.6, 2.0])

    def elastic(factor: np.ndarray, step: float) -> None:
        errors = ModelErrors(joint_compliance=tuple(factor * stiffest))
        plant_model(nominal_plant(errors=errors), loaded=True, step=step)

    with pytest.raises(PlantError, match="joint_compliance of joint 5 = ") as refused:
        elastic(factor, STEP)
    step, softest = map(float, re.findall(r"use a step of (\S+) s at most, or (\S+) rad", str(refused.value))[0])
    # sqrt(Ke / Ia) step = FASTEST_MODE at most: 1 % is left for the rounding of what is said.
    np.testing.assert_allclose(step, 0.99 * STEP * 0.6**0.5, rtol=6e-3)
    np.testing.assert_allclose(softest, 1.01 * stiffest[4], rtol=6e-3)
    elastic(factor, step)
    with pytest.raises(PlantError, match="joint_compliance of joint 4 = "):
        elastic(np.where(np.arange(6) == 4, softest / stiffest[4], factor), STEP)


def test_a_fault_of_an_elastic_arm_names_its_joint():
    still = replace(experiment().trajectory, center=Q + np.array([0, 0, 0, 0, 1.7, 0]))
    plant = nominal_plant(errors=ModelErrors(joint_compliance=COMPLIANCE))
    (outcome,) = try_record([experiment(plant=plant, trajectory=still)], streams(0), threads=1)
    assert str(outcome).startswith("motion: joint5 at 2.")


def test_compliances_of_another_arm_are_refused():
    with pytest.raises(PlantError, match=r"joint_compliance: 2 values \[rad/\(N m\)\], expected 6, one per joint"):
        nominal_plant(errors=ModelErrors(joint_compliance=(1e-5, 1e-5)))


def test_zero_compliance_is_a_rigid_joint():
    assert ModelErrors(joint_compliance=(0.0,) * 6) == ModelErrors()


def test_a_transmission_turns_by_a_radian_under_ten_newton_metres_at_most():
    softest = (1e-4, 0.1, 1e-4, 1e-4, 1e-4, 1e-4)
    assert ModelErrors(joint_compliance=softest).joint_compliance == softest
    with pytest.raises(PlantError, match=r"expected positive numbers up to 0\.1, one per joint"):
        ModelErrors(joint_compliance=(*softest[:5], 0.1001))


def test_joints_that_no_effect_settles_are_at_rest_at_zero(monkeypatch):
    plant = nominal_plant(errors=ModelErrors(joint_compliance=COMPLIANCE))
    model = plant_model(plant, loaded=True, step=STEP)
    monkeypatch.setattr("sim.compile.EFFECTS", {})
    q = np.array([0.4, -0.3, 1.1, 0.7, 0.9, 0.2])
    np.testing.assert_array_equal(resting(plant, model, q), [*np.zeros(6), *q])
