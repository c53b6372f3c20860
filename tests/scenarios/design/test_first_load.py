"""The weight of a first experiment: what is rated, what the last link weighs, what weak joints hold, what is given."""

import json
import re
import tomllib

import numpy as np
import pytest
from collections_of_arms import written
from small_arms import no_limits, scara, weak, with_jaw

import scenarios.design.search as searching
from ident.model.arm import load_arm
from ident.support.errors import PayloadError
from scenarios.cli import main
from scenarios.command_line.process import Status
from scenarios.design.first_load import first_load
from scenarios.design.model_facts import model_facts
from scenarios.design.rules_of_thumb import drives_by_rule
from sim.compile import bare_arm
from sim.controller import inverse_dynamics
from sim.errors import RobotError

BOTTLE = """mass = 0.31
mass_std = 0.004
com = [0.011, -0.023, 0.083]
inertia = { ixx = 3e-4, iyy = 3.3e-4, izz = 2e-4, ixz = 3e-5 }
"""


def load_of(path, flange=None, torque=None, **given):
    arm = load_arm(path, flange=flange)
    drives = drives_by_rule(arm, path, flange, model_facts(path, flange), torque)
    return first_load(arm, path, flange, drives, **given)


def test_a_payload_keeps_to_the_rated_load_and_else_to_the_last_link_s_own_mass(tmp_path):
    path = written(tmp_path, "arm.xml", with_jaw())
    unrated = load_of(path, "palm")  # palm and claw weigh 0.105 kg, two digits are kept
    assert unrated.body.mass == 0.1
    assert "no rated load is specified, so at most the last link's own mass, 0.1 kg" in unrated.source
    assert unrated.warning == ""
    rated = load_of(path, "palm", rated=0.062)
    assert rated.body.mass == 0.062
    assert "within the rated load of 0.062 kg" in rated.source
    np.testing.assert_allclose(unrated.body.com, rated.body.com)


def test_a_payload_heavier_than_the_last_link_of_an_unrated_arm_or_than_what_is_rated_is_warned_of(tmp_path):
    path = written(tmp_path, "arm.urdf", no_limits())  # links of 3.3 kg times 0.83 to the power 0 to 6, 14.1 kg
    light_hand = load_of(path)
    assert light_hand.body.mass > 3.3 * 0.83**6 or light_hand.warning == ""
    heavy = load_of(path, payload=1.9)
    assert heavy.body.mass == 1.9
    assert heavy.warning.startswith("1.9 kg is more than the last link's own 1.1 kg, and no rated load is specified")
    assert load_of(path, payload=1.9, rated=1.8).warning == "1.9 kg is above the rated load, 1.8 kg"
    assert load_of(path, payload=1.9, rated=2.0).warning == ""


def test_an_arm_that_hardly_lifts_itself_carries_what_leaves_it_room_where_it_holds_itself_more_easily(tmp_path):
    strong, tired = (written(tmp_path, f"{k}.xml", weak(torque)) for k, torque in enumerate((60.0, 4.6)))
    assert load_of(strong, rated=2.0).body.mass == 2.0
    load = load_of(tired, rated=3.0)
    assert "the largest mass that the torque of joint m2 can hold" in load.source
    rng, arm = np.random.default_rng(9), load_arm(tired)  # at rest, other positions than those of the rule
    q, still = rng.uniform(arm.lower, arm.upper, (3000, arm.n)), np.zeros((3000, arm.n))
    held = [
        np.abs(inverse_dynamics(bare_arm(tired, np.zeros(6), None, each), q, still, still))
        for each in (None, load.body)
    ]
    assert np.quantile(held[0][:, 1], 0.9) > 0.75 * 4.6  # stretched out it is too heavy for itself
    share = (held[1] < 0.8 * 4.6).all(axis=1).mean()
    assert 0.4 < share < 0.9
    assert 0.05 < load.body.mass < 0.5


def test_a_joint_that_never_holds_the_arm_is_refused_with_the_option_that_lifts_it(tmp_path, capsys):
    path = written(tmp_path, "arm.xml", weak(0.5))
    with pytest.raises(RobotError, match=r"joint m2: its largest torque is 0.5, holding .* or state .* with --torque"):
        load_of(path)
    assert load_of(path, torque=[0.5, 40.0, 20.0, 5.0, 5.0, 5.0], rated=0.2).body.mass == 0.2
    words = ["new-robot", str(path), "--out", str(tmp_path / "x"), "--torque", "1", "2"]
    assert main(words) == Status.BAD_INPUT
    assert "torque: 2 values, but the arm has 6 joints: m1, m2" in capsys.readouterr().err


