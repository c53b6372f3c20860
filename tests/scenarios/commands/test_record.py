import re
import shlex
from io import StringIO
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import yaml
from bad_files import refused
from places import ROOT
from plants import RX90, short_motion
from printed import printed
from quick import quick_scenario

import rx90_mjcf
from ident.diagnosis.diagnosis import Diagnosed
from ident.diagnosis.timing import slowest_hz
from ident.model.arm import load_arm
from ident.observation.observation import ObserveOptions
from ident.payload.payload import read_payload
from scenarios.cli import OneLineParser, main
from scenarios.commands import COMMANDS, command
from scenarios.design.record import SETTINGS, Recorded
from scenarios.experiments.motions import read_motion, write_motion
from sim.feedforward_currents import States
from sim.trajectory import FourierTrajectory

TEXT = """extends = "field-two-weights"
[experiment]
warm_up = 43.0
pause = 17.0
[identification.observe]
cutoff_hz = 13.0
decimation_cutoff_hz = 9.0
"""
LIGHT = """[belief.payloads.light]
mass = 2.4
mass_std = 0.03
com = [0.1, 0.2, 0.3]
com_std = [0.01, 0.02, 0.04]
[belief.payloads.heavy]
com_std = [0.0, 0.0, 0.0]
"""
RATE, DURATION = 30.0, 6.01
"""180.3 periods, so that the last one is short."""


def recorded(folder: Path, text: str = TEXT, *more: str) -> Path:
    (folder / "cell.toml").write_text(text)
    assert main(["record", str(folder / "cell.toml"), "--out", str(folder / "cell"), *more]) == 0
    return folder / "cell"


def parsed(page: str) -> list[list[str]]:
    lines = [shlex.split(line) for line in re.findall(r"^\s*rx90 (.*)$", page, re.MULTILINE)]
    for name, *words in lines:
        assert name in COMMANDS
        parser = OneLineParser(prog="rx90")
        command(name).add_arguments(parser)
        parser.parse_args(words)
    return lines


@pytest.fixture
def _unforeseen(monkeypatch) -> None:
    """Without what logs will exclude, which takes most of the time and is on `page`."""
    monkeypatch.setattr("ident.diagnosis.diagnose.horizon", lambda _: Diagnosed())
    prepared = SimpleNamespace(logs=lambda: None)
    monkeypatch.setattr("scenarios.prediction.predictor.expected_preparation", lambda *_: prepared)


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> str:
    return (recorded(tmp_path_factory.mktemp("record")) / "record.md").read_text()


def test_motions_weights_and_rates_are_those_of_the_scenario(page):
    assert "for 43 s" in page
    assert "Keep this order" in page  # a bare motion follows the loaded ones
    assert "at 52 Hz or more" in page  # four samples in a period of the higher cut-off
    assert "416 Hz" in page  # 32 cut-offs of the positions
    assert slowest_hz(ObserveOptions(cutoff_hz=7.0, decimation_cutoff_hz=11.0)) == 44.0
    rows = [[word.strip() for word in line.strip("|").split("|")] for line in page.splitlines() if line.startswith("|")]
    motions = [row for row in rows if row[-1].endswith(".parquet")]
    assert [row[1] for row in motions] == ["nothing", "light", "heavy", "nothing"]
    assert [row[2] for row in motions] == ["-", "17", "17", "17"]
    weights = {row[0]: row for row in rows if row[-1].startswith("payload")}
    assert weights["light"][1].startswith("4.275")
    assert weights["heavy"][1::3] == ["7.025 ± 0.025", "payload-heavy.toml"]
    assert "rated for 6 kg, everything mounted together. Above the rated load: heavy;" in page
    assert re.search(r"^\| zeros beyond [\d.]+ \(q2\), .* \| excluded \|$", page, re.MULTILINE)
    assert re.search(r"^\| errors of a motor.s ratio beyond [\d.]+ \(q1\), .* \| excluded \|$", page, re.MULTILINE)
    guide = " ".join((ROOT / "docs" / "how-to" / "record.md").read_text().split())
    assert SETTINGS in page
    assert SETTINGS in guide
    assert f"Log at {slowest_hz(ObserveOptions()):g} Hz or more" in guide


