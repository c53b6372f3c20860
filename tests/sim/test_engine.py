import mujoco
import numpy as np
import pytest
from plants import nominal_plant

from sim.compile import plant_model
from sim.engine import Engine, Simulation

PERIODS, SUBSTEPS = 200, 2


def simulations(models: list[mujoco.MjModel], start: np.ndarray) -> list[Simulation]:
    return [Simulation(model=model, start=q) for model, q in zip(models, start, strict=True)]


@pytest.mark.parametrize("threads", [1, 2])
def test_a_batch_is_bit_for_bit_a_loop_over_mj_step(threads, rng):
    plants = [nominal_plant(gain=rng.uniform(0.5, 1.5, 6)) for _ in range(3)]
    models = [plant_model(plant, loaded=loaded, step=5e-4) for plant in plants for loaded in (False, True)]
    start = rng.uniform(-0.5, 0.5, (6, 6))
    currents = rng.uniform(-80, 80, (PERIODS, 6, 6))
    engine = Engine(simulations(models, start), substeps=SUBSTEPS, threads=threads)
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


def test_a_simulation_that_blows_up_is_reported_and_the_others_are_not(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo logs its warning to the working folder
    model = plant_model(nominal_plant(), loaded=False, step=1e-3)
    engine = Engine(simulations([model, model], np.zeros((2, 6))), substeps=1, threads=1)
    engine.q[1, 2] = np.nan
    engine.advance()
    np.testing.assert_array_equal(engine.unstable(), [False, True])


@pytest.mark.parametrize("current", [1e3, 1e11, np.inf])
def test_the_plant_takes_no_more_current_than_its_drives_give(current):
    limit = nominal_plant().drives.current_limit
    model = plant_model(nominal_plant(), loaded=True, step=1e-3)
    engine = Engine(simulations([model] * 4, np.zeros((4, 6))), substeps=1, threads=1)
    engine.current[:] = np.array([current * np.ones(6), limit, -current * np.ones(6), -limit])
    engine.advance()
    np.testing.assert_array_equal(engine.q[[0, 2]], engine.q[[1, 3]])
    assert np.abs(engine.q).min() > 0.0


def test_many_steps_at_once_are_the_same_steps_one_by_one(rng):
    models = [plant_model(nominal_plant(), loaded=loaded, step=1e-3) for loaded in (False, True)]
    start, currents = rng.uniform(-0.5, 0.5, (2, 6)), rng.uniform(-80, 80, (2, 50, 6))
    single, many = (Engine(simulations(models, start), substeps=1, threads=1) for _ in range(2))
    after = many.roll_out(currents)
    for k in range(50):
        before = single.q.copy()
        single.current[:] = currents[:, k]
        single.advance()
        np.testing.assert_array_equal(after.q[:, k], single.q)
        np.testing.assert_allclose(after.dq[:, k], (single.q - before) / 1e-3, rtol=0, atol=1e-11)


def test_a_simulation_that_is_not_stepped_to_the_end_is_unstable_whatever_it_met(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo logs its warning to the working folder
    model = plant_model(nominal_plant(), loaded=False, step=1e-3)
    engine = Engine(simulations([model, model], np.zeros((2, 6))), substeps=1, threads=1)
    controls = np.zeros((2, 5, 6))
    controls[1, 2, 3] = np.nan
    after = engine.roll_out(controls)
    np.testing.assert_array_equal(engine.unstable(), [False, True])
    np.testing.assert_array_equal(after.q[1, 3:], after.q[1, [2, 2]])
