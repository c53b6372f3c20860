"""Effects that change a model: where it stands, what its links and wrist are, what is refused."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from accelerations import SOLVER, STEP, acceleration, coupling, drive_torque
from drive_states import COMPLIANCE, DQ, Q
from pinocchio_arms import pinocchio_arm, rnea
from plants import nominal_plant

import rx90_mjcf
from sim.compile import plant_model
from sim.effects import ModelErrors
from sim.errors import PlantError
from sim.plant import layout


@pytest.mark.parametrize("loaded", [False, True])
def test_a_tilted_base_is_an_arm_that_stands_on_a_slope(loaded):
    plant = nominal_plant(errors=ModelErrors(base_tilt_x=0.03, base_tilt_y=-0.05))
    arm = pinocchio_arm(payload=loaded)
    slope = pin.SE3(pin.utils.rotate("x", 0.03) @ pin.utils.rotate("y", -0.05), np.zeros(3))
    arm.jointPlacements[1] = slope * arm.jointPlacements[1]
    ddq = acceleration(plant, Q, DQ, loaded=loaded)
    np.testing.assert_allclose(rnea(arm, Q, DQ, ddq), drive_torque(plant, DQ, ddq), rtol=0, atol=SOLVER)


def test_frames_3_and_4_lie_farther_out_than_drawn():
    plant = nominal_plant(errors=ModelErrors(d3_error=0.004, r4_error=-0.003))
    arm = pinocchio_arm(payload=False)
    arm.jointPlacements[3].translation = np.array([0.454, 0.0, 0.0])  # d3 = r4 = 0.45 m as drawn
    arm.jointPlacements[4].translation = np.array([0.0, -0.447, 0.0])
    ddq = acceleration(plant, Q, DQ)
    np.testing.assert_allclose(rnea(arm, Q, DQ, ddq), drive_torque(plant, DQ, ddq), rtol=0, atol=SOLVER)


ZEROS = (0.03, -0.02, 0.011, -0.04, 0.05, 0.007)


def test_an_arm_with_zeros_that_are_off_is_where_its_encoders_say_less_their_error():
    plant = nominal_plant(errors=ModelErrors(zero_error=ZEROS))
    ddq = acceleration(plant, Q, DQ)
    expected = rnea(pinocchio_arm(payload=False), Q - np.array(ZEROS), DQ, ddq)
    np.testing.assert_allclose(expected, drive_torque(plant, DQ, ddq), rtol=0, atol=SOLVER)


def test_elastic_joints_with_zeros_that_are_off_are_at_rest_where_encoders_say_less_their_error():
    rigid = plant_model(nominal_plant(errors=ModelErrors(zero_error=ZEROS)), loaded=True, step=STEP)
    errors = ModelErrors(zero_error=ZEROS, joint_compliance=COMPLIANCE)
    elastic = plant_model(nominal_plant(errors=errors), loaded=True, step=STEP)
    np.testing.assert_allclose(rigid.qpos0[:6], ZEROS, rtol=1e-12)
    np.testing.assert_array_equal(elastic.qpos0[:6], rigid.qpos0[:6])


@pytest.mark.parametrize("q2", [-2.2, -0.9, 0.0, 0.3, 1.4])
def test_the_gravity_spring_has_its_published_torque(q2):
    # INRIA HuMAnS, SpringForce.c: prestress 6257.75 N, 20295 N/m, 0.06 m * 0.45 m = 0.027 m^2.
    plant = nominal_plant(errors=ModelErrors(gravity_spring=20295.0))
    q = np.where(np.arange(6) == 1, q2, Q)
    length = np.sqrt(0.0036 * np.sin(q2) ** 2 + (0.45 - 0.06 * np.cos(q2)) ** 2)
    spring = np.zeros(6)
    spring[1] = -0.027 * (20295.0 - 6257.75 / length) * np.sin(q2)
    ddq = acceleration(plant, q, DQ)
    expected = drive_torque(plant, DQ, ddq) + spring
    np.testing.assert_allclose(rnea(pinocchio_arm(payload=False), q, DQ, ddq), expected, rtol=0, atol=SOLVER)


@pytest.mark.parametrize("share", [0.4, 1.0])
@pytest.mark.parametrize("dq5", [-0.9, -1.5])
def test_the_wrist_coupling_adds_its_stated_terms_to_joints_5_and_6(share, dq5):
    plant = nominal_plant(errors=ModelErrors(wrist_coupling=share))
    dq = np.where(np.arange(6) == 4, dq5, DQ)  # dq5 + dq6 of either sign
    ddq = acceleration(plant, Q, dq)
    expected = drive_torque(plant, dq, ddq) - coupling(share, dq, ddq)
    np.testing.assert_allclose(rnea(pinocchio_arm(payload=False), Q, dq, ddq), expected, rtol=0, atol=SOLVER)


def test_the_coupling_s_dry_friction_is_as_stiff_as_that_of_the_joints():
    model = plant_model(nominal_plant(errors=ModelErrors(wrist_coupling=1.0)), loaded=False, step=STEP)
    np.testing.assert_array_equal(model.tendon_solref_fri[0], model.dof_solref[0])
    np.testing.assert_array_equal(model.tendon_solimp_fri[0], model.dof_solimp[0])


def test_errors_that_are_switched_off_leave_no_trace_in_the_model():
    model = plant_model(nominal_plant(errors=ModelErrors(stribeck_speed=0.3)), loaded=True, step=STEP)
    assert (model.nv, model.ntendon) == (6, 0)
    drawn = mujoco.MjModel.from_xml_path(str(rx90_mjcf.MJCF))
    np.testing.assert_array_equal(model.opt.gravity, drawn.opt.gravity)
    np.testing.assert_array_equal(model.body_pos[:-1], drawn.body_pos)
    np.testing.assert_array_equal(model.dof_damping, nominal_plant().drives.viscous_friction)


def test_plants_of_one_layout_have_models_of_one_size():
    sizes = ("nq", "nv", "nu", "nbody", "njnt", "nsite", "ntendon", "nwrap", "nJten", "nM", "nC", "nD")
    seen = {}
    for errors in (
        ModelErrors(),
        ModelErrors(d3_error=0.01, base_tilt_x=0.1, stribeck=0.1),
        ModelErrors(gravity_spring=1.0),
        ModelErrors(wrist_coupling=0.5),
        ModelErrors(wrist_coupling=1.0),
        ModelErrors(joint_compliance=COMPLIANCE),
        ModelErrors(joint_compliance=COMPLIANCE, wrist_coupling=1.0),
    ):
        plant = nominal_plant(errors=errors)
        model = plant_model(plant, loaded=False, step=STEP)
        seen.setdefault(layout(plant), set()).add(tuple(getattr(model, name) for name in sizes))
    assert all(len(group) == 1 for group in seen.values())
    assert len(seen) == 5


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"wrist_coupling": 1.2}, r"errors: wrist_coupling = 1\.2: expected 0 to 1$"),
        ({"gravity_spring": -1.0}, r"errors: gravity_spring = -1: expected 0 to 1e\+06 N/m$"),
        ({"stribeck": -0.1}, r"errors: stribeck = -0\.1: expected 0 to 100$"),
        ({"stribeck_speed": 0.0}, r"errors: stribeck_speed = 0: expected 1e-06 to 100 rad/s$"),
        ({"coulomb_drift": -1.5}, r"errors: coulomb_drift = -1\.5: expected -1 to 100$"),
        ({"base_tilt_x": np.inf}, r"errors: base_tilt_x = inf: expected a finite number"),
        ({"r4_error": -0.5}, r"errors: r4_error = -0\.5: expected -0\.1 to 0\.1 m$"),
        ({"zero_error": (0.1, 0.6)}, r"errors: zero_error = \[0\.1, 0\.6\] rad: expected numbers between"),
        ({"base_tilt_x": 3.0}, r"errors: base_tilt_x = 3: expected -0\.5 to 0\.5 rad$"),
        (
            {"joint_compliance": (1e-4, 0.0)},
            r"errors: joint_compliance = \[0\.0001, 0\.0\] rad/\(N m\): expected posit",
        ),
    ],
)
def test_impossible_errors_are_refused(values, message):
    with pytest.raises(PlantError, match=message):
        ModelErrors(**values)


@pytest.mark.parametrize(
    ("values", "drives", "message"),
    [
        (
            {"wrist_coupling": 1.0},
            {"coulomb_friction": np.array([1.0, 1, 1, 1, 1, 2])},
            r"wrist_coupling = 1 leaves joint 6 a coulomb_friction of -0\.5 N m, below 0; use a smaller share",
        ),
        (
            {"joint_compliance": COMPLIANCE},
            {"rotor_inertia": np.zeros(6)},
            r"joint_compliance needs a rotor_inertia above 0 kg m\^2 at every joint",
        ),
    ],
)
def test_errors_that_a_plant_cannot_have_are_refused(values, drives, message):
    with pytest.raises(PlantError, match=message):
        plant_model(nominal_plant(errors=ModelErrors(**values), **drives), loaded=False, step=STEP)
