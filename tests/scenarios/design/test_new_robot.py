import json
import re
import tomllib
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from bad_files import refused
from model_files import GRIPPER, HAND, HOME, menagerie, no_limits, ros, with_jaw, written

import scenarios.design.robot_folder as folder_module
import scenarios.design.search as search_module
from ident.model.arm import Arm
from ident.payload.payload import Payload, payload_from_table, read_payload
from ident.support.errors import PayloadError
from scenarios.cli import main
from scenarios.command_line.process import Status
from scenarios.design.excitation import Design
from scenarios.design.new_robot import bar, home_pose, new_robot
from scenarios.design.robot_folder import found_motion
from scenarios.experiments.schema import TURNS, body_of
from sim.controller import inverse_dynamics
from sim.errors import PlantError, TrajectoryError
from sim.plant import bare_arm
from sim.robot import read_robot
from sim.shapes import Clearance
from sim.trajectory import at_rest

BOTTLE = """mass = 0.31
mass_std = 0.004
com = [0.011, -0.023, 0.083]
inertia = { ixx = 3e-4, iyy = 3.3e-4, izz = 2e-4, ixz = 3e-5 }
"""


def made(path, folder, capsys, *words):
    """What `new-robot` prints of a model file, after a short search."""
    command = ["new-robot", str(path), "--out", str(folder), "--evaluations", "20", "--jobs", "1", *words, "--json"]
    status = main(command)
    output = capsys.readouterr()
    assert status == Status.PASSED, output.err
    return json.loads(output.out)


@pytest.fixture
def servo_arm(tmp_path):
    return written(tmp_path, "arm.xml", menagerie(tail=HOME))


@pytest.fixture
def still(monkeypatch):
    """A search that takes no time: the arm does not move."""

    def found(design, *_):
        n = design.plant.robot.n
        return at_rest(np.zeros(n), np.zeros((n, 2)), np.zeros((n, 2)), 5.0)

    monkeypatch.setattr(folder_module, "best_fitted", found)
    monkeypatch.setattr(Design, "deviations", lambda design, _: np.full(design.plant.robot.n, 0.013))
    monkeypatch.setattr("scenarios.commands.design.searched", lambda *_: ([], None))


@pytest.mark.usefixtures("still")
def test_stated_values_are_published_and_others_assumed_with_their_source(servo_arm, tmp_path, capsys):
    limits = made(servo_arm, tmp_path / "mine", capsys)["limits"]
    shown = [(each["torque"], each["torque_assumed"], each["speed_assumed"]) for each in limits]
    assert shown == [(80.0, False, True)] * 3
    table = tomllib.loads((tmp_path / "mine/robot.toml").read_text())
    drives = table["drives"]
    assert drives["current_limit"]["value"] == [80.0] * 3  # forcerange of the servos
    assert (drives["current_limit"]["origin"], drives["max_velocity"]["origin"]) == ("published", "assumed")
    inertia, friction = 0.0065 * 80.0, 10.0 * 0.0065 * 80.0
    expected = {"gain": 1.0, "max_velocity": 2.0, "max_acceleration": 4.0 * 2.0}  # a file of MuJoCo states no speed
    expected |= {"rotor_inertia": inertia, "viscous_friction": friction, "coulomb_friction": 1.0 * friction}
    expected |= {"coulomb_asymmetry": 0.03 * friction, "amplifier_offset": 0.02 * friction}
    for name, value in expected.items():
        np.testing.assert_allclose(drives[name]["value"], value, rtol=1e-9)
    assert table["home"]["value"] == [0.0, 0.4, -0.7]
    assert table["home"]["source"] == "a keyframe of the model file, 60 mm or more from floor and arm"
    for stated in (table["home"], *drives.values()):
        assert len(stated["source"].split()) >= 2
    assert (tmp_path / "mine" / table["model"]).resolve() == servo_arm.resolve()
    scenario = tomllib.loads((tmp_path / "mine/scenario.toml").read_text())
    assert scenario["tolerance"]["gain"] == [0.052] * 3  # four predicted deviations
    sources = scenario["sources"]
    for end, hertz in ((0.0, 30.0), (1.0, 20.0)):  # of a rotor on its transmission
        soft = sources["joint elasticity"]["parameters"]
        compliance = np.array(soft["loc"]) + end * np.array(soft["scale"])
        np.testing.assert_allclose(1.0 / np.sqrt(compliance * 0.0065 * 80.0) / (2.0 * np.pi), hertz, rtol=2e-3)
    assert sources["zeros of joints"]["parameters"]["scale"] == [0.00175] * 3


