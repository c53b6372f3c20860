import json
import re
import tomllib
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest
from bad_files import refused
from model_files import GRIPPER, HOME, menagerie, no_limits, random_arm_urdf, ros, weak, with_jaw, written
from printed import printed

import scenarios.design.robot_folder as folder_module
import scenarios.design.search as search_module
from ident.model.arm import Arm, load_arm
from ident.payload.payload import Payload, payload_from_table, read_payload
from ident.support.errors import PayloadError
from scenarios.cli import main
from scenarios.command_line.process import Status
from scenarios.commands.design import Outcome
from scenarios.design.excitation import Design
from scenarios.design.model_facts import ModelFacts, model_facts
from scenarios.design.new_robot import bar, drives_by_default, first_payload, home_pose
from scenarios.experiments.scenario import body_of
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
    command = ["new-robot", str(path), "--out", str(folder), "--evaluations", "60", "--jobs", "1", *words, "--json"]
    status = main(command)
    output = capsys.readouterr()
    assert status == Status.PASSED, output.err
    return json.loads(output.out)


def load_of(path, flange=None, torque=None, **given) -> tuple[Payload, str, str]:
    arm = load_arm(path, flange=flange)
    drives = drives_by_default(arm, path, flange, model_facts(path, flange), torque)
    return first_payload(arm, path, flange, drives, **given)


def torques(path, arm: Arm, payloads, q, dq, ddq):
    bodies = [each and body_of(each) for each in payloads]
    return [np.abs(inverse_dynamics(bare_arm(path, np.zeros(arm.n), None, each), q, dq, ddq)) for each in bodies]


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
    monkeypatch.setattr(folder_module, "quickened", lambda _, motion: motion)
    monkeypatch.setattr(Design, "deviations", lambda design, _: np.full(design.plant.robot.n, 0.013))
    monkeypatch.setattr("scenarios.commands.design.searched", lambda *_: Outcome())


@pytest.mark.usefixtures("still")
def test_stated_values_are_published_and_others_assumed_with_their_source(servo_arm, tmp_path, capsys):
    limits = made(servo_arm, tmp_path / "mine", capsys)["limits"]
    assert [(each["torque"], each["torque_assumed"], each["speed_assumed"]) for each in limits] == [
        (80.0, False, True)
    ] * 3
    table = tomllib.loads((tmp_path / "mine/robot.toml").read_text())
    drives = table["drives"]
    assert drives["current_limit"]["value"] == [80.0] * 3  # forcerange of the servos
    assert (drives["current_limit"]["origin"], drives["max_velocity"]["origin"]) == ("published", "assumed")
    expected = {
        "gain": 1.0,
        "max_velocity": 2.0,  # a file of MuJoCo states no speed
        "max_acceleration": 4.0 * 2.0,
        "rotor_inertia": 0.0065 * 80.0,
        "viscous_friction": 10.0 * 0.0065 * 80.0,
        "coulomb_friction": 1.0 * 10.0 * 0.0065 * 80.0,
        "coulomb_asymmetry": 0.03 * 10.0 * 0.0065 * 80.0,
        "amplifier_offset": 0.02 * 10.0 * 0.0065 * 80.0,
    }
    for name, value in expected.items():
        np.testing.assert_allclose(drives[name]["value"], value, rtol=1e-9)
    assert table["home"]["value"] == [0.0, 0.4, -0.7]
    assert "keyframe 'home'" in table["home"]["source"]
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
    found = made(path, tmp_path / "mine", capsys, "--flange", "tool0", "--name", "lift arm")
    robot = read_robot(tmp_path / "mine/robot.toml")
    assert (robot.name, robot.flange) == ("lift arm", "tool0")
    np.testing.assert_allclose(robot.drives.current_limit, [120.0, 90.0, 60.0], rtol=1e-12)
    np.testing.assert_allclose(robot.max_velocity, [2.5, 2.5, 0.5], rtol=1e-12)
    text = (tmp_path / "mine/robot.toml").read_text()
    assert "# Joints: 1 shoulder, 2 elbow, 3 wrist" in text
    assert "N m (N)" in text
    assert found["joints"] == ["shoulder", "elbow", "wrist"]
    arm = load_arm(written(tmp_path, "plain.urdf", re.sub(r' (effort|velocity)="[^"]*"', r' \1="0"', ros())))
    drives = drives_by_default(arm, tmp_path / "plain.urdf", None, model_facts(tmp_path / "plain.urdf", None))
    np.testing.assert_array_equal(drives["max_velocity"].value, [2.0, 2.0, 0.4])
    rng, n = np.random.default_rng(3), (4000, 3)  # other states than those of the default
    low, high = np.where(np.isfinite(arm.lower), arm.lower, -np.pi), np.where(np.isfinite(arm.upper), arm.upper, np.pi)
    speed = np.array([2.0, 2.0, 0.4]) / 3.0
    load, arm_file = bar(arm, 0.1 * 12.0), tmp_path / "plain.urdf"  # of 12 kg
    states = (rng.uniform(low, high, n), rng.uniform(-speed, speed, n), 4.0 * rng.uniform(-speed, speed, n))
    (need,) = torques(arm_file, arm, [load], *states)
    share = 2.0 * need.max(axis=0) / drives["current_limit"].value
    assert ((share > 0.98) & (share < 1.25)).all()  # 200 states see somewhat less than 4000


