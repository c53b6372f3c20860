import mujoco
import numpy as np
import pinocchio as pin
import pytest
from plants import CYLINDER, nominal_plant

import rx90_mjcf
from ident.payload import standard_parameters
from sim.compile import plant_model
from sim.errors import PlantError
from sim.plant import PayloadBody

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


def test_current_is_limited(rng):
    model = plant_model(nominal_plant(current_limit=np.full(6, 10.0)), loaded=False, step=STEP)
    np.testing.assert_array_equal(acceleration(model, np.full(6, 50.0)), acceleration(model, np.full(6, 10.0)))


def test_bare_and_loaded_models_have_one_layout_and_the_bare_one_is_the_arm():
    bare, loaded = (plant_model(nominal_plant(), loaded=x, step=STEP) for x in (False, True))
    assert bare.nbody == loaded.nbody
    arm = mujoco.MjModel.from_xml_path(str(rx90_mjcf.MJCF))
    np.testing.assert_array_equal(bare.body_mass[:-1], arm.body_mass)
    assert bare.body("payload").mass == 0.0
    assert loaded.body("payload").mass == CYLINDER.mass


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
