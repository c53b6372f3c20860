import mujoco
import numpy as np
import pytest
from plants import nominal_plant

import sim.engine
import sim.plant
import sim.sensors
from sim.effects import EFFECTS, ModelErrors
from sim.sensors import SENSORS, SensorOptions, noise_streams
from sim.sensors.sensor import Log


def contents(model: mujoco.MjModel) -> bytes:
    buffer = np.empty(mujoco.mj_sizeModel(model), dtype=np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_whose_values_are_zero_leaves_no_trace(name, monkeypatch):
    effect, errors, plant = EFFECTS[name], ModelErrors(), nominal_plant()
    effect.fits(errors, plant.robot, plant.drives)
    assert not effect.acts(errors)
    assert not effect.varies(errors)
    with_it = [contents(sim.plant.plant_model(plant, loaded=loaded, step=1e-3)) for loaded in (False, True)]
    monkeypatch.setattr(sim.plant, "EFFECTS", {k: each for k, each in EFFECTS.items() if k != name})
    without = [contents(sim.plant.plant_model(plant, loaded=loaded, step=1e-3)) for loaded in (False, True)]
    assert with_it == without


@pytest.mark.parametrize("name", SENSORS)
def test_a_sensor_whose_values_are_zero_reads_and_logs_the_truth(name):
    effect, perfect, noise = SENSORS[name], SensorOptions(), noise_streams(np.random.default_rng(4))
    assert effect.reader([perfect], [noise], 2) is None
    t = np.arange(40) / 250.0
    log = Log(t=t, q=np.sin(3.0 * t)[:, None] * [0.4, -1.3], v=np.cos(5.0 * t)[:, None] * [7.0, 2.5], rate_hz=250.0)
    logged = effect.logs(perfect, log, noise)
    for field in ("t", "q", "v"):
        np.testing.assert_array_equal(getattr(logged, field), getattr(log, field))