@pytest.mark.parametrize("weakest", [62.0, 20.0])  # [N m]: the payload's own share of it limits, or the arm's
def test_a_payload_adds_as_much_torque_as_the_weakest_joint_has_left_and_no_more(servo_arm, weakest):
    arm, limit, speed = load_arm(servo_arm), np.array([80.0, weakest, 71.0]), np.array([2.0, 1.6, 2.3])
    drives = {"current_limit": SimpleNamespace(value=limit), "max_velocity": SimpleNamespace(value=speed)}
    load, *_ = first_payload(arm, servo_arm, None, drives, rated=10.0)
    rng, n = np.random.default_rng(5), (4000, arm.n)  # other states than those of the rule, and more of them
    q = rng.uniform(np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi), n)
    dq, ddq = (rng.uniform(-most / 3.0, most / 3.0, n) for most in (speed, 4.0 * speed))
    model = [bare_arm(servo_arm, np.zeros(arm.n), None, each) for each in (None, body_of(load))]
    bare, loaded = (inverse_dynamics(each, q, dq, ddq) for each in model)
    room = np.minimum(0.3 * limit, 0.75 * limit - np.quantile(np.abs(bare), 0.9, axis=0))
    used = np.abs(loaded - bare).max(axis=0) / room
    assert 0.9 < used.max() < 1.15  # 200 states see some per cent less than the largest, and digits are cut
    assert load.mass < 10.0


def test_a_payload_keeps_to_the_rated_load_or_to_the_last_link_s_mass_and_a_heavier_one_is_warned_of(tmp_path):
    path = written(tmp_path, "arm.xml", with_jaw())
    unrated, source, warning = load_of(path, "palm")  # palm and claw weigh 0.105 kg, two digits are kept
    assert (unrated.mass, warning) == (0.1, "")
    assert "at most the last link's own mass, 0.1 kg" in source
    rated, source, _ = load_of(path, "palm", rated=0.062)
    assert rated.mass == 0.062
    assert "within the rated load of 0.062 kg" in source
    assert unrated.com == rated.com
    assert rated.com[2] > 0.0  # away from the joint before the last
    path = written(tmp_path, "arm.urdf", no_limits())  # links of 3.3 kg times 0.83 to the power 0 to 6, 14.1 kg
    usual, source, _ = load_of(path, torque=[900.0] * 7)
    assert usual.mass == pytest.approx(1.4, abs=0.05)
    assert "at most 1.4 kg: 10 % of the moving links' mass" in source
    heavy, _, warning = load_of(path, payload=1.9)
    assert heavy.mass == 1.9
    assert warning.startswith("1.9 kg is more than the last link's own 1.1 kg")
    assert load_of(path, payload=1.9, rated=1.8)[2] == "1.9 kg is above the rated load, 1.8 kg"
    assert load_of(path, payload=1.9, rated=2.0)[2] == ""
    for com in ("", "com = [0.01, 0.02, 0.03]\n"):
        partly = written(tmp_path, "p.toml", f'mass = 0.4\nknown = "mass"\n{com}')
        with pytest.raises(PayloadError, match=r"p\.toml: a simulation needs com and inertia"):
            load_of(path, payload=partly)


