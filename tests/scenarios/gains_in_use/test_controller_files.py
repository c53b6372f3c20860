import json
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from bad_files import refused
from model_files import mjcf, urdf, urdf_joint, written
from printed import printed
from scipy.spatial.transform import Rotation
from weighed_cell import MODEL, off

import scenarios
from ident.model.arm import fixed_frame, load_arm
from ident.payload.payload import Payload
from ident.recordings.files import write_recording
from ident.support.errors import RobotModelError
from scenarios.cli import main
from scenarios.gains_in_use.controller_files import franka, in_frame, ros_parameters, urscript
from scenarios.results.gains_file import GainEntry, GainsFile

pytestmark = pytest.mark.usefixtures("_computed_once", "_all_undiagnosed")
MASSES = np.array([0.7, 0.4, 1.1, 0.9, 0.3])
PLACES = np.random.default_rng(5).uniform(-0.09, 0.14, (5, 3))
TURNED = Rotation.from_euler("xyz", (0.31, -0.72, 1.23))
ORIGIN = np.array([0.021, -0.034, 0.107])


def of_points(places: np.ndarray) -> Payload:
    """The body of point masses at places in some frame."""
    com = MASSES @ places / MASSES.sum()
    x, y, z = (places - com).T
    moments = [MASSES @ (a * a + b * b) for a, b in ((y, z), (x, z), (x, y))]
    products = [-MASSES @ (a * b) for a, b in ((x, y), (x, z), (y, z))]
    return Payload(mass=float(MASSES.sum()), com=tuple(com.tolist()), inertia=tuple(map(float, (*moments, *products))))


def numbers(text: str) -> list[float]:
    return [float(word) for word in re.findall(r"-?\d+\.\d+", text.splitlines()[-1])]


LOAD, MOVED = of_points(PLACES), of_points(TURNED.inv().apply(PLACES - ORIGIN))


def test_a_load_in_another_frame_is_that_of_the_same_points_there():
    found = in_frame(LOAD, TURNED.as_matrix(), ORIGIN)
    np.testing.assert_allclose(found.com, MOVED.com, rtol=0, atol=1e-15)  # rounding
    np.testing.assert_allclose(found.inertia, MOVED.inertia, rtol=0, atol=1e-15)


def test_urscript_has_moments_before_products_and_no_exponent():
    load = Payload(mass=2.5, com=(0.01, -0.02, 3e-6), inertia=(0.011, 0.012, 0.013, 0.0014, -0.00015, 1.6e-6))
    expected = "[0.010000000, -0.020000000, 0.000003000]"
    inertia = "[0.011000000, 0.012000000, 0.013000000, 0.001400000, -0.000150000, 0.000001600]"
    line = f"set_target_payload(2.500000000, {expected}, {inertia})\n"
    assert urscript(load, "tool0") == f"# load in the frame of tool0 [kg, m, kg m^2]\n{line}"
    light = Payload(mass=2.5, com=(0.01, -0.02, 3e-6), known="com")
    assert urscript(light, "tool0").endswith(f"set_target_payload(2.500000000, {expected})\n")


def test_franka_has_the_columns_of_the_matrix_about_the_centre():
    told = json.loads(franka(LOAD, "link8") or "")
    x, y, z = (PLACES - LOAD.com).T
    both = [[MASSES @ (a * b) for a in (x, y, z)] for b in (x, y, z)]
    np.testing.assert_allclose(np.reshape(told["load_inertia"], (3, 3)), np.trace(both) * np.eye(3) - both, atol=1e-15)
    assert (told["load_mass"], told["F_x_Cload"]) == (LOAD.mass, list(LOAD.com or ()))
    assert franka(Payload(mass=2.5, com=(0.01, -0.02, 0.03), known="com"), "link8") is None


