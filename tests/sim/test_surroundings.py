import mujoco
import numpy as np
import pytest
from pinocchio_arms import pinocchio_arm, rnea
from plants import experiment, nominal_plant

from sim.effects import ModelErrors
from sim.errors import PlantError
from sim.feedforward_currents import feedforward_currents
from sim.model_spec import arm_joints, driven_joints
from sim.plant import PayloadBody, plant_model, resting
from sim.trajectory import FourierTrajectory

BODY = PayloadBody(mass=5.3, com=(0.05, -0.03, 0.14), inertia=(0.0125, 0.0118, 0.009, 0.0006, -0.0004, 0.0003))
Q = np.array([0.4, -0.3, 1.1, 0.7, 0.9, 0.2])
LOOSE = {"loose_share": 0.37, "loose_hz": 3.1, "loose_damping": 0.13}
TABLE = {"table_hz": 4.3, "table_damping": 0.11}
COMPLIANCE = (2e-5, 2.5e-5, 6e-5, 1e-4, 1.2e-4, 2e-4)
RATE, DURATION, SWING = 200.0, 0.8, 1e-3
"""Sampling rate [Hz], period [s] and amplitude [rad] of a motion of joint 1: 1.25 Hz."""


def torque_of_a_swing(**errors: float) -> complex:
    """Torque of joint 1 in phase with its position, and ahead of it, per amplitude, without friction [N m/rad]."""
    sine = SWING * np.eye(6, 1)
    motion = FourierTrajectory(Q, sine, np.zeros((6, 1)), DURATION)
    plant = nominal_plant(BODY, ModelErrors(**errors), coulomb_friction=np.zeros(6), coulomb_asymmetry=np.zeros(6))
    (v,) = feedforward_currents([experiment(plant=plant, loaded=True, trajectory=motion)], RATE)
    torque = plant.drives.gain[0] * (v[:-1, 0] - plant.drives.amplifier_offset[0])
    return complex(2j * np.mean(torque * np.exp(-2j * np.pi * RATE**-1 / DURATION * np.arange(len(torque)))) / SWING)


def moving() -> tuple[float, float, float]:
    """Mass of base and links with a payload, its static moment about axis 1, and the payload's distance from it."""
    model = plant_model(nominal_plant(BODY), loaded=True, step=1e-3)
    data = mujoco.MjData(model)
    data.qpos[:] = Q
    mujoco.mj_forward(model, data)
    payload, turning = model.body("payload").id, int(model.jnt_bodyid[0])
    moment = model.body_subtreemass[turning] * np.linalg.norm(data.subtree_com[turning, :2])
    return model.body_subtreemass[1], float(moment), float(np.linalg.norm(data.xipos[payload, :2]))


def test_a_loose_share_of_a_payload_follows_a_swing_as_a_mass_on_a_spring():
    rate, own, D = 2.0 * np.pi / DURATION, 2.0 * np.pi * 3.1, 0.13
    *_, distance = moving()
    passed = own**2 + 2j * D * own * rate
    expected = -(rate**2) * 0.37 * BODY.mass * distance**2 * (passed / (passed - rate**2) - 1.0)
    found = torque_of_a_swing(**LOOSE) - torque_of_a_swing()
    np.testing.assert_allclose(found, expected, rtol=3e-3)  # splines through 20 samples a period


@pytest.mark.parametrize("hz", [4.3, 0.9])
def test_a_table_yields_to_a_swing_above_and_below_its_frequency_as_the_whole_arm_on_a_spring(hz):
    rate, own, D = 2.0 * np.pi / DURATION, 2.0 * np.pi * hz, 0.11
    mass, moment, _ = moving()
    spring = (mass - BODY.mass) * (own**2 + 2j * D * own * rate)
    expected = -(moment**2) * rate**4 / (spring - mass * rate**2)
    found = torque_of_a_swing(table_hz=hz, table_damping=D) - torque_of_a_swing()
    np.testing.assert_allclose(found, expected, rtol=3e-3)  # the same


@pytest.mark.parametrize("more", [{}, {"joint_compliance": COMPLIANCE}])
def test_at_rest_springs_carry_payload_and_arm_and_change_no_torque_of_a_drive(more):
    plant = nominal_plant(BODY, ModelErrors(**LOOSE, **TABLE, **more))
    model = plant_model(plant, loaded=True, step=1e-3)
    data = mujoco.MjData(model)
    data.qpos[:] = resting(plant, model, Q)
    mujoco.mj_inverse(model, data)
    own, links = driven_joints(model), arm_joints(model)
    np.testing.assert_allclose(data.qpos[own], Q, rtol=0, atol=1e-15)
    gravity = rnea(pinocchio_arm(payload=True, body=BODY), data.qpos[links], np.zeros(6), np.zeros(6))
    # Specks of 1 mg that a body on springs has; motors pass their torque on to the links.
    np.testing.assert_allclose(data.qfrc_inverse[own], gravity, rtol=0, atol=1e-4)
    free = np.delete(np.arange(model.nv), own)
    np.testing.assert_allclose(data.qfrc_inverse[free], 0.0, rtol=0, atol=1e-6)  # converged
    sunk = np.linalg.norm(data.qpos[-9:-6] if more else data.qpos[-3:])
    np.testing.assert_allclose(sunk, 9.81 / (2.0 * np.pi * 3.1) ** 2, rtol=1e-9)
    weighed = 1.0 + BODY.mass / (moving()[0] - BODY.mass)
    np.testing.assert_allclose(data.qpos[2], -weighed * 9.81 / (2.0 * np.pi * 4.3) ** 2, rtol=1e-5)  # its speck


def test_a_table_needs_a_body_for_the_base():
    link = '<body name="link{}"><joint axis="0 0 1"/><inertial pos="0 0 .1" mass="2" diaginertia=".03 .02 .04"/>'
    text = "".join(link.format(k) for k in range(6)) + "</body>" * 6
    spec = mujoco.MjSpec.from_string(f"<mujoco><worldbody>{text}</worldbody></mujoco>")
    with pytest.raises(
        PlantError, match=r"table_hz = 4\.3 Hz: the first joint of .* is on body 'link0' without a base"
    ):
        plant_model(nominal_plant(errors=ModelErrors(**TABLE)), loaded=False, step=1e-3, read=lambda *_: spec)
