"""`rx90 trajectory`: every form holds the motion's closed form, names and times, and says what breaks a limit."""

import json
import re
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from model_files import LINKS, urdf
from plants import short_motion
from printed import printed
from quick import quick_scenario

import rx90_mjcf
from ident.model.arm import load_arm
from scenarios.cli import main
from scenarios.experiments.files.motions import read_motion, write_motion
from sim.trajectory import at_rest

RATE = 30.0
"""Of a motion of 6.01 s: 180.3 periods, so that the last one is short."""
DURATION = 6.01


@pytest.fixture
def motion(tmp_path) -> Path:
    write_motion(short_motion(DURATION, 0.25), tmp_path / "motion.toml", [])
    (tmp_path / "arm.urdf").write_text(urdf())
    return tmp_path / "motion.toml"


def written(motion: Path, ending: str, *more: str, model: bool = True) -> str:
    out = motion.parent / f"out{ending}"
    named = ["--model", str(motion.parent / "arm.urdf")] if model else []
    assert main(["trajectory", str(motion), *named, "--out", str(out), "--rate", str(RATE), *more]) == 0
    return out.read_text()


def times() -> np.ndarray:
    return np.append(np.arange(181) / RATE, DURATION)


def test_csv_holds_the_closed_form_at_every_sample_and_the_end(motion):
    text = written(motion, ".csv", model=False)
    table = pd.read_csv(StringIO(text), comment="#")
    t = times()
    np.testing.assert_allclose(table["t"], t, rtol=1e-15)  # one division each
    for name, values in zip(("q", "dq", "ddq"), read_motion(motion.name, motion.parent)(t), strict=True):
        own = table[[f"{name}{j}" for j in range(1, 7)]].to_numpy()
        np.testing.assert_allclose(own, values, rtol=1e-12, atol=1e-12)  # every digit is kept
    assert table["dq2"].iloc[-1] == pytest.approx(0.0, abs=1e-12)


def test_a_joint_trajectory_names_the_joints_of_the_model(motion):
    said = yaml.safe_load(written(motion, ".yaml"))
    assert said["joint_names"] == [f"{link[0]}_joint" for link in LINKS]
    t = np.array([p["time_from_start"]["sec"] + 1e-9 * p["time_from_start"]["nanosec"] for p in said["points"]])
    np.testing.assert_allclose(t, times(), atol=6e-10)  # half a nanosecond
    assert all(0 <= p["time_from_start"]["nanosec"] < 10**9 for p in said["points"])
    q, dq, ddq = read_motion(motion.name, motion.parent)(times())
    for name, values in (("positions", q), ("velocities", dq), ("accelerations", ddq)):
        np.testing.assert_allclose([p[name] for p in said["points"]], values, atol=1e-12)  # twelve decimals


def test_urscript_moves_slowly_to_the_start_and_serves_the_rest(motion):
    lines = written(motion, ".script").splitlines()
    q, _, _ = read_motion(motion.name, motion.parent)(times())
    rows = [np.array(line.split("[")[1].split("]")[0].split(","), dtype=float) for line in lines if "[" in line]
    np.testing.assert_allclose(rows, q, atol=1e-9)  # nine decimals
    assert lines[1].startswith("  movej(")
    assert (lines[0], lines[-2:]) == ("def drive_gains():", ["end", "drive_gains()"])
    steps = [float(re.search(r" t=([\d.e-]+)", line)[1]) for line in lines if "servoj" in line]
    np.testing.assert_allclose(np.cumsum(steps), times()[1:], rtol=1e-7)  # nine digits each


def test_a_scenario_gives_its_motion_names_and_limits(tmp_path, capsys):
    scenario = quick_scenario(tmp_path)
    out = tmp_path / "out.yaml"
    assert main(["trajectory", str(scenario), "--out", str(out), "--json"]) == 0
    told = printed(capsys, "trajectory")
    assert yaml.safe_load(out.read_text())["joint_names"] == list(load_arm(rx90_mjcf.MJCF).joint_names)
    assert told["samples"] == 751  # 6 s at 125 Hz, and the start
    q, dq, _ = read_motion("short.toml", tmp_path)(np.linspace(0.0, 6.0, 751))
    np.testing.assert_allclose(told["start"], q[0], rtol=1e-12)  # the same closed form
    np.testing.assert_allclose(told["max_velocity"], np.abs(dq).max(axis=0), rtol=1e-9)  # times differ by rounding


@pytest.mark.usefixtures("motion")
def test_what_breaks_a_limit_is_named(tmp_path, capsys):
    center = np.array([0.1, 0.2, 0.3, 3.0, 0.2, 0.1])  # 3.05 rad is the upper limit of the model
    sine = np.zeros((6, 2))
    sine[3] = 0.2, -0.1
    write_motion(at_rest(center, sine, np.zeros((6, 2)), 5.0), tmp_path / "far.toml", [])
    assert main(["trajectory", str(tmp_path / "far.toml"), "--model", str(tmp_path / "arm.urdf"), "--out",
                 str(tmp_path / "far.csv"), "--json"]) == 0  # fmt: skip
    assert json.loads(capsys.readouterr().out)["beyond_limits"] == ["joint 4: positions"]
    strong = "[plant]\ncurrent_limit = [1e5, 1e5, 1e5, 1e5, 1e5, 1e5]\n"  # or the drives are what refuses it
    quick_scenario(tmp_path, strong)
    write_motion(short_motion(0.3, 0.25), tmp_path / "short.toml", [])
    main(["trajectory", str(tmp_path / "quick.toml"), "--out", str(tmp_path / "fast.csv"), "--json"])
    beyond = json.loads(capsys.readouterr().out)["beyond_limits"]
    assert {"joint 1: speed", "joint 1: acceleration"} <= set(beyond)


@pytest.mark.parametrize(
    ("words", "match"),
    [
        (["--out", "x.txt"], "expected an ending"),
        (["--out", "x.yaml"], "add --model ROBOT"),
        (["--out", "x.csv", "--rate", "0.1"], "expected 1 to 10000 Hz"),
        (["--out", "x.csv", "--model", "three.urdf"], "this motion is of 6 joints, but the model has 2"),
        (["--out", "x.script", "--model", "sliding.urdf"], "this one has 6 joints, 1 of them prismatic"),
    ],
)
def test_a_motion_in_a_form_that_it_cannot_have_is_refused(motion, monkeypatch, capsys, words, match):
    monkeypatch.chdir(motion.parent)
    text = urdf()
    Path("sliding.urdf").write_text(text.replace('type="revolute"', 'type="prismatic"', 1))
    Path("three.urdf").write_text(text.replace('type="revolute"', 'type="fixed"', 4))
    try:
        status = main(["trajectory", "motion.toml", *words])
    except SystemExit as stopped:
        status = stopped.code
    assert status == 2
    assert match in capsys.readouterr().err
    assert not Path(words[1]).exists()


def test_a_scenario_takes_no_second_model(tmp_path, capsys):
    words = ["trajectory", str(quick_scenario(tmp_path)), "--model", "arm.urdf", "--out", str(tmp_path / "x.csv")]
    assert main(words) == 2
    assert "names its own robot" in capsys.readouterr().err
