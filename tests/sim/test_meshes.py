"""Meshes that are missing, elsewhere or no solids, and links beside the arm: no reason to refuse an arm."""

import numpy as np
import pytest
from collections_of_arms import HAND, menagerie, ros, written

from sim.compile import bare_arm
from sim.errors import ModelFileError
from sim.model_spec import full_spec, lean_spec, unusable_meshes

ROTORS = np.array([0.3, 0.2, 0.1])
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
FLAT = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n"
ANTENNA = (
    '<link name="antenna"><inertial><mass value="MASS"/><inertia ixx="2.4e-8" ixy="6.1e-8" ixz="1.2e-8" iyy="2.8e-8" '
    'iyz="8e-9" izz="3.8e-8"/></inertial></link><joint name="antenna_fixed" type="fixed"><parent link="PARENT"/>'
    '<child link="antenna"/></joint>'
)
"""Products of inertia beyond the moments, as in the file of a mobile manipulator."""


def with_meshes(folder, meshes, **changes):
    for name, text in meshes.items():
        written(folder / "assets", name, text)
    return written(folder, "arm.xml", menagerie(**changes))


@pytest.mark.parametrize("text", [FLAT, "", "v 0 0\n", "no mesh"])
def test_a_mesh_that_is_no_solid_is_left_out_where_inertials_are_stated(tmp_path, text):
    path = with_meshes(tmp_path, {"shoulder.obj": TETRAHEDRON, "elbow.obj": text or "#", "wrist.obj": TETRAHEDRON})
    assert [mesh.file for mesh in full_spec(path).meshes] == ["shoulder.obj", "wrist.obj"]
    assert full_spec(path).compile().nmesh == 2
    assert unusable_meshes(path) == ("elbow.obj",)
    np.testing.assert_allclose(bare_arm(path, ROTORS).body_mass.sum(), 12.0, rtol=1e-12)  # rounding of a sum


def test_an_inertia_from_a_mesh_that_is_no_solid_is_asked_for(tmp_path):
    path = with_meshes(tmp_path, {f"{k}.obj": FLAT for k in ("shoulder", "elbow", "wrist")}, inertial="")
    with pytest.raises(
        ModelFileError, match=r"'shoulder_link' has its inertia from the mesh 'shoulder\.obj', from which MuJoCo"
    ):
        bare_arm(path, ROTORS)


@pytest.mark.parametrize("massless", ['mass="0"', 'density="0"'])
def test_a_lost_mesh_without_mass_takes_no_inertia_from_its_link(tmp_path, massless):
    text = menagerie(inertial="").replace('<geom class="visual"', f'<geom class="visual" {massless}')
    model = bare_arm(written(tmp_path, "arm.xml", text), ROTORS)
    capsule = 1000.0 * (np.pi * 0.05**2 * 0.15 + 4.0 / 3.0 * np.pi * 0.05**3)
    np.testing.assert_allclose(model.body_mass[-4:-1], capsule, rtol=1e-9)  # MuJoCo's density of water


def test_a_lost_mesh_behind_the_flange_is_left_out(tmp_path):
    hand = HAND.replace("</body></body>", '<body name="lamp"><geom type="mesh" mesh="elbow"/></body></body></body>')
    path = written(tmp_path, "arm.xml", menagerie(hand=hand))
    np.testing.assert_allclose(bare_arm(path, ROTORS, "wrist_link").body_mass.sum(), 12.74, rtol=1e-12)


@pytest.mark.parametrize("place", ["named", "declared", "beside"])
def test_a_mesh_in_a_package_is_found_around_the_file(tmp_path, place):
    folder = tmp_path / "src" / ("robot_description" if place == "named" else "robot")
    if place == "declared":
        written(folder, "package.xml", "<package><name>robot_description</name></package>")
    path = written(tmp_path / "src" / "bringup" / "urdf" if place == "beside" else folder / "urdf", "arm.urdf", ros())
    meshes = (tmp_path / "src" / "robot_description" if place == "beside" else folder) / "meshes"
    stl = b"\0" * 80 + (4).to_bytes(4, "little")
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype="<f4")
    for corners in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)):
        stl += np.zeros(3, dtype="<f4").tobytes() + points[list(corners)].tobytes() + b"\0\0"
    meshes.mkdir(parents=True)
    (meshes / "elbow.stl").write_bytes(stl)
    assert [mesh.file for mesh in full_spec(path).meshes] == [str(meshes / "elbow.stl")]
    assert full_spec(path).compile().nmesh == 1
    assert unusable_meshes(path) == tuple(f"package://robot_description/meshes/{k}.stl" for k in ("shoulder", "wrist"))


@pytest.mark.parametrize("parent", ["base_link", "elbow_link", "tool0"])
@pytest.mark.parametrize("mass", ["0.5", "-0.5"])
def test_a_link_beside_the_arm_that_no_body_is_does_not_matter(tmp_path, parent, mass):
    more = ANTENNA.replace("PARENT", parent).replace("MASS", mass)
    model = bare_arm(written(tmp_path, "arm.urdf", ros(more=more)), ROTORS, "tool0")
    np.testing.assert_allclose(model.body_mass.sum(), 12.0 + max(float(mass), 0.0), rtol=1e-12)  # rounding of a sum
    with pytest.raises(ModelFileError, match="antenna"):
        bare_arm(written(tmp_path, "arm.urdf", ros(more=more)), ROTORS, "antenna" if parent == "tool0" else None)


def test_moments_beside_the_arm_of_which_one_exceeds_the_others_do_not_matter(tmp_path):
    more = ANTENNA.replace("PARENT", "elbow_link").replace("MASS", "0.5")
    for old, new in (
        ("2.4e-8", "1e-5"),
        ("6.1e-8", "0"),
        ("1.2e-8", "0"),
        ("2.8e-8", "1e-5"),
        ("8e-9", "0"),
        ("3.8e-8", "4e-5"),
    ):
        more = more.replace(old, new)
    model = bare_arm(written(tmp_path, "arm.urdf", ros(more=more)), ROTORS, "tool0")
    np.testing.assert_allclose(model.body("antenna").inertia, 2e-5, rtol=1e-12)  # their mean


def test_what_is_kept_for_the_next_call_is_not_what_a_caller_changes(tmp_path):
    path = with_meshes(tmp_path, {})
    first = full_spec(path)
    first.delete(first.bodies[-1])
    assert full_spec(path).bodies[-1].name == lean_spec(path).bodies[-1].name == "wrist_link"
