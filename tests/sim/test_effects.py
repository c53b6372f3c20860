import re
from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from pinocchio_arms import pinocchio_arm, rnea
from plants import RX90, experiment, nominal_plant, streams, try_record
from refusals import refused

import sim.plant
from sim.effects import EFFECTS, ModelErrors
from sim.effects.motors import gain_at
from sim.effects.transmissions import FASTEST_MODE
from sim.engine import Engine, Simulation, Varying, acting, varies
from sim.errors import PlantError
from sim.feedforward_currents import feedforward_currents
from sim.model_spec import arm_joints, driven_joints
from sim.plant import PayloadBody, Plant, plant_model, resting
from sim.trajectory import FourierTrajectory

Q = np.array([0.4, -0.3, 1.1, 0.7, 0.9, 0.2])
DQ = np.array([0.8, -1.1, 0.6, 1.4, -0.9, 1.2])
V = np.array([20.0, -35.0, 12.0, 6.0, -9.0, 4.0])
DRIVES = nominal_plant().drives
COMPLIANCE = (2e-5, 2.5e-5, 6e-5, 1e-4, 1.2e-4, 2e-4)
TURNS = np.vstack((np.eye(6), [0, 0, 0, 0, 1, 1]))
"""Speeds that friction rubs at: six joints, and motor 6 with q5 + q6."""


def simulation_of(plant: Plant, *, step: float, earlier: int = 0) -> Simulation:
    """A loaded plant at rest at `Q`, with what varies of it."""
    model = plant_model(plant, loaded=True, step=step, earlier=earlier)
    acts = acting(plant, model, step=step, earlier=earlier) if varies(plant.errors) else None
    return Simulation(model=model, start=resting(plant, model, Q), varied=acts)


STEP = 1e-3
SOLVER = 1e-6
"""Torque [N m] that the friction solver leaves at its default tolerance, as in test_model."""


def acceleration(plant: Plant, q: np.ndarray, dq: np.ndarray, *, loaded: bool = False, earlier: int = 0) -> np.ndarray:
    model = plant_model(plant, loaded=loaded, step=STEP, earlier=earlier)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.ctrl[:] = q, dq, V
    mujoco.mj_forward(model, data)
    return data.qacc.copy()


