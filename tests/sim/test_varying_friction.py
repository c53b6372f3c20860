"""Friction that varies: by speed, load and direction within a motion, and from motion to motion."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from accelerations import STEP
from drive_states import COMPLIANCE, simulation_of
from plants import experiment, nominal_plant, streams

from sim.compile import plant_model
from sim.effects import ModelErrors
from sim.engine import Engine
from sim.record import record

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
    beside = record([varying, other], streams(3, 4), threads=1)[0]
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


def test_friction_follows_from_the_current_that_the_drive_takes_of_what_it_is_given():
    limit = nominal_plant().drives.current_limit
    plants = [
        nominal_plant(errors=ModelErrors(load_friction=0.3), current_limit=x * limit) for x in (1.0, 1.0, 0.6, 0.6)
    ]
    engine = Engine([simulation_of(plant, step=1e-3, earlier=0) for plant in plants], substeps=1, threads=1)
    for _ in range(20):
        engine.current[:] = np.outer([1.0, 2.0, -0.6, -5.0], limit)
        engine.advance()
    np.testing.assert_array_equal(engine.q[[0, 2]], engine.q[[1, 3]])
