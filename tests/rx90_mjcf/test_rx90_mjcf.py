import mujoco
import numpy as np
import pytest

import rx90_mjcf
from ident.model.structure import structure_of
from ident.payload.payload import read_payload
from sim.robot import read_robot

# Gautier & Briot 2011, table 1: alpha, d, r of frames 1 to 6 (modified Denavit-Hartenberg), controller's offsets.
ALPHA = np.deg2rad([0, -90, 0, 90, -90, 90])
D = [0, 0, 0.45, 0, 0, 0]
R = [0, 0, 0, 0.45, 0, 0]
OFFSET = np.deg2rad([0, -90, 90, 0, 0, 0])
SHOULDER = 0.42

# INRIA HuMAnS RX90 model with the entries that are documented in rx90.xml as assumed: mass, centre of mass, tensor.
S1 = {
    "link1": (35.0, (0.001, 0.002, -0.017), (0.3, 0.29, 0.2445389, 0, 0, 0)),
    "link2": (18.042, (0.3, 0, 0.178), (0.06, 0.297, 0.267, 0, -0.033, 0)),
    "link3": (16.37, (0, 0.007, 0.01), (0.05, 0.047, 0.042, 0, 0, 0.004)),
    "link4": (11.362, (0.001, 0, -0.125), (0.176, 0.175, 0.03, 0, 0.01, 0)),
    "link5": (0.578, (0, -0.02, 0), (0.00059, 0.00023, 0.00067, 0, 0, 0)),
    "link6": (0.302, (0, 0, 0.04), (0.00012, 0.00012, 0.00011, 0, 0, 0)),
}


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(rx90_mjcf.MJCF))


def mdh(alpha: float, d: float, theta: float, r: float) -> np.ndarray:
    """Transform from frame j - 1 to frame j: Rot_x(alpha) Trans_x(d) Rot_z(theta) Trans_z(r)."""
    ca, sa, ct, st = np.cos(alpha), np.sin(alpha), np.cos(theta), np.sin(theta)
    return np.array([[ct, -st, 0, d], [ca * st, ca * ct, -sa, -r * sa], [sa * st, sa * ct, ca, r * ca], [0, 0, 0, 1]])


def test_link_frames_are_those_of_table_1(model, rng):
    data = mujoco.MjData(model)
    for q in rng.uniform(-np.pi, np.pi, (20, 6)):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        frame = np.eye(4)
        frame[2, 3] = SHOULDER
        for j in range(6):
            frame = frame @ mdh(ALPHA[j], D[j], q[j] + OFFSET[j], R[j])
            body = data.body(f"link{j + 1}")
            # Rounding of six products.
            np.testing.assert_allclose(body.xmat.reshape(3, 3), frame[:3, :3], atol=1e-14)
            np.testing.assert_allclose(body.xpos, frame[:3, 3], atol=1e-14)


def test_inertias_of_links_are_set_s1():
    spec = mujoco.MjSpec.from_file(str(rx90_mjcf.MJCF))
    bodies = {link: spec.body(link) for link in S1}
    assert {link: (each.mass, tuple(each.ipos), tuple(each.fullinertia)) for link, each in bodies.items()} == S1


