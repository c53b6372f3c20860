from dataclasses import replace

import mujoco
import numpy as np
import pytest

from scenarios.design.weights import MASS_STD, SEAT_MM, SHAPES, TURN, Weight, dimension_std, payload_of, solids
from sim.clearance import add_solid
from sim.flange import Flange

BAR = Weight(shape="bar", dimensions=(47.0, 133.0, 91.0), quarter=3, density=7850.0)
WIDE = Weight(shape="bar", dimensions=(83.0, 61.0, 45.0), quarter=0, density=2700.0)
CYLINDER = Weight(shape="cylinder", dimensions=(171.0, 29.0, 53.0), quarter=1, density=7850.0)
PLATE = Weight(shape="plate", dimensions=(310.0, 87.0, 23.0, 77.0), quarter=2, density=8900.0)
WEIGHTS = [BAR, WIDE, CYLINDER, PLATE]


def tilted() -> Flange:
    quat, R = np.array([0.7, -0.4, 0.5, 0.31]), np.empty(9)
    mujoco.mju_quat2Mat(R, quat / np.linalg.norm(quat))
    return Flange(origin=np.array([0.012, -0.034, 0.085]), rotation=R.reshape(3, 3), name="flange")


def as_mujoco_has_it(weight: Weight, flange: Flange) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre and inertia of its shapes, by MuJoCo."""
    spec = mujoco.MjSpec()
    body = spec.worldbody.add_body(name="weight")
    for solid in solids(weight, flange):
        add_solid(body, solid)
    for geom in spec.geoms:
        geom.mass, geom.density = np.nan, weight.density
    model = spec.compile()
    R = np.empty(9)
    mujoco.mju_quat2Mat(R, model.body_iquat[1])
    R = R.reshape(3, 3)
    return float(model.body_mass[1]), model.body_ipos[1], R @ np.diag(model.body_inertia[1]) @ R.T


@pytest.mark.parametrize("weight", WEIGHTS, ids=["bar", "wide bar", "cylinder", "plate"])
def test_a_weight_s_mass_centre_and_inertia_on_a_tilted_flange_are_those_of_its_shapes_in_mujoco(weight):
    mass, com, inertia = as_mujoco_has_it(weight, tilted())
    payload = payload_of(weight, tilted())
    np.testing.assert_allclose(payload.mass, mass, rtol=1e-12)
    np.testing.assert_allclose(payload.com, com, rtol=0, atol=1e-12)
    ixx, iyy, izz, ixy, ixz, iyz = payload.inertia
    # MuJoCo finds principal axes by iterations to 1e-8 or so.
    np.testing.assert_allclose([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]], inertia, rtol=0, atol=1e-8)


def test_each_shape_s_dimensions_are_what_their_names_say():
    cylinder = CYLINDER.properties
    np.testing.assert_allclose(cylinder.mass, 7850.0 * np.pi / 4 * 0.171**2 * 0.029, rtol=1e-12)
    np.testing.assert_allclose(cylinder.com, [0.053, 0.0, 0.0145], rtol=0, atol=1e-15)
    plate = PLATE.properties
    np.testing.assert_allclose(plate.mass, 8900.0 * 0.310 * 0.087 * 0.023, rtol=1e-12)
    np.testing.assert_allclose(plate.com, [0.077, 0.0, 0.0115], rtol=0, atol=1e-15)
    bracket, bar = BAR.parts
    assert bar.size == (47.0, 47.0, 133.0)
    assert bar.center == (91.0, 0.0, 15.0 + 66.5)
    # The bracket covers the flange's face, 63 mm, and ends with the bar.
    assert bracket.size == (31.5 + 91.0 + 23.5, 63.0, 15.0)
    assert bracket.center == (0.5 * (91.0 + 23.5 - 31.5), 0.0, 7.5)
    assert WIDE.parts[0].size[1] == 83.0
    # A bar near the flange's middle: the bracket covers the face on its side too.
    near, _ = SHAPES["bar"].parts((20.0, 133.0, 5.0))
    assert (near.size, near.center) == ((63.0, 63.0, 15.0), (0.0, 0.0, 7.5))


def test_a_plate_or_cylinder_covers_the_flange_s_face_or_misses_it_by_so_many_millimetres():
    assert SHAPES["cylinder"].missing((171.0, 29.0, 54.0)) == 0.0
    assert SHAPES["cylinder"].missing((171.0, 29.0, 60.0)) == 6.0
    assert SHAPES["plate"].missing((310.0, 87.0, 23.0, 130.0)) == 6.5
    assert SHAPES["bar"].missing((47.0, 133.0, 250.0)) <= 0.0


@pytest.mark.parametrize(("quarter", "x", "y"), [(0, 1, 0), (1, 0, 1), (2, -1, 0), (3, 0, -1)])
def test_a_quarter_turn_turns_from_the_flange_s_x_toward_its_y(quarter, x, y):
    np.testing.assert_array_equal(replace(BAR, quarter=quarter).turned[:, 0], [x, y, 0])
    np.testing.assert_array_equal(replace(BAR, quarter=quarter).turned[:, 1], [-y, x, 0])


@pytest.mark.parametrize(
    ("size", "tolerance"), [(6.0, 0.1), (6.1, 0.2), (30.0, 0.2), (31.0, 0.3), (120.0, 0.3), (121.0, 0.5), (401.0, 0.8)]
)
def test_dimensions_have_the_tolerances_of_iso_2768_medium(size, tolerance):
    np.testing.assert_allclose(dimension_std(size), tolerance / np.sqrt(3.0), rtol=1e-12)


def test_what_a_cylinder_s_tolerances_leave_of_its_centre_and_inertia_follows_from_its_formulas():
    upright = Flange(origin=np.array([0.0, 0.0, 0.085]), rotation=np.eye(3), name="flange")
    payload = payload_of(replace(CYLINDER, quarter=0), upright)
    diameter, length, offset = 0.171, 0.029, 0.053
    d_std, l_std, e_std = 5e-4 / np.sqrt(3.0), 2e-4 / np.sqrt(3.0), 3e-4 / np.sqrt(3.0)
    seat, turn = 1e-3 * SEAT_MM, np.sin(TURN) * offset
    # Changes of some permille are taken as they are, not as derivatives.
    np.testing.assert_allclose(payload.com_std, [np.hypot(e_std, seat), np.hypot(seat, turn), l_std / 2.0], rtol=1e-4)
    m = payload.mass
    izz_std = m * diameter * d_std / 4.0
    ixx_std = m * np.hypot(diameter * d_std / 8.0, length * l_std / 6.0)
    np.testing.assert_allclose(payload.inertia_std[:3], [ixx_std, ixx_std, izz_std], rtol=3e-3)
    np.testing.assert_allclose(payload.inertia_std[3:], 0.0, rtol=0, atol=1e-15)
    assert payload.mass_std == MASS_STD