@pytest.mark.usefixtures("still")
def test_limits_of_a_urdf_are_its_efforts_and_speeds_and_a_slide_has_units_of_its_own(tmp_path, capsys):
    path = written(tmp_path, "arm.urdf", ros(more=GRIPPER))
    found = made(path, tmp_path / "mine", capsys, "--flange", "tool0")
    robot = read_robot(tmp_path / "mine/robot.toml")
    assert (robot.name, robot.flange) == ("ros_arm", "tool0")
    np.testing.assert_allclose(robot.drives.current_limit, [120.0, 90.0, 60.0], rtol=1e-12)
    np.testing.assert_allclose(robot.drives.max_velocity, [2.5, 2.5, 0.5], rtol=1e-12)
    text = (tmp_path / "mine/robot.toml").read_text()
    assert "# Joints: 1 shoulder, 2 elbow, 3 wrist" in text
    assert "N m (N)" in text
    assert found["joints"] == ["shoulder", "elbow", "wrist"]
    path = written(tmp_path, "plain.urdf", re.sub(r' (effort|velocity)="[^"]*"', r' \1="0"', ros()))
    new = new_robot(path)
    np.testing.assert_array_equal(new.drives["max_velocity"].value, [2.0, 2.0, 0.4])
    need = np.abs(random_torques(path, new.arm, bar(new.arm, 0.1 * 12.0))).max(axis=0)  # of 12 kg
    share = 2.0 * need / new.drives["current_limit"].value
    assert ((share > 0.98) & (share < 1.25)).all()  # 200 states see somewhat less than 4000


def random_torques(path, arm: Arm, load: Payload | None) -> np.ndarray:
    """Torques at other states than those of the defaults, and more of them."""
    rng, n = np.random.default_rng(3), (4000, arm.n)
    q = rng.uniform(np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi), n)
    speed = np.where(arm.revolute, 2.0, 0.4) / 3.0
    states = q, rng.uniform(-speed, speed, n), 4.0 * rng.uniform(-speed, speed, n)
    return inverse_dynamics(bare_arm(path, np.zeros(arm.n), None, load and body_of(load)), *states)


def test_a_payload_takes_30_per_cent_of_the_weakest_joint_and_at_most_the_rated_or_usual_mass(tmp_path, servo_arm):
    new = new_robot(servo_arm, torque=[80.0, 7.0, 71.0], rated_load=10.0)
    assert "30 % of joint elbow" in new.payload_source
    added = random_torques(servo_arm, new.arm, new.payload) - random_torques(servo_arm, new.arm, None)
    assert 0.97 < np.abs(added[:, 1]).max() / (0.3 * 7.0) < 1.1  # 200 states see less than the largest
    assert new.payload.com[2] > 0.0  # away from the joint before the last
    rated = new_robot(servo_arm, rated_load=0.062)
    assert (rated.payload.mass, rated.payload_warning) == (0.062, None)
    assert "the rated load of 0.062 kg" in rated.payload_source
    path = written(tmp_path, "arm.urdf", no_limits())  # links of 3.3 kg times 0.83 to the power 0 to 6, 14.1 kg
    usual = new_robot(path, torque=[900.0] * 7)
    assert usual.payload.mass == pytest.approx(0.1 * sum(3.3 * 0.83**k for k in range(7)), abs=1e-3)
    assert "10 % of the moving links' mass" in usual.payload_source
    assert "--rated-load" in usual.payload_warning
    with pytest.raises(PlantError, match=r"joint elbow: its largest torque carries no payload; .* --torque"):
        new_robot(servo_arm, torque=[80.0, 0.001, 71.0])


def test_a_payload_that_is_not_complete_and_torques_and_poses_that_do_not_fit_the_arm_are_refused(
    servo_arm, tmp_path, capsys
):
    for com in ("", "com = [0.01, 0.02, 0.03]\n"):
        partly = written(tmp_path, "p.toml", f'mass = 0.4\nknown = "mass"\n{com}')
        with pytest.raises(PayloadError, match=r"p\.toml: a simulation needs com and inertia"):
            new_robot(servo_arm, payload=partly)
    for words, said in (
        (["--torque", "1", "2"], "torque: 2 values, but the arm has 3 joints: shoulder, elbow"),
        (["--home", "0.3", "0.4"], "home: 2 values, but the arm has 3 joints"),
        (["--home", "0.3", "0.4", "9"], "joint wrist at 9: expected "),
    ):
        assert said in refused(capsys, ["new-robot", str(servo_arm), "--out", str(tmp_path / "x"), *words])
    assert not (tmp_path / "x").exists()


def test_the_home_pose_is_the_first_clear_one_or_the_farthest(arm):
    center, half = 0.5 * (arm.upper + arm.lower), 0.5 * (arm.upper - arm.lower)
    limits, facts = SimpleNamespace(center=center, half=half), SimpleNamespace(home={})

    def distance(q) -> np.ndarray:
        return 0.001 * np.linalg.norm(q - 1.1, axis=1)

    clear, far = (
        home_pose(arm, facts, SimpleNamespace(limits=limits, clearance=lambda q, most=most: most - distance(q))).value
        for most in (0.065, 0.012)  # 60 mm are clear
    )
    np.testing.assert_array_equal(clear, np.zeros(arm.n))
    assert np.linalg.norm(far - 1.1) < min(np.linalg.norm(each - 1.1) for each in (clear, center))