# Khalil's regrouping of table 1's arm, written out from the closed-form rules (Gautier & Khalil 1990);
# sin(alpha_4) = 1, sin(alpha_5) = -1, sin(alpha_6) = 1 give the signs of MZ in MY.
D3, R4 = 0.45, 0.45
BEYOND_2, BEYOND_3 = ("M3", "M4", "M5", "M6"), ("M4", "M5", "M6")
GROUPS = {
    "ZZ1": {"ZZ1": 1, "Ia1": 1, "YY2": 1, "YY3": 1, **dict.fromkeys(BEYOND_2, D3**2)},
    "XX2": {"XX2": 1, "YY2": -1, **dict.fromkeys(BEYOND_2, -(D3**2))},
    "XZ2": {"XZ2": 1, "MZ3": -D3},
    "ZZ2": {"ZZ2": 1, "Ia2": 1, **dict.fromkeys(BEYOND_2, D3**2)},
    "MX2": {"MX2": 1, **dict.fromkeys(BEYOND_2, D3)},
    "XX3": {"XX3": 1, "YY3": -1, "YY4": 1, "MZ4": 2 * R4, **dict.fromkeys(BEYOND_3, R4**2)},
    "ZZ3": {"ZZ3": 1, "YY4": 1, "MZ4": 2 * R4, **dict.fromkeys(BEYOND_3, R4**2)},
    "MY3": {"MY3": 1, "MZ4": -1, **dict.fromkeys(BEYOND_3, -R4)},
    "XX4": {"XX4": 1, "YY4": -1, "YY5": 1},
    "ZZ4": {"ZZ4": 1, "YY5": 1},
    "MY4": {"MY4": 1, "MZ5": 1},
    "XX5": {"XX5": 1, "YY5": -1, "YY6": 1},
    "ZZ5": {"ZZ5": 1, "YY6": 1},
    "MY5": {"MY5": 1, "MZ6": -1},
    "XX6": {"XX6": 1, "YY6": -1},
}
ALONE = [
    *("XY2", "YZ2", "MY2", "XY3", "XZ3", "YZ3", "MX3", "Ia3", "XY4", "XZ4", "YZ4", "MX4", "Ia4"),
    *("XY5", "XZ5", "YZ5", "MX5", "Ia5", "XY6", "XZ6", "YZ6", "ZZ6", "MX6", "MY6", "Ia6"),
]


def test_the_40_base_parameters_come_out_with_khalil_s_groupings(arm):
    groups = structure_of(arm).base.groups()
    inertial = {name: group for name, group in groups.items() if name[:-1] not in ("Fv", "Fc", "off")}
    expected = GROUPS | {name: {name: 1} for name in ALONE}
    assert len(expected) == 40
    assert inertial.keys() == expected.keys()
    for name, group in expected.items():
        assert inertial[name].keys() == group.keys()
        for member, factor in group.items():
            np.testing.assert_allclose(inertial[name][member], factor, atol=1e-12)
    assert len(groups) == 40 + 18


def test_nominal_payload_has_the_paper_s_first_moment():
    payload = read_payload(rx90_mjcf.PAYLOADS["7.025 kg"])
    np.testing.assert_allclose(payload.mass * payload.com[2], 1.003, atol=5e-4)  # digits printed in table 2


@pytest.mark.parametrize("name", ["7.025 kg", "4.275 kg"])
def test_payloads_are_cylinders_of_steel_flush_on_the_flange(name):
    payload = read_payload(rx90_mjcf.PAYLOADS[name])
    assert f"{payload.mass:g} kg" == name
    ixx, iyy, izz, *_ = payload.inertia
    radius = np.sqrt(2 * izz / payload.mass)
    length = np.sqrt(12 * ixx / payload.mass - 3 * radius**2)
    assert ixx == iyy
    np.testing.assert_allclose(payload.mass / (np.pi * radius**2 * length), 7850, rtol=1e-3)  # rounded moments
    np.testing.assert_allclose(payload.com[2] - length / 2, 0.085, atol=1e-4)


def test_the_published_numbers_are_those_of_their_sources():
    robot = read_robot(rx90_mjcf.ROBOT)
    assert robot.model == rx90_mjcf.MJCF
    np.testing.assert_array_equal(robot.drives.gain[:4], [0.9401, 0.9619, 1.1148, 0.9146])  # table 3, case 1
    degrees = np.rad2deg(robot.drives.max_velocity)
    np.testing.assert_allclose(
        degrees, [236, 200, 286, 401, 320, 580], rtol=0, atol=0.06
    )  # 10.122 for 580 deg/s, digits printed
    assert robot.gravity_spring is not None
    # SpringForce.c: 6257.75 N of prestress at 20295 N/m, on arms of 0.06 and 0.45 m.
    expected = {"joint": 1, "stiffness": 20295.0, "prestress": 6257.75, "radius": 0.06, "distance": 0.45}
    assert dict(robot.gravity_spring) == expected


def test_motor_6_turns_with_axis_5_and_d3_and_r4_lead_to_links_3_and_4(model):
    robot = read_robot(rx90_mjcf.ROBOT)
    ((motor, turns_with),) = [(c.motor, c.turns_with) for c in robot.coupling]
    assert (model.joint(motor).name, model.joint(turns_with).name) == ("joint6", "joint5")
    for frame, length in (("d3", 0.45), ("r4", 0.45)):
        np.testing.assert_allclose(np.linalg.norm(model.body(robot.frames[frame]).pos), length, rtol=1e-15)  # one root
