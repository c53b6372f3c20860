"""What makes drives as they are, each against the equation of its file written out again."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from pinocchio_arms import pinocchio_arm, rnea
from plants import nominal_plant

from sim.compile import plant_model, resting
from sim.effects import EFFECTS, ModelErrors
from sim.effects.effect import Build, ControlStep
from sim.engine import Engine, Simulation
from sim.errors import EffectError, PlantError
from sim.plant import Plant
from sim.varying import varied

Q = np.array([0.4, -0.3, 1.1, 0.7, 0.9, 0.2])
DQ = np.array([0.8, -1.1, 0.6, 1.4, -0.9, 1.2])
V = np.array([20.0, -35.0, 12.0, 6.0, -9.0, 4.0])
DRIVES = nominal_plant().drives
COMPLIANCE = (2e-5, 2.5e-5, 6e-5, 1e-4, 1.2e-4, 2e-4)
TURNS = np.vstack((np.eye(6), [0, 0, 0, 0, 1, 1]))
"""Speeds that friction rubs at: six joints, and motor 6 with q5 + q6."""


def step(**changes) -> ControlStep:
    """A control period of one simulation with a coupled motor."""
    constant = np.array([[26.0, 30.0, 16.0, 9.0, 7.0, 1.5, 2.5]])
    values = {
        "t": 0.31,
        "period": 0.002,
        "q": Q[None],
        "dq": DQ[None],
        "v": V[None],
        "constant": constant,
        "speed": (TURNS @ DQ)[None],
        "friction": constant.copy(),
        "damping": np.array([[31.0, 32.0, 12.0, 8.0, 5.5, 0.3, 2.4]]),
        "torque": np.full((1, 6), 0.75),
        "turns": TURNS[None],
        "transmitted": np.array([[5.0, -130.0, 41.0, -7.0, 3.0, 0.6]]),
        "warmth": np.array([[3.0, 21.0, 14.0, 0.5, 8.0, 33.0]]),
    }
    return ControlStep(**{**values, **changes})


def after(name: str, errors: ModelErrors, periods: int = 1, **changes) -> ControlStep:
    """What one effect makes of a period, the last of some."""
    plant = nominal_plant()
    build = Build(robot=plant.robot, drives=plant.drives, earlier=0, step=1e-3)
    assert EFFECTS[name].varies(errors)
    term = EFFECTS[name].term([errors], [build])
    for _ in range(periods):
        done = step(**changes)
        term(done)
    return done


def changed(done: ControlStep) -> set[str]:
    """Which of the arrays that an effect may change are others."""
    plain = step()
    return {
        name
        for name in ("friction", "damping", "torque", "warmth")
        if not np.array_equal(getattr(done, name), getattr(plain, name))
    }


def test_load_friction_is_a_share_of_either_torque_on_the_drive_s_own_joint():
    motor = after("load_friction", ModelErrors(load_friction=0.06))
    link = after("load_friction", ModelErrors(transmitted_friction=0.09))
    both = after("load_friction", ModelErrors(load_friction=0.06, transmitted_friction=0.09))
    by_motor = 0.06 * np.abs(DRIVES.gain * (V - DRIVES.amplifier_offset))
    by_link = 0.09 * np.array([5.0, 130.0, 41.0, 7.0, 3.0, 0.6])
    for done, expected in ((motor, by_motor), (link, by_link), (both, by_motor + by_link)):
        assert changed(done) == {"friction"}
        # Sums of two numbers below 50.
        np.testing.assert_allclose((done.friction - step().friction)[0], [*expected, 0.0], rtol=0, atol=1e-13)


def test_cogging_adds_and_ripple_multiplies_waves_over_the_motor_s_position():
    done = after("cogging", ModelErrors(cogging=0.003, torque_ripple=0.02, motor_waves=430.0))
    ripple = 0.02 * np.sin(430.0 * Q + 1.0) * DRIVES.gain * (V - DRIVES.amplifier_offset)
    cogging = 0.003 * DRIVES.gain * DRIVES.current_limit * np.sin(430.0 * Q)
    assert changed(done) == {"torque"}
    np.testing.assert_allclose(done.torque[0], 0.75 + ripple - cogging, rtol=1e-12)  # sines of angles up to 500
    alone = after("cogging", ModelErrors(torque_ripple=0.02, motor_waves=430.0))
    np.testing.assert_allclose(alone.torque[0], 0.75 + ripple, rtol=1e-12)


def test_a_drive_wired_backwards_cogs_like_any_other():
    plant = nominal_plant(gain=np.array([-0.9, 1.1, -1.3, 0.8, 0.7, 1.2]))
    build = Build(robot=plant.robot, drives=plant.drives, earlier=0, step=1e-3)
    done = step()
    EFFECTS["cogging"].term([ModelErrors(cogging=0.003, motor_waves=430.0)], [build])(done)
    expected = 0.75 - 0.003 * np.abs(plant.drives.gain) * plant.drives.current_limit * np.sin(430.0 * Q)
    np.testing.assert_allclose(done.torque[0], expected, rtol=1e-12)  # as above


@pytest.mark.parametrize("power", [1.0 / 3.0, 2.0])
def test_a_share_of_viscous_friction_follows_another_power_of_the_speed(power):
    errors = ModelErrors(viscous_curve=0.4, viscous_power=power, viscous_speed=0.7)
    done, plain = after("viscous_curve", errors), step()
    assert changed(done) == {"friction", "damping"}
    speed = np.abs(TURNS @ DQ)
    resisting = done.friction[0] + done.damping[0] * speed  # both against the motion
    expected = plain.damping[0] * (0.6 * speed + 0.4 * 0.7 * (speed / 0.7) ** power)
    np.testing.assert_allclose(resisting, plain.friction[0] + expected, rtol=1e-14)  # some roundings
    np.testing.assert_allclose(done.damping, 0.6 * plain.damping, rtol=1e-15)
    default = after("viscous_curve", ModelErrors(viscous_curve=0.4))
    np.testing.assert_allclose(
        default.friction[0], plain.friction[0] + 0.4 * plain.damping[0] * np.cbrt(speed), rtol=1e-14
    )


def test_a_warm_drive_is_weaker_and_rubs_less_by_its_own_temperature():
    errors = ModelErrors(
        motor_warming=200.0,
        warming_time=900.0,
        gain_by_temperature=-0.0013,
        coulomb_by_temperature=-0.007,
        viscous_by_temperature=-0.02,
    )
    done, plain = after("temperature", errors), step()
    x = plain.warmth[0]
    rubbing = np.array([*x, x[5]])  # the coupled motor is the sixth drive's
    drive = DRIVES.gain * (V - DRIVES.amplifier_offset)
    # Some roundings each.
    np.testing.assert_allclose(done.torque[0], 0.75 - 0.0013 * x * drive, rtol=1e-14)
    np.testing.assert_allclose(done.friction[0], plain.friction[0] * np.exp(-0.007 * rubbing), rtol=1e-14)
    np.testing.assert_allclose(done.damping[0], plain.damping[0] * np.exp(-0.02 * rubbing), rtol=1e-14)


def test_drives_warm_up_by_the_square_of_their_current_and_cool_down_by_themselves():
    # Against small steps of T dx/dt = W (v / v_max)^2 - x, whose error is half a step over T.
    errors = ModelErrors(motor_warming=200.0, warming_time=1.3, gain_by_temperature=-1e-3)
    warmth = np.array([[3.0, 21.0, 14.0, 0.5, 8.0, 33.0]])
    plain, x = warmth.copy(), warmth[0].copy()
    done = after("temperature", errors, periods=400, warmth=warmth)
    assert done.warmth is warmth
    for _ in range(400 * 20):
        x += 1e-4 / 1.3 * (200.0 * (V / DRIVES.current_limit) ** 2 - x)
    np.testing.assert_allclose(warmth[0], x, rtol=0, atol=5e-5 * np.abs(x - plain[0]).max())
    assert (np.abs(x - plain[0]) > 0.04).all()
    assert warmth[0, 5] < plain[0, 5]


def test_without_a_coupled_motor_there_is_no_friction_of_one():
    cut = {"friction": step().friction[:, :6].copy(), "damping": step().damping[:, :6].copy()}
    errors = ModelErrors(motor_warming=200.0, coulomb_by_temperature=-0.007)
    done = after("temperature", errors, **cut)
    np.testing.assert_allclose(done.friction[0], step().friction[0, :6] * np.exp(-0.007 * step().warmth[0]), rtol=1e-14)


def test_presliding_friction_is_dahl_s_and_takes_the_place_of_dry_friction():
    # Against small steps of ds/dt = (1 - s sign(dq)) dq / d at a held speed, 9 periods of one sign, 4 of the other.
    errors, plant = ModelErrors(presliding=0.013), nominal_plant()
    term = EFFECTS["presliding"].term([errors], [Build(robot=plant.robot, drives=plant.drives, earlier=0, step=1e-3)])
    s = np.zeros(7)
    for sign in [1.0] * 9 + [-1.0] * 4:
        done = step(dq=sign * DQ[None], speed=sign * (TURNS @ DQ)[None])
        term(done)
        before, speed = s.copy(), sign * (TURNS @ DQ)
        for _ in range(200):
            s += 0.002 / 200 * (1.0 - s * np.sign(speed)) * speed / 0.013
    assert not done.friction.any()
    expected = 0.75 - TURNS.T @ (step().friction[0] * before)
    # Euler's error: half a step of 1e-5 s times dq / d, 200 in 1/s at most.
    np.testing.assert_allclose(done.torque[0], expected, rtol=0, atol=0.02)
    assert np.ptp(before) > 0.1


def test_simulations_without_an_effect_are_left_alone_by_those_that_have_it():
    plant = nominal_plant()
    build = Build(robot=plant.robot, drives=plant.drives, earlier=0, step=1e-3)
    strong = ModelErrors(
        load_friction=0.1,
        transmitted_friction=0.1,
        cogging=0.01,
        torque_ripple=0.01,
        viscous_curve=0.4,
        presliding=0.01,
        motor_warming=300.0,
        coulomb_by_temperature=-0.01,
    )
    both = step()
    doubled = {
        name: np.repeat(getattr(both, name), 2, axis=0)
        for name in ("q", "dq", "v", "constant", "speed", "friction", "damping", "torque", "turns", "transmitted")
    }
    for name in ("load_friction", "cogging", "viscous_curve", "presliding", "temperature"):
        done = step(**{key: x.copy() for key, x in doubled.items()}, warmth=np.zeros((2, 6)))
        term = EFFECTS[name].term([ModelErrors(), strong], [build, build])
        for _ in range(3):
            term(done)
        for key in ("friction", "damping", "torque"):
            np.testing.assert_array_equal(getattr(done, key)[0], doubled[key][0])
        assert not done.warmth[0].any()
        assert any(not np.array_equal(getattr(done, key)[1], doubled[key][1]) for key in ("friction", "torque"))


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
    models = [plant_model(p, loaded=True, step=1e-3) for p in plants]
    acting = [varied(p, m, step=1e-3, earlier=0) for p, m in zip(plants, models, strict=True)]
    assert acting[1] is None
    entries = [Simulation(model=m, start=Q, varied=a) for m, a in zip(models[::-1], acting[::-1], strict=True)]
    engine, loop = Engine(entries, substeps=1, threads=1), Loop(plants[0], Q)
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

    watching = replace(EFFECTS["load_friction"], term=watched)
    monkeypatch.setitem(EFFECTS, "load_friction", watching)
    errors = ModelErrors(transmitted_friction=0.1, gravity_spring=9e3, joint_compliance=COMPLIANCE if elastic else None)
    plant = nominal_plant(errors=errors)
    model = plant_model(plant, loaded=True, step=1e-3)
    start = resting(plant, model, Q)
    acting = varied(plant, model, step=1e-3, earlier=0)
    engine = Engine([Simulation(model=model, start=start, varied=acting)], substeps=1, threads=1)
    twin, data = plant_model(plant, loaded=True, step=1e-3), mujoco.MjData(model)
    data.qpos[:] = start
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
    np.testing.assert_allclose(links, carried, rtol=0, atol=1e-6)  # as in test_effects


def test_links_with_backlash_hang_on_the_side_that_gravity_pulls_them_to():
    compliance, gap = np.array(COMPLIANCE), 3e-3
    plant = nominal_plant(errors=ModelErrors(joint_compliance=COMPLIANCE, backlash=gap))
    state = resting(plant, plant_model(plant, loaded=True, step=1e-3), Q)
    gravity = rnea(pinocchio_arm(payload=True), state[:6], np.zeros(6), np.zeros(6))
    np.testing.assert_array_equal(state[6:], Q)
    # Converged as the elastic arm of test_effects; nothing pulls joint 1, whose axis is upright, out of the middle.
    expected = -compliance * gravity - 0.5 * gap * np.sign(np.round(gravity, 9))
    np.testing.assert_allclose(state[:6] - Q, expected, rtol=0, atol=1e-13)
    assert {*np.sign(np.round(gravity, 9))} == {-1.0, 0.0, 1.0}


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
            r"motor_warming is of a drive's largest current, but current_limit of joint 3 is 0; state one above 0$",
        ),
    ],
)
def test_effects_that_a_plant_has_no_place_for_are_refused(values, drives, message):
    with pytest.raises(EffectError, match=message):
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
