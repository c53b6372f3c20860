"""What makes drives as they are, in the engine: laws at the start of every period, backlash, and refusals."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from drive_states import COMPLIANCE, DQ, DRIVES, TURNS, Q, V, simulation_of
from pinocchio_arms import pinocchio_arm, rnea
from plants import nominal_plant

from sim.compile import plant_model, resting
from sim.effects import EFFECTS, ModelErrors
from sim.engine import Engine
from sim.errors import PlantError
from sim.plant import Plant

STRONG = ModelErrors(
    wrist_coupling=1.0,
    stribeck=0.3,
    coulomb_by_direction=0.2,
    viscous_by_direction=-0.3,
    load_friction=0.04,
    transmitted_friction=0.07,
    cogging=0.004,
    torque_ripple=0.03,
    motor_waves=200.0,
    viscous_curve=0.5,
    motor_warming=5e3,
    warming_time=2.0,
    gain_by_temperature=-0.004,
    coulomb_by_temperature=-0.006,
    viscous_by_temperature=-0.03,
)


class Loop:
    """The laws written out again around `mj_step`, link torques from Pinocchio."""

    def __init__(self, plant: Plant, start: np.ndarray) -> None:
        self.errors, self.drives = plant.errors, plant.drives
        self.model = plant_model(plant, loaded=True, step=1e-3)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:] = start
        self.tendon = self.model.tendon("joint6_coupling").id
        self.arm, self.link = pinocchio_arm(payload=True), np.zeros(6)
        self.x, self.s = np.zeros(6), np.zeros(7)
        self.coulomb = np.append(self.drives.coulomb_friction - [0, 0, 0, 0, 0, 2.5], 2.5)
        self.viscous = np.append(self.drives.viscous_friction - [0, 0, 0, 0, 2.4, 2.4], 2.4)

    def advance(self, v: np.ndarray) -> None:
        e, d, data = self.errors, self.drives, self.data
        q, dq = data.qpos.copy(), data.qvel.copy()
        speed, drive = TURNS @ dq, d.gain * (v - d.amplifier_offset)
        side, warm = np.sign(speed), np.append(self.x, self.x[5])
        dry = self.coulomb * (1 + 0.3 * np.exp(-((speed / 0.1) ** 2))) * (1 + 0.1 * side) * np.exp(-0.006 * warm)
        damping = self.viscous * (1 - 0.15 * side) * np.exp(-0.03 * warm)
        dry += 0.5 * damping * np.cbrt(np.abs(speed))
        dry[:6] += 0.04 * np.abs(drive) + 0.07 * np.abs(self.link)
        torque = -0.004 * self.x * drive + 0.03 * np.sin(200 * q + 1) * drive
        torque -= 0.004 * d.gain * d.current_limit * np.sin(200 * q)
        if e.presliding:
            torque -= TURNS.T @ (dry * self.s)
            self.s = side + (self.s - side) * np.exp(-1e-3 * np.abs(speed) / e.presliding)
            dry[:] = 0.0
        heat = 5e3 * (v / d.current_limit) ** 2
        self.x = heat + (self.x - heat) * np.exp(-1e-3 / 2.0)
        self.model.dof_frictionloss[:], self.model.tendon_frictionloss[self.tendon] = dry[:6], dry[6]
        self.model.dof_damping[:], self.model.tendon_damping[self.tendon] = 0.5 * damping[:6], 0.5 * damping[6]
        data.ctrl[:], data.qfrc_applied[:] = v, torque
        mujoco.mj_step(self.model, data)
        self.link = rnea(self.arm, q, dq, data.qacc.copy())


@pytest.mark.parametrize("presliding", [0.0, 0.004])
def test_all_effects_together_are_the_laws_at_the_start_of_every_period(presliding):
    errors = replace(STRONG, presliding=presliding)
    plants = [nominal_plant(errors=errors), nominal_plant(errors=ModelErrors(wrist_coupling=1.0))]
    entries = [simulation_of(plant, step=1e-3) for plant in plants]
    assert entries[1].varied is None
    engine, loop = Engine(entries[::-1], substeps=1, threads=1), Loop(plants[0], Q)
    for v in np.random.default_rng(0).uniform(-40, 40, (80, 6)):
        engine.current[:] = v
        engine.advance()
        loop.advance(v)
        # Sums in another order, and link torques that two programs agree on to SOLVER = 1e-6 N m.
        np.testing.assert_allclose(engine.q[1], loop.data.qpos, rtol=0, atol=1e-9)
    np.testing.assert_allclose(engine.warmth()[1], loop.x, rtol=1e-12)  # 80 products and sums
    assert not engine.warmth()[0].any()
    assert np.abs(loop.link).max() > 20.0
    assert loop.x.max() > 5.0


@pytest.mark.parametrize("elastic", [False, True])
def test_a_transmitted_torque_is_what_the_links_take_over(elastic, monkeypatch):
    seen: list[np.ndarray] = []

    def watched(values, builds):
        return lambda step: seen.append(step.transmitted[0].copy())

    monkeypatch.setattr(EFFECTS["load_friction"], "term", staticmethod(watched))
    errors = ModelErrors(transmitted_friction=0.1, gravity_spring=9e3, joint_compliance=COMPLIANCE if elastic else None)
    plant = nominal_plant(errors=errors)
    simulation = simulation_of(plant, step=1e-3)
    engine = Engine([simulation], substeps=1, threads=1)
    twin, data = plant_model(plant, loaded=True, step=1e-3), mujoco.MjData(simulation.model)
    data.qpos[:] = simulation.start
    for v in np.random.default_rng(3).uniform(-40, 40, (15, 6)):
        engine.current[:] = data.ctrl[:] = v
        engine.advance()
        before, speed = data.qpos.copy(), data.qvel.copy()
        mujoco.mj_step(twin, data)
    expected = _taken_over(plant, before, speed, data)
    engine.advance()
    np.testing.assert_allclose(seen[-1], expected, rtol=0, atol=2e-6)  # what the friction solver leaves, twice
    assert not seen[0].any()


def _taken_over(plant: Plant, q: np.ndarray, dq: np.ndarray, data: mujoco.MjData) -> np.ndarray:
    """Torque between drive and link in the last step: of springs, or of the arm itself."""
    if plant.errors.joint_compliance is not None:
        stiffness = 1.0 / np.array(COMPLIANCE)
        damping = 0.1 * np.sqrt(stiffness * plant.drives.rotor_inertia)
        return stiffness * (q[6:] - q[:6]) + damping * (dq[6:] - dq[:6])
    length = np.sqrt(0.0036 * np.sin(q[1]) ** 2 + (0.45 - 0.06 * np.cos(q[1])) ** 2)
    free = 6257.75 / 20295.0
    spring = np.array([0, -0.027 * 9e3 * (1.0 - free / length) * np.sin(q[1]), 0, 0, 0, 0])
    return rnea(pinocchio_arm(payload=True), q, dq, data.qacc.copy()) - spring


@pytest.mark.parametrize(
    ("play", "share"),
    [(np.array([0.1, -0.3, 0.45, -0.1, 0.2, -0.49]), 0.0), (np.array([0.6, -2.0, 0.8, -0.7, 3.0, -0.55]), 1.0)],
)
def test_a_transmission_with_backlash_carries_nothing_but_its_damping_within_it(play, share):
    gap, n = 2e-3, 6
    plant = nominal_plant(errors=ModelErrors(joint_compliance=COMPLIANCE, backlash=gap))
    model = plant_model(plant, loaded=True, step=1e-3)
    data = mujoco.MjData(model)
    data.qpos[:n], data.qpos[n:] = Q, Q + gap * play
    data.qvel[:n], data.qvel[n:] = DQ, DQ + np.array([0.02, 0, -0.03, 0.1, 0.05, 0])
    data.ctrl[:] = V
    mujoco.mj_forward(model, data)
    stiffness = 1.0 / np.array(COMPLIANCE)
    spring = share * stiffness * (gap * play - 0.5 * gap * np.sign(play))
    carried = spring + 0.1 * np.sqrt(stiffness * DRIVES.rotor_inertia) * (data.qvel[n:] - DQ)
    links = rnea(pinocchio_arm(payload=True), Q, DQ, data.qacc[:n].copy())
    np.testing.assert_allclose(links, carried, rtol=0, atol=1e-6)  # as in test_elastic_transmissions


def test_links_with_backlash_hang_on_the_side_that_gravity_pulls_them_to():
    compliance, gap = np.array(COMPLIANCE), 3e-3
    plant = nominal_plant(errors=ModelErrors(joint_compliance=COMPLIANCE, backlash=gap))
    state = resting(plant, plant_model(plant, loaded=True, step=1e-3), Q)
    gravity = rnea(pinocchio_arm(payload=True), state[:6], np.zeros(6), np.zeros(6))
    np.testing.assert_array_equal(state[6:], Q)
    # Converged as in test_elastic_transmissions; nothing pulls joint 1, whose axis is upright, out of the middle.
    expected = -compliance * gravity - 0.5 * gap * np.sign(np.round(gravity, 9))
    np.testing.assert_allclose(state[:6] - Q, expected, rtol=0, atol=1e-13)
    assert {*np.sign(np.round(gravity, 9))} == {-1.0, 0.0, 1.0}


def test_rounding_pulls_no_link_out_of_the_middle_of_its_play(rng):
    plant = nominal_plant(errors=ModelErrors(joint_compliance=COMPLIANCE, backlash=3e-3))
    model = plant_model(plant, loaded=False, step=1e-3)
    for q in rng.uniform(-2.0, 2.0, (6, 6)):  # the centre of the last link is on its axis
        state = resting(plant, model, q)
        np.testing.assert_allclose(state[[0, 5]], q[[0, 5]], rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("values", "drives", "message"),
    [
        ({"backlash": 1e-3}, {}, r"backlash = 0\.001 rad needs elastic transmissions; state joint_compliance$"),
        (
            {"presliding": 2e-5},
            {},
            r"presliding = 2e-05 rad is too stiff for joint 6, whose dry friction is 4 N m on a rotor of 0\.268288 "
            r"kg m\^2; expected 9\.32e-05 rad or more$",
        ),
        (
            {"motor_warming": 50.0},
            {"current_limit": np.array([480.0, 480, 0, 110, 80, 45])},
            r"motor_warming refers to the current limit, but current_limit of joint 3 is 0; state one above 0$",
        ),
    ],
)
def test_effects_that_a_plant_has_no_place_for_are_refused(values, drives, message):
    with pytest.raises(PlantError, match=message):
        nominal_plant(errors=ModelErrors(**values), **drives)


@pytest.mark.parametrize("value", ["motor_waves", "viscous_power"])
def test_what_divides_or_shapes_a_wave_is_above_zero(value):
    with pytest.raises(PlantError, match=f"{value} = 0: expected more than 0 to"):
        ModelErrors(**{value: 0.0})


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("load_friction", {"transmitted_friction": 0.1}),
        ("load_friction", {"load_friction": 0.1}),
        ("cogging", {"cogging": 0.01}),
        ("cogging", {"torque_ripple": 0.1}),
        ("viscous_curve", {"viscous_curve": 0.5}),
        ("presliding", {"presliding": 3e-4}),
        ("temperature", {"motor_warming": 70.0, "gain_by_temperature": -1e-3}),
        ("temperature", {"motor_warming": 70.0, "coulomb_by_temperature": -1e-2}),
        ("temperature", {"motor_warming": 70.0, "viscous_by_temperature": 1e-2}),
    ],
)
def test_each_size_by_itself_switches_its_effect_on(name, values):
    assert [key for key, effect in EFFECTS.items() if effect.varies(ModelErrors(**values))] == [name]


@pytest.mark.parametrize(
    "values",
    [
        {"motor_waves": 50.0, "viscous_power": 2.0, "warming_time": 9.0},
        {"motor_warming": 70.0},
        {"gain_by_temperature": -1e-3},
    ],
)
def test_shapes_without_a_size_and_warmth_without_consequence_are_no_effect(values):
    assert not any(effect.varies(ModelErrors(**values)) for effect in EFFECTS.values())