def test_a_frame_on_the_last_link_is_where_the_file_puts_it(tmp_path):
    place = '<origin xyz="0.021 -0.034 0.107" rpy="0.31 -0.72 1.23"/>'
    tool = f'<link name="plate"/><link name="tool0"/>{urdf_joint("a", "fixed", ("wrist_3_link", "plate"), place)}'
    tool += urdf_joint("b", "fixed", ("plate", "tool0"), '<origin xyz="0 0 0.2"/>')
    path = written(tmp_path, "arm.urdf", urdf(more=tool))
    R, origin = fixed_frame(path, load_arm(path), "tool0")
    turned = Rotation.from_euler("xyz", (0.31, -0.72, 1.23))  # fixed axes, as in a URDF
    np.testing.assert_allclose(R, turned.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(origin, ORIGIN + turned.apply((0.0, 0.0, 0.2)), atol=1e-12)
    R, origin = fixed_frame(path, load_arm(path), "wrist_3_link")
    np.testing.assert_array_equal((*R.ravel(), *origin), (*np.eye(3).ravel(), 0.0, 0.0, 0.0))
    with pytest.raises(RobotModelError, match="'wrist_2_link' is not fixed to the last link of the arm"):
        fixed_frame(path, load_arm(path), "wrist_2_link")
    body = (
        '<body name="tool" pos="0.021 -0.034 0.107" quat="1 0 0 1"/></body></body></body></body></body></body></body>'
    )
    other = written(tmp_path, "arm.xml", mjcf(swap=("</body>" * 7, body)))
    R, origin = fixed_frame(other, load_arm(other), "tool")
    np.testing.assert_allclose(R, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-12)
    np.testing.assert_allclose(origin, ORIGIN, atol=1e-12)


def test_effort_limits_are_parameters_by_joint():
    gains = GainsFile(gains=tuple(GainEntry(joint=j, estimate=2.5, std=0.01) for j in (1, 2)))
    told = yaml.safe_load(ros_parameters(gains, ("lift", "tilt"), {"tilt": 41.25}))["/**"]["ros__parameters"]
    assert told["joint_limits"] == {"tilt": {"has_effort_limits": True, "max_effort": 41.25}}
    assert "joint_limits" not in ros_parameters(gains, ("lift", "tilt"), {})


@pytest.fixture(scope="module")
def tool_cell(weighed_cell, tmp_path_factory) -> Path:
    """The weighed cell's model with a tool frame, and its motions with other noise."""
    folder = tmp_path_factory.mktemp("tool")
    site = '<site name="flange"'
    frame = f'<body name="tool" pos="0.021 -0.034 0.107" euler="0 0 90"/>\n{site}'
    (folder / "arm.xml").write_text(Path(MODEL).read_text().replace(site, frame))
    logs = scenarios.load(weighed_cell / "quick.toml").simulate(seed=5).logs
    for name, log in zip(("bare", "again", "heavy"), logs, strict=True):
        write_recording(log.recording, folder / f"{name}.parquet")
    return folder


def words(cell: Path, tool: Path, *more: str, gains: str = "gains.toml") -> list[str]:
    log, bare = (str(cell / "run" / f"{name}.parquet") for name in ("light", "unloaded"))
    files = ["--gains", str(cell / gains), "--model", str(tool / "arm.xml"), "--unloaded", bare]
    return ["payload-of", log, *files, *more]


def test_a_payload_is_written_as_found_in_the_frame_of_the_tool(weighed_cell, tool_cell, tmp_path, capsys, monkeypatch):
    path = tmp_path / "load.script"
    out = ("--out", str(path), "--frame", "tool")
    found = printed(capsys, "payload-of", words(weighed_cell, tool_cell, *out))
    body = {each["quantity"]: each["estimate"] for each in found["body"]}
    # The tool's x is the link's y, its y the negative x.
    expected = (body["mass"], body["y"] + 0.034, 0.021 - body["x"], body["z"] - 0.107)
    np.testing.assert_allclose(numbers(path.read_text()), expected, atol=1e-9)  # nine decimals
    said = (
        rf"{path}: in the frame of tool, without inertia: 0\.04.* kg m\^2 has a standard deviation of .* more than 10 %"
    )
    assert re.fullmatch(said, found["load"])
    assert found["written"] == str(path)
    monkeypatch.setattr("ident.parameters.weighing.as_load", lambda *_, **__: (LOAD, None))
    path = tmp_path / "load.json"
    assert main(words(weighed_cell, tool_cell, "--out", str(path), "--frame", "tool")) == 0
    assert f"{path}: in the frame of tool." in " ".join(capsys.readouterr().out.split())
    told = json.loads(path.read_text())
    x, y, z = LOAD.com or ()
    np.testing.assert_allclose(told["F_x_Cload"], (y + 0.034, 0.021 - x, z - 0.107), atol=1e-15)
    ixx, iyy, izz, ixy, ixz, iyz = LOAD.inertia or ()
    expected = (iyy, -ixy, iyz, -ixy, ixx, -ixz, iyz, -ixz, izz)
    np.testing.assert_allclose(told["load_inertia"], expected, atol=1e-15)


def test_what_is_uncertain_is_not_written_with_the_reason(weighed_cell, tool_cell, tmp_path, capsys):
    for name, most, reason in (
        ("b.json", "0.1", r"inertia: .* more than 10 %"),
        ("c.script", "0.02", r"com: 0\.121 m has a standard deviation of 0\.003. m, more than 2 %"),
        ("d.script", "1e-4", r"mass: 4\.2. kg has a standard deviation of 0\.038 kg, more than 0\.01 %"),
    ):
        path = tmp_path / name
        out = ("--out", str(path), "--frame", "tool", "--max-rel-std", most)
        found = printed(capsys, "payload-of", words(weighed_cell, tool_cell, *out, "--force"), status=1)
        assert (found["written"], path.exists()) == (None, False)
        assert re.match(f"{path} NOT WRITTEN: {reason}", found["load"])


def test_a_payload_that_fails_on_an_unseen_motion_or_of_which_joints_disagree_is_not_written(
    weighed_cell, tool_cell, tmp_path, capsys
):
    off(weighed_cell, 3, 1.4, "far.json")
    path = tmp_path / "load.script"
    out = ("--out", str(path), "--frame", "tool")
    unseen = {name: ("--unseen", str(tool_cell / f"{name}.parquet")) for name in ("again", "heavy")}
    far = words(weighed_cell, tool_cell, *out, gains="far.json")
    for failing in (far, words(weighed_cell, tool_cell, *out, *unseen["heavy"])):
        found = printed(capsys, "payload-of", failing, status=1)
        assert (found["written"], path.exists()) == (None, False)
        assert "NOT WRITTEN: it does not predict the motion, or the joints disagree" in found["load"]
    assert found["unseen"]["loaded"]
    assert printed(capsys, "payload-of", [*far, "--force"], status=1)["written"] == str(path)
    assert path.exists()
    found = printed(capsys, "payload-of", words(weighed_cell, tool_cell, *out, *unseen["again"]))
    assert found["unseen"]["rel_error"] < 0.15


@pytest.mark.parametrize(
    ("more", "match"),
    [
        (["--out", "a.script"], "--out FILE and --frame BODY: give both, or none"),
        (["--out", "a.script", "--frame", "tol"], "no body has that name; did you mean 'tool'"),
        (["--out", "a.urp", "--frame", "tool"], r"ends with \.json or \.script"),
        (["--unseen", "light"], "light.* contain the same motion"),
        (["--unseen", "heavy"], "heavy.*: the gains were identified from this recording"),
    ],
)
def test_a_load_that_cannot_be_asked_for_is_one_line(
    weighed_cell, tool_cell, more, match, capsys, monkeypatch, tmp_path
):
    monkeypatch.chdir(tmp_path)
    logs = {name: str(weighed_cell / "run" / f"{name}.parquet") for name in ("light", "heavy")}
    more = [logs.get(word, word) for word in more]
    assert re.search(match, refused(capsys, words(weighed_cell, tool_cell, *more)))