def test_an_arm_that_hardly_lifts_itself_carries_what_it_can_where_it_holds_itself_more_easily(tmp_path):
    strong, tired = (written(tmp_path, f"{k}.xml", weak(torque)) for k, torque in enumerate((60.0, 4.6)))
    assert load_of(strong, rated=2.0)[0].mass == 2.0
    load, source, _ = load_of(tired, rated=3.0)
    assert "the largest mass that the torque of joint m2 can hold" in source
    rng, arm = np.random.default_rng(9), load_arm(tired)  # at rest, other positions than those of the rule
    q, still = rng.uniform(arm.lower, arm.upper, (3000, arm.n)), np.zeros((3000, arm.n))
    bare, loaded = torques(tired, arm, (None, load), q, still, still)
    assert np.quantile(bare[:, 1], 0.9) > 0.75 * 4.6  # stretched out it is too heavy for itself
    assert 0.4 < (loaded < 0.8 * 4.6).all(axis=1).mean() < 0.9
    assert 0.05 < load.mass < 0.5


def test_a_joint_that_never_holds_the_arm_is_refused_with_the_option_that_helps(tmp_path, capsys):
    path = written(tmp_path, "arm.xml", weak(0.5))
    with pytest.raises(PlantError, match=r"joint m2: its largest torque is 0.5, .* --torque"):
        load_of(path)
    assert load_of(path, torque=[0.5, 40.0, 20.0, 5.0, 5.0, 5.0], rated=0.2)[0].mass == 0.2
    words = ["new-robot", str(path), "--out", str(tmp_path / "x"), "--torque", "1", "2"]
    assert main(words) == Status.BAD_INPUT
    assert "torque: 2 values, but the arm has 6 joints: m1, m2" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


def test_the_home_pose_is_the_first_clear_one_or_the_farthest(arm):
    facts = ModelFacts(torque={}, velocity={}, home={}, home_name="", from_shapes=(), missing_meshes=(), ignored=())
    clear, far = (
        home_pose(arm, facts, lambda q, most=most: most - 0.001 * np.linalg.norm(q - 1.1, axis=1)).value
        for most in (0.065, 0.012)  # 60 mm are clear
    )
    np.testing.assert_array_equal(clear, np.zeros(arm.n))
    middle = 0.5 * (arm.lower + arm.upper)
    assert np.linalg.norm(far - 1.1) < min(np.linalg.norm(each - 1.1) for each in (clear, middle))


@pytest.mark.usefixtures("still")
def test_a_given_home_is_taken_one_outside_the_ranges_is_refused_and_one_near_the_floor_is_reported(
    servo_arm, tmp_path, capsys
):
    made(servo_arm, tmp_path / "mine", capsys, "--home", "0.31", "-0.42", "0.53")
    home = tomllib.loads((tmp_path / "mine/robot.toml").read_text())["home"]
    assert home["value"] == [0.31, -0.42, 0.53]
    wrong = ((["0.3", "0.4"], "2 positions, but the arm has 3 joints"), (["0.3", "0.4", "9"], " at 9: expected "))
    for pose, said in wrong:
        assert said in refused(capsys, ["new-robot", str(servo_arm), "--out", str(tmp_path / "x"), "--home", *pose])
    words = ["new-robot", str(servo_arm), "--out", str(tmp_path / "mine"), "--force"]
    main(words)
    assert "Home" not in capsys.readouterr().out
    for near, said in ((0.0123, "Home comes within 12 mm of floor"), (-0.0344, "Home reaches 34 mm into floor")):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Clearance, "__call__", lambda _, q, near=near: np.full(len(q), near))
            main(words)
        assert said in " ".join(capsys.readouterr().out.split())


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.usefixtures("still")
def test_files_are_written_all_or_none_and_those_of_another_robot_or_changed_ones_are_kept(
    servo_arm, tmp_path, capsys, monkeypatch
):
    mine, fresh = tmp_path / "mine", tmp_path / "fresh"
    made(servo_arm, mine, capsys, "--name", "first")
    before = contents(mine)
    other = written(tmp_path, "other.urdf", ros(more=GRIPPER))
    words = ["new-robot", str(other), "--flange", "tool0", "--out", str(mine)]
    assert "robot.toml: is of another robot, 'first' from '../arm.xml'" in refused(capsys, words)

    def failing(error: Exception) -> Callable[..., None]:
        def fails(*_: object) -> None:
            raise error

        return fails

    again = ["new-robot", str(servo_arm), "--name", "late", "--out"]
    for name, error in (("best_fitted", TrajectoryError("no motion")), ("write_motion", OSError(28, "No space left"))):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(folder_module, name, failing(error))
            refused(capsys, [*again, str(mine)])
            if name == "best_fitted":
                refused(capsys, [*again, str(fresh)])
    assert (contents(mine), fresh.exists()) == (before, False)
    assert main([*words, "--force"]) == Status.PASSED
    assert tomllib.loads((mine / "robot.toml").read_text())["model"] == "../other.urdf"
    (mine / "robot.toml").write_text((mine / "robot.toml").read_text().replace("90", "75"))
    assert "robot.toml: changed since rx90 new-robot wrote it" in refused(capsys, words)