@pytest.mark.usefixtures("still")
def test_a_given_home_is_taken_and_one_near_the_floor_is_reported(servo_arm, tmp_path, capsys):
    made(servo_arm, tmp_path / "mine", capsys, "--home", "0.31", "-0.42", "0.53")
    assert tomllib.loads((tmp_path / "mine/robot.toml").read_text())["home"]["value"] == [0.31, -0.42, 0.53]
    words = ["new-robot", str(servo_arm), "--out", str(tmp_path / "mine"), "--force"]
    main(words)
    assert "Home" not in capsys.readouterr().out
    for near, said in ((0.0123, "Home comes within 12 mm of floor"), (-0.0344, "Home reaches 34 mm into floor")):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Clearance, "__call__", lambda _, q, near=near: np.full(len(q), near))
            main(words)
        assert said in " ".join(capsys.readouterr().out.split())


def test_of_several_attempts_the_motion_that_costs_least_is_taken(servo_arm, tmp_path, monkeypatch):
    new, motions = new_robot(servo_arm), [at_rest(np.full(3, c), *np.zeros((2, 3, 2)), 5.0) for c in (0.7, 0.2, 0.4)]
    monkeypatch.setattr(folder_module, "best_fitted", Mock(side_effect=motions))
    monkeypatch.setattr(Design, "deviations", lambda *_: np.array([0.013, 0.05, 0.02]))  # one gain is not identifiable
    monkeypatch.setattr(Design, "cost", lambda _, motion: motion.center[0])
    motion, result = found_motion(new, tmp_path, lambda *_: [], advice="")
    assert (motion is motions[1], result.identifiable) == (True, [True, False, True])


@pytest.mark.usefixtures("still")
def test_files_are_written_all_or_none_and_changed_ones_are_kept(servo_arm, tmp_path, capsys):
    def contents(folder):
        return {path.name: path.read_bytes() for path in folder.iterdir()}

    mine, fresh = tmp_path / "mine", tmp_path / "fresh"
    made(servo_arm, mine, capsys)
    before = contents(mine)
    other = written(tmp_path, "other.urdf", ros(more=GRIPPER))
    words = ["new-robot", str(other), "--flange", "tool0", "--out", str(mine)]
    again = ["new-robot", str(servo_arm), "--out"]
    for name, error, folder in (
        ("best_fitted", TrajectoryError("no motion"), mine),
        ("best_fitted", TrajectoryError("no motion"), fresh),
        ("write_motion", OSError(28, "No space left"), mine),
    ):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(folder_module, name, Mock(side_effect=error))
            refused(capsys, [*again, str(folder)])
    assert (contents(mine), fresh.exists()) == (before, False)
    assert main(words) == Status.PASSED
    assert tomllib.loads((mine / "robot.toml").read_text())["model"] == "../other.urdf"
    (mine / "robot.toml").write_text((mine / "robot.toml").read_text().replace("90", "75"))
    assert "robot.toml: changed since rx90 new-robot wrote it" in refused(capsys, words)


@pytest.mark.usefixtures("_undiagnosed")
def test_given_payload_and_torques_are_written_and_run_and_joints_beyond_the_flange_are_locked(
    tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(search_module, "FIRST", 30)
    path, bottle = written(tmp_path, "arm.xml", with_jaw()), written(tmp_path, "bottle.toml", BOTTLE)
    out, torque = tmp_path / "mine", ["3.5", "3.25", "3", "2.75", "2.5"]
    refused(capsys, ["new-robot", str(written(tmp_path, "two.xml", menagerie(hand=HAND))), "--out", str(out)])
    words = ["--payload", str(bottle), "--rated-load", "0.25", "--flange", "palm", "--torque", *torque]
    found = made(path, out, capsys, *words)
    assert found["payload_mass"] == 0.31
    assert any("Locked, as they are not joints of the chain to palm: jaw." in each for each in found["remarks"])
    assert found["payload_warning"] == "0.31 kg is above the rated load, 0.25 kg"
    robot = tomllib.loads((out / "robot.toml").read_text())
    assert (robot["flange"], robot["rated_load"]["value"]) == ("palm", 0.25)
    assert robot["drives"]["current_limit"]["value"] == [float(each) for each in torque]
    text = (out / "scenario.toml").read_text()
    scenario = tomllib.loads(text)
    assert tomllib.loads(text.replace("# protocol", "protocol"))["experiment"]["protocol"] == [*TURNS]
    for part, std in (("plant", 0.0), ("belief", 0.004)):
        assert scenario[part]["payload"].get("mass_std", 0.0) == std
        assert payload_from_table({**scenario[part]["payload"], "mass_std": 0.004}) == read_payload(bottle)
    assert main(["run", str(out / "scenario.toml"), "--json"]) == Status.PASSED


@pytest.mark.slow
def test_a_small_arm_gets_a_motion_that_runs_and_identifies_every_gain(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(search_module, "FIRST", 30)
    path = written(tmp_path, "arm.urdf", no_limits())
    assert all(made(path, tmp_path / "mine", capsys)["identifiable"])
    assert main(["run", str(tmp_path / "mine/scenario.toml"), "--json"]) == Status.PASSED