def test_an_effort_and_a_speed_of_1_on_every_joint_are_an_exporter_s_for_none(tmp_path):
    placeholders = no_limits().replace('effort="0" velocity="0"', 'effort="1" velocity="1"')
    facts = model_facts(written(tmp_path, "ones.urdf", placeholders), None)
    assert facts.torque == facts.velocity == {}
    one_stated = placeholders.replace('effort="1"', 'effort="1.5"', 1)
    facts = model_facts(written(tmp_path, "one.urdf", one_stated), None)
    assert facts.torque == {"a1": 1.5, "a3": 1.0, "a5": 1.0}
    assert facts.velocity == {"a1": 1.0, "a3": 1.0, "a5": 1.0}


def test_a_payload_file_must_be_complete(tmp_path):
    path = written(tmp_path, "arm.xml", scara())
    for com in ("", "com = [0.01, 0.02, 0.03]\n"):
        partly = written(tmp_path, "p.toml", f'mass = 0.4\nknown = "mass"\n{com}')
        with pytest.raises(PayloadError, match=r"p\.toml: a simulation needs com and inertia of the payload"):
            load_of(path, payload=partly)


def told(capsys, *words):
    status = main(["new-robot", *words, "--evaluations", "60", "--jobs", "1", "--json"])
    output = capsys.readouterr()
    assert status == Status.PASSED, output.err
    return json.loads(output.out)


def test_what_is_given_is_written_and_runs_and_the_gripper_is_held(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(searching, "FIRST", 30)
    path, bottle = written(tmp_path, "arm.xml", with_jaw()), written(tmp_path, "bottle.toml", BOTTLE)
    out = tmp_path / "mine"
    torque = ["3.5", "3.25", "3", "2.75", "2.5"]
    words = [str(path), "--out", str(out), "--payload", str(bottle), "--rated-load", "0.25", "--torque", *torque]
    found = told(capsys, *words)
    assert found["held"] == ["jaw"]
    assert found["payload_mass"] == 0.31
    assert found["payload_warning"] == "0.31 kg is above the rated load, 0.25 kg"
    robot = tomllib.loads((out / "robot.toml").read_text())
    assert robot["flange"] == "palm"
    assert robot["rated_load"]["value"] == 0.25
    assert robot["drives"]["current_limit"]["value"] == [float(each) for each in torque]
    scenario = tomllib.loads((out / "scenario.toml").read_text())
    bare = {key: value for key, value in tomllib.loads(BOTTLE).items() if key != "mass_std"}
    bare["inertia"] = {key: float(value) for key, value in bare["inertia"].items()}
    assert scenario["plant"]["payload"] == bare
    assert scenario["belief"]["payload"] == {**bare, "mass_std": 0.004}
    assert main(["run", str(out / "scenario.toml"), "--json"]) == Status.PASSED


@pytest.mark.parametrize(
    "text",
    [scara(), pytest.param(weak(), marks=pytest.mark.slow), no_limits()],  # what weak joints carry is tested above
)
def test_small_arms_get_a_motion_that_runs_and_shows_every_gain(tmp_path, capsys, monkeypatch, text):
    monkeypatch.setattr(searching, "FIRST", 30)
    path = written(tmp_path, "arm.urdf" if text.startswith("<robot") else "arm.xml", text)
    found = told(capsys, str(path), "--out", str(tmp_path / "mine"))
    assert all(found["identifiable"])
    assert main(["run", str(tmp_path / "mine/scenario.toml"), "--json"]) == Status.PASSED


def test_warning_and_gripper_are_told_on_the_screen(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(searching, "FIRST", 30)
    path = written(tmp_path, "arm.xml", with_jaw())
    words = ["--payload", "0.2", "--evaluations", "60", "--jobs", "1"]
    assert main(["new-robot", str(path), "--out", str(tmp_path / "mine"), *words]) == Status.PASSED
    said = " ".join(capsys.readouterr().out.split())
    assert "WARNING: payload: 0.2 kg is more than the last link's own 0.1 kg" in said
    assert re.search(r"Recognised as joints of a gripper and locked: jaw\. The arm ends at body palm", said)
