from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Annotated, ClassVar

import mujoco
import numpy as np
import pytest
from annotated_types import Interval, Unit
from plants import experiment, nominal_plant, streams
from pydantic import TypeAdapter

import sim.engine
import sim.plant
import sim.sensors
from sim.effects import EFFECTS, ModelErrors
from sim.effects.effect import Build, ControlStep, Effect, Term, each_value
from sim.errors import PlantError
from sim.record import record
from sim.sensors import SENSORS, SensorOptions, noise_streams
from sim.sensors.sensor import Log, NoiseStreams, Sensor


@dataclass(frozen=True, kw_only=True)
class Ripple(Effect):
    """Torque ripple.

    Attributes:
        ripple: Amplitude [N m].
    """

    ripple: Annotated[float, Interval(ge=0.0, le=50.0), Unit("N m")] = 0.0

    def varies(self) -> bool:
        return self.ripple > 0.0

    @staticmethod
    def term(values: Sequence[object], builds: Sequence[Build]) -> Term:
        (size,) = each_value(values, "ripple")

        def add(step: ControlStep) -> None:
            step.torque[:] += size * np.sin(3.0 * step.q + 0.7 * step.t)

        return add


@dataclass(frozen=True, kw_only=True)
class LooseAxis(Effect):
    """Viscous friction that is gone on joint 1.

    Attributes:
        loose: Share that is gone.
    """

    loose: Annotated[float, Interval(ge=0.0, le=1.0)] = 0.0

    def after_compile(self, model: mujoco.MjModel, build: Build) -> None:
        model.dof_damping[model.nv - model.nu] *= 1.0 - self.loose


@dataclass(frozen=True, kw_only=True)
class Drift(Sensor):
    """A position log that drifts.

    Attributes:
        drift: [rad/s].
        drift_noise: [rad].
    """

    streams: ClassVar[tuple[str, ...]] = ("drift",)
    drift: Annotated[float, Interval(ge=-1.0, le=1.0), Unit("rad/s")] = 0.0
    drift_noise: Annotated[float, Interval(ge=0.0, le=1.0), Unit("rad")] = 0.0

    def logs(self, log: Log, streams: NoiseStreams) -> Log:
        noise = self.drift_noise * streams["drift"].standard_normal(log.q.shape)
        return replace(log, q=log.q + self.drift * log.t[:, None] + noise)


@dataclass(frozen=True, kw_only=True)
class MoreErrors(Ripple, LooseAxis, ModelErrors):
    """As the class statement of `ModelErrors` with one base more each."""


@dataclass(frozen=True, kw_only=True)
class MoreSensors(Drift, SensorOptions):
    """The same of `SensorOptions`."""


PLAIN = nominal_plant(errors=MoreErrors())


@pytest.fixture
def extended(monkeypatch):
    more = {**EFFECTS, "loose": LooseAxis, "ripple": Ripple}
    for module in (sim.plant, sim.engine):
        monkeypatch.setattr(module, "EFFECTS", more)
    monkeypatch.setattr(sim.sensors, "SENSORS", {**SENSORS, "drift": Drift})


def test_keys_of_an_effect_and_of_a_sensor_appear_by_themselves_with_their_ranges():
    for kind, key, most in ((MoreErrors, "ripple", 50.0), (MoreSensors, "drift", 1.0), (ModelErrors, "d3_error", 0.1)):
        schema = TypeAdapter(kind).json_schema()["properties"]
        assert schema[key]["maximum"] == most
        assert key in {field.name for field in fields(kind)}
    with pytest.raises(PlantError, match=r"errors: ripple = 60: expected 0 to 50 N m"):
        MoreErrors(ripple=60.0)


@pytest.mark.parametrize("beside", [{"stribeck": 0.3}, {"joint_compliance": (1e-4,) * 6}])
def test_a_varying_effect_pushes_the_joints_with_the_torque_that_it_states(extended, beside):
    # What is added to a drive's torque is what the same current would have added: g times it.
    calls = []

    class Seen(Ripple):
        @staticmethod
        def term(values: Sequence[object], builds: Sequence[Build]) -> Term:
            inner = Ripple.term(values, builds)

            def add(step: ControlStep) -> None:
                inner(step)
                calls.append((step.t, step.q.copy(), step.torque.copy()))

            return add

    sim.engine.EFFECTS["ripple"] = Seen
    rippled = experiment(plant=nominal_plant(errors=MoreErrors(ripple=11.0, **beside)), sensors=MoreSensors())
    plain = replace(rippled, plant=nominal_plant(errors=MoreErrors(**beside)))
    with_ripple, without = record([rippled, plain], streams(0, 0), threads=1)
    assert np.abs(with_ripple.q - without.q).max() > 1e-4
    times = np.array([t for t, _, _ in calls])
    np.testing.assert_allclose(times, 1e-3 * np.arange(len(calls)), rtol=0, atol=1e-12)  # a sum of 2000 periods
    for t, q, torque in calls[:: len(calls) // 7]:
        np.testing.assert_array_equal(torque[0], 11.0 * np.sin(3.0 * q[0] + 0.7 * t))
        np.testing.assert_array_equal(q[0], with_ripple.q[round(1e3 * t)])


def test_a_sensor_draws_from_a_stream_of_its_own_and_leaves_those_of_the_others(extended):
    plain = noise_streams(np.random.default_rng(4))
    names = ["encoder", "white", "coloured", "clock", "current_sensor", "drive_clocks", "samples", "drift"]
    assert [*plain.generators] == names
    own = np.random.default_rng(4).spawn(7)
    for name, generator in (("encoder", own[0]), ("white", own[1]), ("clock", own[2]), ("drift", own[6])):
        assert plain[name].random() == generator.random()
    noisy = MoreSensors(current_white=0.05, drift=0.02, drift_noise=1e-3)
    (moved,) = record([experiment(plant=PLAIN, sensors=noisy)], streams(4), threads=1)
    (still,) = record([experiment(plant=PLAIN, sensors=MoreSensors(current_white=0.05))], streams(4), threads=1)
    np.testing.assert_array_equal(moved.v, still.v)
    expected = 0.02 * still.t[:, None] + 1e-3 * np.random.default_rng(4).spawn(7)[6].standard_normal(still.q.shape)
    np.testing.assert_allclose(moved.q - still.q, expected, rtol=0, atol=1e-15)  # rounding of angles below 4 rad


def contents(model: mujoco.MjModel) -> bytes:
    buffer = np.empty(mujoco.mj_sizeModel(model), dtype=np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_whose_values_are_zero_leaves_no_trace(name, monkeypatch):
    effect, errors, plant = EFFECTS[name], ModelErrors(), nominal_plant()
    effect.fits(errors, plant.robot, plant.drives)
    assert not effect.resizes(errors)
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
