import re
from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from drive_states import COMPLIANCE, DQ, Q, V, simulation_of
from pinocchio_arms import pinocchio_arm, rnea
from plants import RX90, experiment, nominal_plant, streams

import rx90_mjcf
from sim.compile import plant_model, resting
from sim.effects import ModelErrors
from sim.effects.joint_elasticity import FASTEST_MODE
from sim.engine import Engine, Simulation
from sim.errors import PlantError
from sim.plant import Plant, layout
from sim.record import record, try_record

STEP = 1e-3
SOLVER = 1e-6
"""Torque [N m] that the friction solver leaves at its default tolerance, as in test_model."""


def acceleration(plant: Plant, q: np.ndarray, dq: np.ndarray, *, loaded: bool = False) -> np.ndarray:
    model = plant_model(plant, loaded=loaded, step=STEP)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.ctrl[:] = q, dq, V
    mujoco.mj_forward(model, data)
    return data.qacc.copy()


def drive_torque(plant: Plant, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """What the drives give after rotors and friction [N m]."""
    d = plant.drives
    torque = d.gain * (V - d.amplifier_offset) - d.coulomb_asymmetry - d.rotor_inertia * ddq
    return torque - d.viscous_friction * dq - d.coulomb_friction * np.sign(dq)


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


def coupling(share: float, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """Torque that motor 6 costs because it turns with q5 + q6, less what it costs turning with q6 [N m]."""
    inertia, viscous, coulomb = RX90.drives.rotor_inertia[5], 2.4, 2.5
    dry = coulomb * np.sign(dq[4] + dq[5])
    cost = np.zeros(6)
    cost[4] = inertia * ddq[5] + viscous * dq[5] + dry
    cost[5] = inertia * ddq[4] + viscous * dq[4] + dry - coulomb * np.sign(dq[5])
    return share * cost


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


@pytest.mark.parametrize("share", [0.0, 1.0])
@pytest.mark.parametrize("loaded", [False, True])
def test_links_and_motors_of_an_elastic_arm_obey_spong_s_equations(share, loaded):
    # M ddq + h = Ke (q_m - q) + De (dq_m - dq), Ia ddq_m + friction = tau - the same, De = 2 * 0.05 sqrt(Ke Ia).
    plant = nominal_plant(errors=ModelErrors(joint_compliance=COMPLIANCE, wrist_coupling=share))
    q_motor, dq_motor = Q + 1e-3 * np.array([1, -2, 1, 0.5, -0.3, 0.2]), DQ + np.array([0.02, 0, -0.03, 0.1, 0.05, 0])
    ddq = acceleration(plant, np.append(Q, q_motor), np.append(DQ, dq_motor), loaded=loaded)
    stiffness = 1.0 / np.array(COMPLIANCE)
    damping = 0.1 * np.sqrt(stiffness * plant.drives.rotor_inertia)
    transmitted = stiffness * (q_motor - Q) + damping * (dq_motor - DQ)
    np.testing.assert_allclose(rnea(pinocchio_arm(payload=loaded), Q, DQ, ddq[:6]), transmitted, rtol=0, atol=SOLVER)
    motors = drive_torque(plant, dq_motor, ddq[6:]) - coupling(share, dq_motor, ddq[6:])
    np.testing.assert_allclose(motors, transmitted, rtol=0, atol=SOLVER)


def test_an_elastic_arm_at_rest_hangs_below_its_motors_by_gravity_times_compliance():
    plant = nominal_plant(errors=ModelErrors(joint_compliance=COMPLIANCE))
    state = resting(plant, plant_model(plant, loaded=True, step=STEP), Q)
    np.testing.assert_array_equal(state[6:], Q)
    gravity = rnea(pinocchio_arm(payload=True), state[:6], np.zeros(6), np.zeros(6))
    # Converged: the iteration contracts by 0.03, 20 times; what is left is rounding of 300 N m over 5e4 N m/rad.
    np.testing.assert_allclose(state[:6] - Q, -np.array(COMPLIANCE) * gravity, rtol=0, atol=1e-14)
    assert np.abs(state[:6] - Q).max() > 1e-4


def test_encoders_of_an_elastic_arm_read_the_motors():
    plant = nominal_plant(errors=ModelErrors(joint_compliance=COMPLIANCE))
    model = plant_model(plant, loaded=True, step=STEP)
    start = resting(plant, model, Q)
    engine = Engine([Simulation(model=model, start=start)], substeps=1, threads=1)
    np.testing.assert_array_equal(engine.q[0], Q)


@pytest.mark.parametrize("share", [0.0, 1.0])
@pytest.mark.parametrize("loaded", [False, True])
def test_the_stiffest_transmission_that_is_taken_is_stable(share, loaded):
    inertia = nominal_plant().drives.rotor_inertia
    stiffest = STEP**2 / (FASTEST_MODE**2 * inertia)

    def elastic(factor: float) -> Plant:
        return nominal_plant(errors=ModelErrors(joint_compliance=tuple(factor * stiffest), wrist_coupling=share))

    plant = elastic(1.001)
    model = plant_model(plant, loaded=loaded, step=STEP)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:6] = resting(plant, model, Q), 0.3
    for _ in range(1000):
        mujoco.mj_step(model, data)
    # The arm falls; an unstable link would leave its motor by many rad/s.
    assert np.abs(data.qvel[:6] - data.qvel[6:]).max() < 0.1
    with pytest.raises(PlantError, match=r"joint_compliance of joint \d = .* too stiff for a step of 0\.001 s; use a"):
        plant_model(elastic(0.99), loaded=loaded, step=STEP)


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


BY_DIRECTION = {"coulomb_by_direction": 0.3, "viscous_by_direction": -0.5}
VARYING = ModelErrors(
    stribeck=0.4,
    stribeck_speed=0.2,
    load_friction=0.05,
    wrist_coupling=1.0,
    coulomb_drift=0.1,
    viscous_drift=-0.2,
    **BY_DIRECTION,
)


@pytest.mark.parametrize("elastic", [False, True])
def test_varying_friction_is_the_stated_law_at_the_start_of_every_period(elastic):
    # Against a loop over mj_step that evaluates the law as it is written, beside a simulation of constant friction.
    errors = replace(VARYING, joint_compliance=COMPLIANCE if elastic else None)
    plant, n, substeps = nominal_plant(errors=errors), 6, 2
    constant = nominal_plant(
        errors=replace(errors, stribeck=0.0, load_friction=0.0, **dict.fromkeys(BY_DIRECTION, 0.0))
    )
    entries = [simulation_of(p, step=5e-4, earlier=1) for p in (plant, constant)]
    assert entries[1].varied is None
    engine = Engine(entries, substeps=substeps, threads=1)
    currents = np.random.default_rng(0).uniform(-40, 40, (60, 2, n))
    seen = []
    for v in currents:
        engine.current[:] = v
        engine.advance()
        seen.append(engine.q.copy())
    coulomb = 1.1 * (plant.drives.coulomb_friction - [0, 0, 0, 0, 0, 2.5])
    viscous = 0.8 * (plant.drives.viscous_friction - [0, 0, 0, 0, 2.4, 2.4])
    for i, p in enumerate((plant, constant)):
        model = plant_model(p, loaded=True, step=5e-4, earlier=1)
        data = mujoco.MjData(model)
        data.qpos[:] = entries[i].start
        for v, expected in zip(currents[:, i], np.array(seen)[:, i], strict=True):
            dq = data.qvel[-n:]
            if p is plant:
                load = np.abs(p.drives.gain * (v - p.drives.amplifier_offset))
                side, peak = np.sign(dq), 1 + 0.4 * np.exp(-((dq / 0.2) ** 2))
                model.dof_frictionloss[-n:] = coulomb * peak * (1 + 0.15 * side) + 0.05 * load
                model.dof_damping[-n:] = viscous * (1 - 0.25 * side)
                turns, tendon = dq[4] + dq[5], model.tendon("joint6_coupling").id
                peak, side = 1 + 0.4 * np.exp(-((turns / 0.2) ** 2)), np.sign(turns)
                model.tendon_frictionloss[tendon] = 1.1 * 2.5 * peak * (1 + 0.15 * side)
                model.tendon_damping[tendon] = 0.8 * 2.4 * (1 - 0.25 * side)
            data.ctrl[:] = v
            for _ in range(substeps):
                mujoco.mj_step(model, data)
            # Both sum in another order: rounding, which 120 steps of a well-damped arm do not amplify.
            np.testing.assert_allclose(expected, data.qpos[-n:], rtol=0, atol=1e-9)


def test_experiments_on_one_plant_with_varying_friction_do_not_share_it():
    varying = experiment(plant=nominal_plant(errors=VARYING))
    other = replace(varying, trajectory=replace(varying.trajectory, sine=-varying.trajectory.sine))
    alone = record([varying], streams(3), threads=1)[0]
    beside = record([varying, other], streams(3, 4), threads=2)[0]
    assert alone.q.tobytes() == beside.q.tobytes()
    assert alone.v.tobytes() == beside.v.tobytes()


def test_friction_drifts_between_the_unloaded_and_the_loaded_motion_and_transmissions_do_not():
    errors = ModelErrors(
        coulomb_drift=0.2, viscous_drift=-0.1, wrist_coupling=1.0, joint_compliance=COMPLIANCE, gravity_spring=1e3
    )
    bare, loaded = (
        plant_model(nominal_plant(errors=errors), loaded=x, step=STEP, earlier=int(x)) for x in (False, True)
    )
    # One rounding of a product.
    np.testing.assert_allclose(loaded.dof_frictionloss, 1.2 * bare.dof_frictionloss, rtol=1e-15)
    np.testing.assert_allclose(loaded.dof_damping, 0.9 * bare.dof_damping, rtol=1e-15)
    np.testing.assert_allclose(loaded.tendon_frictionloss, 1.2 * bare.tendon_frictionloss, rtol=1e-15)
    for k in range(bare.ntendon):
        factor = 0.9 if bare.tendon(k).name == "joint6_coupling" else 1.0
        np.testing.assert_allclose(loaded.tendon_damping[k], factor * bare.tendon_damping[k], rtol=1e-15)
    np.testing.assert_array_equal(bare.dof_frictionloss[6:10], nominal_plant().drives.coulomb_friction[:4])


def test_friction_goes_on_drifting_from_motion_to_motion():
    plant = nominal_plant(errors=ModelErrors(coulomb_drift=-0.3, viscous_drift=0.5))
    models = [plant_model(plant, loaded=False, step=STEP, earlier=k) for k in range(4)]
    for k, model in enumerate(models):
        # One rounding a power.
        np.testing.assert_allclose(model.dof_frictionloss, 0.7**k * plant.drives.coulomb_friction, rtol=1e-15)
        np.testing.assert_allclose(model.dof_damping, 1.5**k * plant.drives.viscous_friction, rtol=1e-15)


@pytest.mark.parametrize("name", BY_DIRECTION)
def test_either_friction_may_differ_by_direction_alone(name):
    plain, other = (experiment(plant=nominal_plant(errors=ModelErrors(**{name: x}))) for x in (0.0, 0.4))
    first, second = record([plain, other], streams(0, 0), threads=1)
    assert np.abs(second.v - first.v).max() > 0.1


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
            r"wrist_coupling = 1 leaves joint 6 a coulomb_friction of -0\.5 N m; use a smaller share",
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


def test_compliances_of_another_arm_are_refused():
    with pytest.raises(PlantError, match=r"joint_compliance: 2 values \[rad/\(N m\)\], expected 6, one a joint"):
        nominal_plant(errors=ModelErrors(joint_compliance=(1e-5, 1e-5)))


def test_zero_compliance_is_a_rigid_joint():
    assert ModelErrors(joint_compliance=(0.0,) * 6) == ModelErrors()


def test_a_transmission_turns_by_a_radian_under_ten_newton_metres_at_most():
    softest = (1e-4, 0.1, 1e-4, 1e-4, 1e-4, 1e-4)
    assert ModelErrors(joint_compliance=softest).joint_compliance == softest
    with pytest.raises(PlantError, match=r"expected positive numbers up to 0\.1, one a joint"):
        ModelErrors(joint_compliance=(*softest[:5], 0.1001))


def test_joints_that_no_effect_settles_are_at_rest_at_zero(monkeypatch):
    plant = nominal_plant(errors=ModelErrors(joint_compliance=COMPLIANCE))
    model = plant_model(plant, loaded=True, step=STEP)
    monkeypatch.setattr("sim.compile.EFFECTS", {})
    q = np.array([0.4, -0.3, 1.1, 0.7, 0.9, 0.2])
    np.testing.assert_array_equal(resting(plant, model, q), [*np.zeros(6), *q])