@pytest.mark.usefixtures("_unforeseen")
def test_commands_on_the_page_name_files_flange_and_couplings(page, tmp_path):
    lines = parsed(page)
    assert {"view", "convert", "identify", "verify"} <= {line[0] for line in lines}
    identify = " ".join(next(line for line in lines if line[0] == "identify"))
    assert "--unloaded unloaded.parquet --loaded light.parquet --payload payload-light.toml" in identify
    assert "--cutoff-hz 13.0" in identify
    checks = [line for line in lines if line[0] == "check"]
    for words, name in zip(checks, ("light", "heavy"), strict=True):
        at = words.index("--loaded")
        assert words[2:at] == ["unloaded.parquet", "unloaded-2.parquet"]
        assert words[at:] == ["--loaded", f"{name}.parquet", "--payload", f"payload-{name}.toml"]
    believed = 'extends = "tx40"\n[belief]\ncouplings = [[5, 6], [1, 3]]\n'
    pair = (recorded(tmp_path, believed) / "record.md").read_text()
    assert "motions in the order bare, loaded, loaded, bare measure it." in pair
    lines = parsed(pair)
    believing = [" ".join(line) for line in lines if line[0] in {"check", "identify", "verify"}]
    assert len(believing) == 3
    assert all("--coupling 5 6 --coupling 1 3" in line for line in believing)


@pytest.mark.usefixtures("_unforeseen")
def test_payload_files_have_the_stated_deviations_and_measured_ones_are_kept(tmp_path, capsys):
    (tmp_path / "cell").mkdir()
    (tmp_path / "cell" / "payload-heavy.toml").write_text("mine")
    for more in ([], ["--json"]):  # files of payloads are kept, whoever wrote them
        capsys.readouterr()
        page = (recorded(tmp_path, TEXT + LIGHT, *more) / "record.md").read_text()
        assert "| light | 2.4 ± 0.03 | 0.1, 0.2, 0.3 ± 0.01, 0.02, 0.04 |" in page
        assert "| heavy | 7.025 ± 0.025 | 0, 0, 0.142776 |" in page
    found = read_payload(tmp_path / "cell" / "payload-light.toml")
    assert (found.mass_std, found.com_std) == (0.03, (0.01, 0.02, 0.04))
    assert (tmp_path / "cell" / "payload-heavy.toml").read_text() == "mine"
    assert not (tmp_path / "cell" / "payload.toml").exists()  # nothing of that name is mounted
    kept = printed(capsys, "record")["kept"]
    assert [Path(each).name for each in kept] == ["payload-light.toml", "payload-heavy.toml"]  # the first run's too


def quick(folder: Path, motion: FourierTrajectory, capsys: pytest.CaptureFixture[str]) -> dict:
    folder.mkdir(exist_ok=True)
    path = quick_scenario(folder)
    strong = "[plant]\ncurrent_limit = [1e5, 1e5, 1e5, 1e5, 1e5, 1e5]\n"  # or fast motions are refused for their torque
    path.write_text(path.read_text() + strong)
    write_motion(motion, folder / "short.toml", [])
    return printed(capsys, "record", ["record", str(path), "--out", str(folder), "--rate", str(RATE)])