def test_given_payload_and_torques_are_written_and_run_and_the_gripper_is_locked(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(search_module, "FIRST", 30)
    path, bottle = written(tmp_path, "arm.xml", with_jaw()), written(tmp_path, "bottle.toml", BOTTLE)
    out, torque = tmp_path / "mine", ["3.5", "3.25", "3", "2.75", "2.5"]
    words = ["--payload", str(bottle), "--rated-load", "0.25", "--torque", *torque]
    found = made(path, out, capsys, *words)
    assert (found["held"], found["payload_mass"]) == (["jaw"], 0.31)
    assert found["payload_warning"] == "0.31 kg is above the rated load, 0.25 kg"
    robot = tomllib.loads((out / "robot.toml").read_text())
    assert (robot["flange"], robot["rated_load"]["value"]) == ("palm", 0.25)
    assert robot["drives"]["current_limit"]["value"] == [float(each) for each in torque]
    scenario = tomllib.loads((out / "scenario.toml").read_text())
    for part, std in (("plant", 0.0), ("belief", 0.004)):
        assert scenario[part]["payload"].get("mass_std", 0.0) == std
        assert payload_from_table({**scenario[part]["payload"], "mass_std": 0.004}) == read_payload(bottle)
    assert main(["run", str(out / "scenario.toml"), "--json"]) == Status.PASSED


@pytest.mark.slow
@pytest.mark.parametrize("text", [weak(), no_limits()])
def test_small_arms_get_a_motion_that_runs_and_identifies_every_gain(tmp_path, capsys, monkeypatch, text):
    monkeypatch.setattr(search_module, "FIRST", 30)
    path = written(tmp_path, "arm.urdf" if text.startswith("<robot") else "arm.xml", text)
    assert all(made(path, tmp_path / "mine", capsys)["identifiable"])
    assert main(["run", str(tmp_path / "mine/scenario.toml"), "--json"]) == Status.PASSED


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_gains_of_random_arms_are_as_accurate_as_predicted(tmp_path, capsys, seed):
    path = written(tmp_path, "arm.urdf", random_arm_urdf(seed))
    assert main(["new-robot", str(path), "--out", str(tmp_path / "mine"), "--json"]) == Status.PASSED
    predicted = json.loads(capsys.readouterr().out)["predicted_rel_std"]
    words = ["-n", "20", "--out", str(tmp_path / "study"), "--json"]
    main(["monte-carlo", str(tmp_path / "mine/scenario.toml"), *words])
    joints = printed(capsys, "monte-carlo")["joints"]
    assert min(predicted) < 0.005, "no joint is asked for the accuracy below"
    for std, found in zip(predicted, joints, strict=True):
        if std < 0.005:  # 20 seeds: p95 is some 2.1 deviations
            assert found["p95"] < 0.02