def drive_torque(plant: Plant, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """What the drives give after rotors and friction, that of the third motion, [N m]."""
    d, e = plant.drives, plant.errors
    torque = d.gain * (V - d.amplifier_offset) - d.coulomb_asymmetry - d.rotor_inertia * ddq
    torque = torque - (1.0 + e.viscous_drift) ** 2 * d.viscous_friction * dq
    return torque - (1.0 + e.coulomb_drift) ** 2 * d.coulomb_friction * np.sign(dq)


def coupling(e: ModelErrors, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """Torque that motor 6 costs because it turns with q5 + q6, less what it costs turning with q6 [N m]."""
    inertia, viscous, coulomb = RX90.drives.rotor_inertia[5], 2.4, 2.5
    viscous, coulomb = (1.0 + e.viscous_drift) ** 2 * viscous, (1.0 + e.coulomb_drift) ** 2 * coulomb
    dry = coulomb * np.sign(dq[4] + dq[5])
    cost = np.zeros(6)
    cost[4] = inertia * ddq[5] + viscous * dq[5] + dry
    cost[5] = inertia * ddq[4] + viscous * dq[4] + dry - coulomb * np.sign(dq[5])
    return e.wrist_coupling * cost


def gravity_spring(stiffness: float, q2: float) -> np.ndarray:
    """Torque of the spring, INRIA HuMAnS, SpringForce.c: prestress 6257.75 N at 20295 N/m, 0.06 m * 0.45 m."""
    length = np.sqrt(0.0036 * np.sin(q2) ** 2 + (0.45 - 0.06 * np.cos(q2)) ** 2)
    return -0.027 * stiffness * (1.0 - 6257.75 / 20295.0 / length) * np.sin(q2) * np.eye(6)[1]


ZEROS = (0.03, -0.02, 0.011, -0.04, 0.05, 0.007)


@pytest.mark.parametrize(
    ("loaded", "q2", "share", "dq5"), [(True, -0.9, 1.0, -0.9), (False, 1.4, 0.4, -1.5), (False, 0.3, 0.0, -0.9)]
)
def test_the_compiled_model_obeys_the_stated_equation_with_errors_of_geometry_spring_and_coupling(
    loaded, q2, share, dq5
):
    # M ddq + C dq + Q + Ia ddq = g (v - v0) - Fv dq - Fc sign(dq) - Fcoff, with Pinocchio for the left side; products
    # of inertia of the payload, its centre of mass beside every axis, gains of either sign. Zeros, slope and frames 3
    # and 4, of which d3 = r4 = 0.45 m as drawn, move the arm; dq5 + dq6 is of either sign.
    geometry = {"base_tilt_x": 0.03, "base_tilt_y": -0.05, "d3_error": 0.004, "r4_error": -0.003, "zero_error": ZEROS}
    body = PayloadBody(mass=3.7, com=(0.04, -0.07, 0.11), inertia=(0.031, 0.027, 0.019, 0.004, -0.006, 0.0025))
    errors = ModelErrors(**geometry, gravity_spring=20295.0, wrist_coupling=share)
    plant = nominal_plant(body, errors, gain=np.array([-0.9, 1.3, 0.7, -1.6, 1.1, -0.4]))
    arm = pinocchio_arm(payload=loaded, body=body)
    slope = pin.SE3(pin.utils.rotate("x", 0.03) @ pin.utils.rotate("y", -0.05), np.zeros(3))
    arm.jointPlacements[1] = slope * arm.jointPlacements[1]
    arm.jointPlacements[3].translation = np.array([0.454, 0.0, 0.0])
    arm.jointPlacements[4].translation = np.array([0.0, -0.447, 0.0])
    q, dq = np.where(np.arange(6) == 1, q2, Q), np.where(np.arange(6) == 4, dq5, DQ)
    ddq = acceleration(plant, q, dq, loaded=loaded)
    expected = drive_torque(plant, dq, ddq) + gravity_spring(20295.0, q2 - ZEROS[1]) - coupling(errors, dq, ddq)
    np.testing.assert_allclose(rnea(arm, q - np.array(ZEROS), dq, ddq), expected, rtol=0, atol=SOLVER)


def test_impossible_errors_are_refused():
    for values, message in (
        ({"wrist_coupling": 1.2}, r"errors: wrist_coupling = 1\.2: expected 0 to 1$"),
        ({"base_tilt_x": np.inf}, r"errors: base_tilt_x = inf: expected a finite number"),
        ({"zero_error": (0.1, 0.6)}, r"errors: zero_error = \[0\.1, 0\.6\] rad: expected numbers between"),
        ({"joint_compliance": (1e-4, 0.0)}, r"errors: joint_compliance = \[0\.0001, 0\.0\] rad/\(N m\): expected"),
        ({"joint_compliance": (0.1001,) * 6}, r"expected positive numbers up to 0\.1, one per joint"),
    ):
        refused(PlantError, message, ModelErrors, **values)


STRETCH = np.array([1.0, -2.0, 1.0, 0.5, -0.3, 0.2])
WITHIN, BEYOND = np.array([0.2, -0.6, 0.9, -0.2, 0.4, -0.98]), np.array([1.2, -4.0, 1.6, -1.4, 6.0, -1.1])


@pytest.mark.parametrize(
    ("stretch", "gap", "share", "loaded"),
    [(STRETCH, 0.0, 0.0, True), (STRETCH, 0.0, 1.0, False), (WITHIN, 2e-3, 0.0, True), (BEYOND, 2e-3, 0.4, True)],
)
def test_links_and_motors_of_an_elastic_arm_obey_spong_s_equations_with_play(stretch, gap, share, loaded):
    # M ddq + h = Ke (q_m - q) + De (dq_m - dq), Ia ddq_m + friction = tau - the same, De = 2 * 0.05 sqrt(Ke Ia);
    # within half a gap the spring carries nothing.
    drift = {"coulomb_drift": 0.2, "viscous_drift": -0.1}
    errors = ModelErrors(joint_compliance=COMPLIANCE, wrist_coupling=share, backlash=gap, **drift)
    plant = nominal_plant(errors=errors)
    q_motor, dq_motor = Q + 1e-3 * stretch, DQ + np.array([0.02, 0, -0.03, 0.1, 0.05, 0])
    ddq = acceleration(plant, np.append(Q, q_motor), np.append(DQ, dq_motor), loaded=loaded, earlier=2)
    stiffness = 1.0 / np.array(COMPLIANCE)
    spring = stiffness * (1e-3 * stretch - np.clip(1e-3 * stretch, -gap / 2.0, gap / 2.0))
    transmitted = spring + 0.1 * np.sqrt(stiffness * plant.drives.rotor_inertia) * (dq_motor - DQ)
    np.testing.assert_allclose(rnea(pinocchio_arm(payload=loaded), Q, DQ, ddq[:6]), transmitted, rtol=0, atol=SOLVER)
    motors = drive_torque(plant, dq_motor, ddq[6:]) - coupling(errors, dq_motor, ddq[6:])
    np.testing.assert_allclose(motors, transmitted, rtol=0, atol=SOLVER)


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


STRONG = ModelErrors(
    wrist_coupling=1.0,
    gravity_spring=9e3,
    coulomb_drift=0.04,
    viscous_drift=-0.06,
    stribeck=0.3,
    coulomb_by_direction=0.2,
    viscous_by_direction=-0.3,
    load_friction=0.04,
    transmitted_friction=0.07,
    gear_friction=0.05,
    cogging=0.004,
    torque_ripple=0.03,
    motor_waves=200.0,
    torque_constant_falls=0.07,
    torque_constant_bends=0.05,
    gain_by_sign=-0.06,
    gain_drift=0.02,
    viscous_curve=0.5,
    viscous_speed=0.7,
    motor_warming=5e3,
    warming_time=2.0,
    gain_by_temperature=-0.004,
    coulomb_by_temperature=-0.006,
    viscous_by_temperature=-0.03,
    dress_pack=0.02,
    dress_reach=0.03,
)


class Loop:
    """The laws written out again around `mj_step`, link torques from Pinocchio or of springs."""

    def __init__(self, plant: Plant, start: np.ndarray, earlier: int) -> None:
        self.errors, self.drives, self.earlier = plant.errors, plant.drives, earlier
        self.model = plant_model(plant, loaded=True, step=1e-3)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:] = start
        self.tendon = self.model.tendon("joint6_coupling").id
        self.arm, self.link = pinocchio_arm(payload=True), np.zeros(6)
        self.x, self.s, self.hose = np.zeros(6), np.zeros(7), np.zeros(6)
        self.coulomb = 1.04**earlier * np.append(self.drives.coulomb_friction - [0, 0, 0, 0, 0, 2.5], 2.5)
        self.viscous = 0.94**earlier * np.append(self.drives.viscous_friction - [0, 0, 0, 0, 2.4, 2.4], 2.4)

    def advance(self, v: np.ndarray) -> None:
        e, d, data = self.errors, self.drives, self.data
        (links, moves), (q, dq) = ((data.qpos[x].copy(), data.qvel[x].copy()) for x in (slice(6), slice(-6, None)))
        speed, drive = TURNS @ dq, d.gain * (v - d.amplifier_offset)
        side, warm = np.sign(speed), np.append(self.x, self.x[5])
        dry = self.coulomb * (1 + 0.3 * np.exp(-((speed / 0.1) ** 2))) * (1 + 0.1 * side) * np.exp(-0.006 * warm)
        damping = self.viscous * (1 - 0.15 * side) * np.exp(-0.03 * warm)
        dry += 0.5 * damping * 0.7 * (np.abs(speed) / 0.7) ** e.viscous_power
        geared = self.link + (dry * side + 0.5 * damping * speed)[:6]
        dry[:6] += 0.04 * np.abs(drive) + 0.07 * np.abs(self.link) + 0.05 * np.abs(geared)
        torque = -0.004 * self.x * drive + 0.03 * np.sin(200 * q + 1) * drive
        torque -= 0.004 * np.abs(d.gain) * d.current_limit * np.sin(200 * q)
        share = np.abs(v) / d.current_limit
        torque -= (0.07 * share + 0.05 * share**2 + 0.03 * np.sign(v) - (1.02**self.earlier - 1)) * drive
        torque -= 0.02 * np.abs(d.gain) * d.current_limit * self.hose
        self.hose = np.sign(dq) + (self.hose - np.sign(dq)) * np.exp(-1e-3 * np.abs(dq) / 0.03)
        if e.presliding:
            torque -= TURNS.T @ (dry * self.s)
            self.s = side + (self.s - side) * np.exp(-1e-3 * np.abs(speed) / e.presliding)
            dry[:] = 0.0
        heat = 5e3 * (v / d.current_limit) ** 2
        self.x = heat + (self.x - heat) * np.exp(-1e-3 / 2.0)
        self.model.dof_frictionloss[-6:], self.model.tendon_frictionloss[self.tendon] = dry[:6], dry[6]
        self.model.dof_damping[-6:], self.model.tendon_damping[self.tendon] = 0.5 * damping[:6], 0.5 * damping[6]
        data.ctrl[:], data.qfrc_applied[-6:] = v, torque
        mujoco.mj_step(self.model, data)
        if e.joint_compliance is None:
            self.link = rnea(self.arm, q, dq, data.qacc.copy()) - gravity_spring(9e3, q[1])
        else:
            stiffness = 1.0 / np.array(COMPLIANCE)
            self.link = stiffness * (q - links) + 0.1 * np.sqrt(stiffness * d.rotor_inertia) * (dq - moves)


@pytest.mark.parametrize(
    ("presliding", "power", "compliance"), [(0.0, 1.0 / 3.0, None), (0.004, 2.0, None), (0.0, 2.0, COMPLIANCE)]
)
def test_all_effects_together_are_the_laws_at_the_start_of_every_period_and_leave_other_plants_alone(
    presliding, power, compliance
):
    errors = replace(STRONG, presliding=presliding, viscous_power=power, joint_compliance=compliance)
    plain = ModelErrors(wrist_coupling=1.0, gravity_spring=9e3, joint_compliance=compliance)  # of the same layout
    plants = [nominal_plant(errors=errors, gain=DRIVES.gain * [1, -1, 1, -1, 1, -1]), nominal_plant(errors=plain)]
    entries = [simulation_of(plant, step=1e-3, earlier=3) for plant in plants]
    assert entries[1].varied is None
    engine, loop = Engine(entries[::-1], substeps=1, threads=1), Loop(plants[0], entries[0].start, earlier=3)
    model, data = entries[1].model, mujoco.MjData(entries[1].model)
    data.qpos[:] = entries[1].start
    for v in np.random.default_rng(0).uniform(-40, 40, (80, 6)):
        engine.current[:] = v
        engine.advance()
        loop.advance(v)
        # Sums in another order, and link torques that two programs agree on to SOLVER = 1e-6 N m.
        np.testing.assert_allclose(engine.q[1], loop.data.qpos[-6:], rtol=0, atol=1e-9)
        data.ctrl[:] = v
        mujoco.mj_step(model, data)
        np.testing.assert_array_equal(engine.q[0], data.qpos[-6:])
    np.testing.assert_allclose(engine.warmth()[1], loop.x, rtol=1e-12)  # 80 products and sums
    assert not engine.warmth()[0].any()
    assert np.abs(loop.link).max() > 20.0
    assert loop.x.max() > 5.0


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


def test_effects_that_a_plant_has_no_place_for_are_refused():
    weak, uneven = np.array([480.0, 480, 0, 110, 80, 45]), np.array([1.0, 1, 1, 1, 1, 2])
    stiff = (
        r"presliding = 2e-05 rad is too stiff for joint 6, whose dry friction is 4 N m on a rotor of 0\.268288 kg "
        r"m\^2; expected 9\.32e-05 rad or more$"
    )
    for values, drives, message in (
        ({"backlash": 1e-3}, {}, r"backlash = 0\.001 rad needs elastic transmissions; state joint_compliance$"),
        ({"presliding": 2e-5}, {}, stiff),
        ({"wrist_coupling": 1.0}, {"coulomb_friction": uneven}, r"joint 6 a coulomb_friction of -0\.5 N m, below 0"),
        ({"joint_compliance": COMPLIANCE}, {"rotor_inertia": np.zeros(6)}, r"needs a rotor_inertia above 0 kg m\^2"),
        ({"motor_warming": 50.0}, {"current_limit": weak}, r"current_limit of joint 3 is 0; state one above 0$"),
    ):
        with pytest.raises(PlantError, match=message):
            plant_model(nominal_plant(errors=ModelErrors(**values), **drives), loaded=False, step=STEP)


def test_a_gain_at_a_current_is_torque_per_current_there_without_the_offset_and_the_mean_of_both_signs():
    errors = ModelErrors(torque_constant_falls=0.07, torque_constant_bends=0.05, gain_by_sign=-0.06)
    plant = nominal_plant(errors=errors, amplifier_offset=np.zeros(6), coulomb_asymmetry=np.zeros(6))
    entry = simulation_of(plant, step=STEP)
    still = dict.fromkeys(("dq", "ddq", "rubbing"), np.zeros((1, 6)))
    torques = [
        plant.drives.gain * v
        + Varying([entry.varied], [entry.model], period=STEP).torque(q=Q[None], v=v[None], **still)[0]
        for v in (V, -V)
    ]
    np.testing.assert_allclose((torques[0] - torques[1]) / (2.0 * V), gain_at(errors, plant.drives, V), rtol=1e-12)


SIZES = {
    "LoadFriction": ("load_friction", "transmitted_friction", "gear_friction"),
    "Cogging": ("cogging", "torque_ripple"),
    "GainLaws": ("torque_constant_falls", "torque_constant_bends", "gain_by_sign", "gain_drift"),
    "FrictionByDirection": ("coulomb_by_direction", "viscous_by_direction"),
    "Stribeck": ("stribeck",),
    "ViscousCurve": ("viscous_curve",),
    "Presliding": ("presliding",),
    "DressPack": ("dress_pack",),
}


def test_each_size_by_itself_switches_its_effect_on_and_a_shape_or_warmth_without_consequence_does_not():
    on = [(effect, {size: 0.003}) for effect, sizes in SIZES.items() for size in sizes]
    by = ("gain_by_temperature", "coulomb_by_temperature", "viscous_by_temperature")
    on += [("Temperature", {"motor_warming": 70.0, name: -1e-3}) for name in by]
    off = {"motor_waves": 50.0, "viscous_power": 2.0, "warming_time": 9.0}, {"motor_warming": 70.0}, {by[0]: -1e-3}
    for name, values in (*on, *((None, each) for each in off)):
        assert [key for key, effect in EFFECTS.items() if effect.varies(ModelErrors(**values))] == [name][: bool(name)]


BODY = PayloadBody(mass=5.3, com=(0.05, -0.03, 0.14), inertia=(0.0125, 0.0118, 0.009, 0.0006, -0.0004, 0.0003))
LOOSE = {"loose_share": 0.37, "loose_hz": 3.1, "loose_damping": 0.13}
TABLE = {"table_hz": 4.3, "table_damping": 0.11}
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