@pytest.mark.usefixtures("_unforeseen")
def test_every_file_of_the_motion_agrees_with_its_closed_form(tmp_path, capsys):
    result = quick(tmp_path, short_motion(DURATION, 0.25), capsys)
    texts = {each.suffix: each.read_text() for each in tmp_path.glob("motion.*")}
    t = np.append(np.arange(181) / RATE, DURATION)
    motion = read_motion("short.toml", tmp_path)(t)
    table = pd.read_csv(StringIO(texts[".csv"]), comment="#")
    np.testing.assert_allclose(table["t"], t, rtol=1e-15)  # one division each
    for name, values in zip(("q", "dq", "ddq"), motion, strict=True):
        own = table[[f"{name}{j}" for j in range(1, 7)]].to_numpy()
        np.testing.assert_allclose(own, values, rtol=1e-12, atol=1e-12)  # every digit is kept
    ros = yaml.safe_load(texts[".yaml"])
    assert ros["joint_names"] == list(load_arm(rx90_mjcf.MJCF).joint_names)
    stamps = [p["time_from_start"] for p in ros["points"]]
    assert all(0 <= each["nanosec"] < 10**9 for each in stamps)
    seconds = [each["sec"] + 1e-9 * each["nanosec"] for each in stamps]
    np.testing.assert_allclose(seconds, t, atol=6e-10)  # half a nanosecond
    for name, values in zip(("positions", "velocities", "accelerations"), motion, strict=True):
        np.testing.assert_allclose([p[name] for p in ros["points"]], values, atol=1e-12)  # twelve decimals
    lines = texts[".script"].splitlines()
    rows = [np.array(line.split("[")[1].split("]")[0].split(","), dtype=float) for line in lines if "[" in line]
    np.testing.assert_allclose(rows, motion[0], atol=1e-9)  # nine decimals
    assert lines[1].startswith("  movej(")
    assert (lines[0], lines[-2:]) == ("def drive_gains():", ["end", "drive_gains()"])
    steps = [float(re.search(r" t=([\d.e-]+)", line)[1]) for line in lines if "servoj" in line]
    np.testing.assert_allclose(np.cumsum(steps), t[1:], rtol=1e-7)  # nine digits each
    assert (result["samples"], result["duration_s"], result["beyond_limits"]) == (182, DURATION, [])
    q, dq, ddq = motion
    numbers = {
        "start": q[0],
        "lowest": q.min(axis=0),
        "highest": q.max(axis=0),
        "max_velocity": np.abs(dq).max(axis=0),
        "velocity_used": np.abs(dq).max(axis=0) / RX90.drives.max_velocity,
        "max_acceleration": np.abs(ddq).max(axis=0),
        "acceleration_used": np.abs(ddq).max(axis=0) / RX90.drives.max_acceleration,
    }
    for name, values in numbers.items():
        np.testing.assert_allclose([joint[name] for joint in result["joints"]], values, rtol=1e-9, err_msg=name)


def test_exceeded_limits_are_named():
    rated = SimpleNamespace(max_velocity=np.array([1.0, 2.0]), max_acceleration=np.array([3.0, 4.0]))
    plant = SimpleNamespace(robot=SimpleNamespace(drives=rated))
    arm = SimpleNamespace(n=2, joint_names=("a", "b"), lower=np.full(2, -9.0), upper=np.full(2, 9.0), transmission=None)
    setup = SimpleNamespace(plant=plant, structure=SimpleNamespace(arm=arm))
    q, dq, ddq = np.array([[0.3, 0.7], [0.3, -9.2]]), np.array([[-1.1, 0.0]] * 2), np.array([[0.0, 4.1]] * 2)
    found = Recorded.of(setup, States(np.arange(2.0), q, dq, ddq))
    assert found.beyond_limits == ["joint 1: speed", "joint 2: positions", "joint 2: acceleration"]


@pytest.mark.usefixtures("_unforeseen")
def test_an_arm_of_seven_joints_gets_no_urscript(tmp_path):
    folder = recorded(tmp_path, 'extends = "panda"\n')
    assert {each.name for each in folder.glob("motion.*")} == {"motion.csv", "motion.yaml"}


def test_too_few_or_too_many_samples_are_refused(tmp_path, capsys):
    path = quick_scenario(tmp_path)
    write_motion(short_motion(250.0, 0.25), tmp_path / "short.toml", [])
    for rate, message in (("0.1", "expected 1 to 10000 Hz"), ("6000", "expected 1 to 1000000")):
        assert message in refused(capsys, ["record", str(path), "--out", str(tmp_path / "out"), "--rate", rate])
    assert not (tmp_path / "out").exists()


BODY = "payload = { mass = 61.0, com = [0.31, 0.02, 0.12], inertia = { ixx = 0.51, iyy = 0.52, izz = 0.53 } }"


def test_a_payload_that_no_drive_bears_is_refused_and_nothing_is_written(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "heavy.toml").write_text(f'extends = "nominal"\n[plant]\n{BODY}\n[belief]\n{BODY}\n')
    for words in (["record", "heavy.toml", "--out", "cell"], ["predict", "heavy.toml", "--quiet"]):
        line = refused(capsys, words)
        assert line.startswith("rx90: loaded: drive of joint6 would need up to ")
        assert line.endswith("use a lighter payload or a slower motion\n")
    assert [path.name for path in tmp_path.iterdir()] == ["heavy.toml"]
