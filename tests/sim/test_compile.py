import os
from copy import copy

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from plants import CYLINDER, nominal_plant
from robot_folders import arm_xml, robot_folder

import rx90_mjcf
from ident.payload.payload import standard_parameters
from sim.compile import lean_model, plant_model
from sim.effects import ModelErrors
from sim.errors import PlantError
from sim.plant import PayloadBody, Plant
from sim.robot_files import read_robot

STEP = 1e-3
STATE = np.array([0.4, -0.3, 1.1, 0.7, 0.9, 0.2]), np.array([0.8, -1.1, 0.6, 1.4, -0.9, 1.2])


def acceleration(model: mujoco.MjModel, v: np.ndarray) -> np.ndarray:
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = STATE
    data.ctrl[:] = v
    mujoco.mj_forward(model, data)
    return data.qacc.copy()


def test_the_compiled_model_obeys_the_stated_equation_of_motion(rng):
    # M ddq + C dq + Q + Ia ddq = g (v - v0) - Fv dq - Fc sign(dq) - Fcoff, with Pinocchio for the left side.
    plant = nominal_plant()
    d, v = plant.drives, rng.uniform(-50, 50, 6)
    arm = pin.buildModelFromMJCF(str(rx90_mjcf.MJCF))
    arm.armature = d.rotor_inertia
    q, dq = STATE
    for loaded in (False, True):
        if loaded:
            body = pin.Inertia.FromDynamicParameters(_pinocchio_order(standard_parameters(*_body(plant.payload))))
            arm.appendBodyToJoint(6, body, pin.SE3.Identity())
        ddq = acceleration(plant_model(plant, loaded=loaded, step=STEP), v)
        left = pin.rnea(arm, arm.createData(), q, dq, ddq)
        right = d.gain * (v - d.amplifier_offset) - d.viscous_friction * dq - d.coulomb_asymmetry
        right -= d.coulomb_friction * np.sign(dq)
        # At these speeds the friction constraint is saturated; what is left is the solver's tolerance.
        np.testing.assert_allclose(left, right, rtol=0, atol=1e-6)


def _body(payload: PayloadBody):
    return payload.mass, payload.com, payload.inertia


def _pinocchio_order(chi: np.ndarray) -> np.ndarray:
    return chi[[9, 6, 7, 8, 0, 1, 3, 2, 4, 5]]


def test_a_lopsided_payload_on_drives_wired_backwards_obeys_the_equation_of_motion_too(rng):
    # Products of inertia, centre of mass beside every axis, gains of either sign.
    body = PayloadBody(mass=3.7, com=(0.04, -0.07, 0.11), inertia=(0.031, 0.027, 0.019, 0.004, -0.006, 0.0025))
    gain = np.array([-0.9, 1.3, 0.7, -1.6, 1.1, -0.4])
    plant = nominal_plant(body, gain=gain)
    arm = pin.buildModelFromMJCF(str(rx90_mjcf.MJCF))
    arm.armature = plant.drives.rotor_inertia
    J = np.array([[0.031, 0.004, -0.006], [0.004, 0.027, 0.0025], [-0.006, 0.0025, 0.019]])
    arm.appendBodyToJoint(6, pin.Inertia(3.7, np.array([0.04, -0.07, 0.11]), J), pin.SE3.Identity())
    (q, dq), d, v = STATE, plant.drives, rng.uniform(-50, 50, 6)
    ddq = acceleration(plant_model(plant, loaded=True, step=STEP), v)
    right = gain * (v - d.amplifier_offset) - d.viscous_friction * dq - d.coulomb_asymmetry
    right -= d.coulomb_friction * np.sign(dq)
    # The friction solver's tolerance, as above.
    np.testing.assert_allclose(pin.rnea(arm, arm.createData(), q, dq, ddq), right, rtol=0, atol=1e-6)


def test_current_is_limited():
    model = plant_model(nominal_plant(current_limit=np.full(6, 10.0)), loaded=False, step=STEP)
    np.testing.assert_array_equal(acceleration(model, np.full(6, 50.0)), acceleration(model, np.full(6, 10.0)))


def test_bare_and_loaded_models_have_one_layout_and_the_bare_one_is_the_arm():
    bare, loaded = (plant_model(nominal_plant(), loaded=x, step=STEP) for x in (False, True))
    assert bare.nbody == loaded.nbody
    arm = mujoco.MjModel.from_xml_path(str(rx90_mjcf.MJCF))
    np.testing.assert_array_equal(bare.body_mass[:-1], arm.body_mass)
    assert bare.body("payload").mass == 0.0
    assert loaded.body("payload").mass == CYLINDER.mass


def test_a_model_without_shapes_moves_bit_for_bit_as_the_one_with_all_of_them(rng):
    full, lean = (make(nominal_plant(), loaded=True, step=STEP) for make in (plant_model, lean_model))
    assert (full.ngeom > 20, lean.ngeom, lean.nmat, lean.ncam) == (True, 0, 0, 0)
    data = mujoco.MjData(full), mujoco.MjData(lean)
    for v in rng.uniform(-80, 80, (300, 6)):
        for model, each in zip((full, lean), data, strict=True):
            each.ctrl[:] = v
            mujoco.mj_step(model, each)
        np.testing.assert_array_equal(data[0].qpos, data[1].qpos)


