from copy import copy
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from plants import CYLINDER, nominal_plant, short_motion
from robot_folders import arm_xml, robot_folder

from sim.effects import ModelErrors
from sim.engine import Engine, Simulation, acting, varies
from sim.model_spec import full_spec, lean_spec
from sim.plant import Plant, plant_model
from sim.robot import read_robot

STEP = 1e-3
SPECS = full_spec, lean_spec


def test_a_model_without_shapes_moves_bit_for_bit_as_the_one_with_all_of_them(rng):
    full, lean = (plant_model(nominal_plant(), loaded=True, step=STEP, read=read) for read in SPECS)
    assert (full.ngeom > 20, lean.ngeom, lean.nmat, lean.ncam) == (True, 0, 0, 0)
    assert plant_model(nominal_plant(), loaded=True, step=STEP).ngeom == 0  # what a simulation steps
    data = mujoco.MjData(full), mujoco.MjData(lean)
    for v in rng.uniform(-80, 80, (100, 6)):
        for model, each in zip((full, lean), data, strict=True):
            each.ctrl[:] = v
            mujoco.mj_step(model, each)
        np.testing.assert_array_equal(data[0].qpos, data[1].qpos)


def test_shapes_of_a_part_that_is_fixed_to_a_link_stay_if_they_are_its_mass(tmp_path):
    # The model compiles without them, and weighs less.
    robot = read_robot(robot_folder(tmp_path, 2))
    camera = '<body name="camera" pos="0.1 0 0"><geom size="0.1" mass="3"/></body>'
    robot.model.write_text(arm_xml(2).replace("</body></body>", f"{camera}</body></body>"))
    plant = Plant(robot=robot, drives=robot.drives, payload=CYLINDER)
    for read in SPECS:
        assert plant_model(plant, loaded=False, step=STEP, read=read).body("camera").mass == 3.0


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


@pytest.mark.parametrize("errors", [ModelErrors(), ModelErrors(load_friction=0.3)])
@pytest.mark.parametrize("current", [1e3, np.inf])
def test_the_plant_takes_no_more_current_than_its_drives_give_nor_does_its_friction(current, errors):
    plant = nominal_plant(errors=errors)
    limit, model = plant.drives.current_limit, plant_model(plant, loaded=True, step=1e-3)
    four = [Simulation(model=copy(model), start=np.zeros(6)) for _ in range(4)]
    if varies(errors):
        four = [replace(each, varied=acting(plant, each.model, step=1e-3, earlier=0)) for each in four]
    engine = Engine(four, substeps=1, threads=1)
    for _ in range(5):
        engine.current[:] = np.array([current * np.ones(6), limit, -current * np.ones(6), -limit])
        engine.advance()
    np.testing.assert_array_equal(engine.q[[0, 2]], engine.q[[1, 3]])
    assert np.abs(engine.q).min() > 0.0


def test_velocity_and_acceleration_are_the_derivatives():
    motion, h = short_motion(2.0), 1e-5
    t = np.linspace(0.1, 1.9, 50)
    q, dq, ddq = motion(t)
    before, after = motion(t - h), motion(t + h)
    # Central differences: h^2 / 6 times the third derivative, some 1e-8, and rounding over h, 1e-11.
    np.testing.assert_allclose((after[0] - before[0]) / (2 * h), dq, rtol=0, atol=1e-7)
    np.testing.assert_allclose((after[1] - before[1]) / (2 * h), ddq, rtol=0, atol=1e-6)
    assert q.shape == dq.shape == ddq.shape == (50, 6)


PERIODS, SUBSTEPS = 60, 2


def simulations(models: list[mujoco.MjModel], start: np.ndarray) -> list[Simulation]:
    return [Simulation(model=model, start=q) for model, q in zip(models, start, strict=True)]


def test_a_batch_is_bit_for_bit_a_loop_over_mj_step(rng):
    plants = [nominal_plant(gain=rng.uniform(0.5, 1.5, 6)) for _ in range(3)]
    models = [plant_model(plant, loaded=loaded, step=5e-4) for plant in plants for loaded in (False, True)]
    start = rng.uniform(-0.5, 0.5, (6, 6))
    currents = rng.uniform(-80, 80, (PERIODS, 6, 6))
    engine = Engine(simulations(models, start), substeps=SUBSTEPS, threads=2)
    batched = np.empty_like(currents)
    for k in range(PERIODS):
        engine.current[:] = currents[k]
        engine.advance()
        batched[k] = engine.q
    for i, model in enumerate(models):
        data = mujoco.MjData(model)
        data.qpos[:] = start[i]
        for k in range(PERIODS):
            data.ctrl[:] = currents[k, i]
            for _ in range(SUBSTEPS):
                mujoco.mj_step(model, data)
            np.testing.assert_array_equal(batched[k, i], data.qpos)