def test_shapes_that_inertia_comes_from_stay(tmp_path):
    heavy = arm_xml(2).replace("<inertial", "<geom size='0.1' mass='2'/><!--").replace("/><joint", "/>--><joint")
    robot = read_robot(robot_folder(tmp_path, 2))
    robot.model.write_text(heavy)
    plant = Plant(robot=robot, drives=robot.drives, payload=CYLINDER)
    full, lean = (make(plant, loaded=False, step=STEP) for make in (plant_model, lean_model))
    assert lean.ngeom == 2
    np.testing.assert_array_equal(lean.body_mass, [0.0, 2.0, 2.0, 0.0])
    np.testing.assert_array_equal(lean.body_inertia, full.body_inertia)


def test_a_model_file_that_changed_is_read_again(tmp_path):
    robot = read_robot(robot_folder(tmp_path, 2))
    plant = Plant(robot=robot, drives=robot.drives, payload=CYLINDER)
    before = lean_model(plant, loaded=False, step=STEP)
    robot.model.write_text(arm_xml(2).replace('mass="9.000"', 'mass="4.500"'))
    os.utime(robot.model, ns=(1, 1))
    after = lean_model(plant, loaded=False, step=STEP)
    assert (before.body("part1").mass, after.body("part1").mass) == (9.0, 4.5)


def test_disabled_islands_change_nothing(rng):
    # An arm is one island: bit for bit on rigid joints, also with couplings and a spring.
    for errors in (ModelErrors(), ModelErrors(wrist_coupling=0.7), ModelErrors(gravity_spring=2e4)):
        model = plant_model(nominal_plant(errors=errors), loaded=True, step=STEP)
        assert model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_ISLAND
        islands = copy(model)
        islands.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_ISLAND)
        data = mujoco.MjData(model), mujoco.MjData(islands)
        for v in rng.uniform(-80, 80, (300, 6)):
            for each, its in zip(data, (model, islands), strict=True):
                each.ctrl[:] = v
                mujoco.mj_step(its, each)
            np.testing.assert_array_equal(data[0].qpos, data[1].qpos)


def test_a_saved_plant_opens_again_with_its_truth(tmp_path):
    model = plant_model(nominal_plant(), loaded=True, step=STEP)
    mujoco.mj_saveModel(model, str(tmp_path / "plant.mjb"))
    opened = mujoco.MjModel.from_binary_path(str(tmp_path / "plant.mjb"))
    np.testing.assert_array_equal(opened.actuator_gainprm[:, 0], nominal_plant().drives.gain)
    np.testing.assert_array_equal(opened.dof_frictionloss, nominal_plant().drives.coulomb_friction)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("gain", np.array([1.0, 1, 0, 1, 1, 1]), "gain .* has a zero"),
        ("gain", np.array([1.0, np.nan, 1, 1, 1, 1]), "expected 6 finite numbers"),
        ("viscous_friction", np.ones(5), "viscous_friction .* expected 6 finite numbers"),
        ("rotor_inertia", np.array([1.0, 1, -1, 1, 1, 1]), "rotor_inertia .* has a negative value"),
    ],
)
def test_impossible_drives_are_refused(field, value, message):
    with pytest.raises(PlantError, match=message):
        nominal_plant(**{field: value})


def test_shapes_of_a_part_that_is_fixed_to_a_link_stay_if_they_are_its_mass(tmp_path):
    # The model compiles without them, and weighs less.
    robot = read_robot(robot_folder(tmp_path, 2))
    camera = '<body name="camera" pos="0.1 0 0"><geom size="0.1" mass="3"/></body>'
    robot.model.write_text(arm_xml(2).replace("</body></body>", f"{camera}</body></body>"))
    plant = Plant(robot=robot, drives=robot.drives, payload=CYLINDER)
    for make in (plant_model, lean_model):
        assert make(plant, loaded=False, step=STEP).body("camera").mass == 3.0


@pytest.mark.parametrize("couplings", [0.0, 0.7])
def test_dry_friction_is_as_stiff_as_mujoco_takes_it(couplings):
    # MuJoCo takes two steps for whatever is shorter: half the time constant changes not a bit.
    model = plant_model(nominal_plant(errors=ModelErrors(wrist_coupling=couplings)), loaded=True, step=STEP)
    stiffer, softer = copy(model), copy(model)
    for other, factor in ((stiffer, 0.5), (softer, 1.01)):
        other.dof_solref[:, 0] *= factor
        other.tendon_solref_fri[:, 0] *= factor
    ends = []
    for each in (model, stiffer, softer):
        data = mujoco.MjData(each)
        data.ctrl[:] = [30.0, -20.0, 10.0, 5.0, 8.0, -4.0]
        mujoco.mj_step(each, data, 50)
        ends.append(data.qpos.copy())
    np.testing.assert_array_equal(ends[0], ends[1])
    assert (ends[0] != ends[2]).any()
