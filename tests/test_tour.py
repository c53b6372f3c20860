"""The commands of `docs/tour.md`, literally, on logs of a simulated UR10e in RTDE's columns."""

import re
import shlex
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from places import ROOT
from scipy.spatial.transform import Rotation

from ident.arm import Arm, load_arm
from ident.recording_files import read_recording
from scenarios.cli import main
from scenarios.files.gains import read_gains
from scenarios.files.motions import read_motion, write_motion
from scenarios.robots import robot
from sim.trajectory import FourierTrajectory

LINES = re.findall(r"^    (rx90 .*)$", (ROOT / "docs" / "tour.md").read_text(encoding="utf-8"), re.MULTILINE)
WEIGHTS = (
    """{ mass = 8.0, com = [0.1, 0.07, 0.2], inertia = { ixx = 0.03246, iyy = 0.03246, izz = 0.006491 } }""",
    ("""{ mass = 5.3, com = [0.06, -0.04, 0.16], inertia = { ixx = 0.02, iyy = 0.021, izz = 0.005 } }"""),
)
SCENARIO = f"""extends = "ur10e"
[plant.payloads]
heavy = {WEIGHTS[0]}
other = {WEIGHTS[1]}
[belief.payloads]
heavy = {WEIGHTS[0]}
other = {WEIGHTS[1]}
[experiment]
motion = "short.toml"
protocol = ["bare", "heavy", "other"]
[identification]
method = "ls-2011"
"""
SHEET = [12.0, 12.0, 10.0, 10.0, 10.0, 10.0]


def urdf(arm: Arm) -> str:
    """The arm's kinematics, with efforts."""
    text = '<link name="l0"/>'
    for j, name in enumerate(arm.joint_names):
        rpy = Rotation.from_matrix(arm.rotation[j]).as_euler("xyz")
        x, rpy, axis = (" ".join(map(repr, each.tolist())) for each in (arm.translation[j], rpy, arm.axis[j]))
        text += (
            f'<link name="l{j + 1}"/><joint name="{name}" type="revolute"><parent link="l{j}"/><child link="l{j + 1}"/>'
            f'<origin xyz="{x}" rpy="{rpy}"/><axis xyz="{axis}"/>'
            '<limit lower="-6.28" upper="6.28" effort="240" velocity="3"/></joint>\n'
        )
    return f'<robot name="ur10e">{text}</robot>\n'


@pytest.fixture
def cell(tmp_path) -> Path:
    """Logs, weights, model and data sheet."""
    long = read_motion("ur10e", tmp_path)
    short = FourierTrajectory(long.center, 0.5 * long.sine, 0.5 * long.cosine, 0.6 * long.duration)
    write_motion(short, tmp_path / "short.toml", [])
    (tmp_path / "cell.toml").write_text(SCENARIO)
    main(["run", str(tmp_path / "cell.toml"), "--save", str(tmp_path / "run"), "--json"])
    names = ["timestamp", *(f"actual_{kind}_{j}" for kind in ("q", "current") for j in range(6))]
    for file, name in (("unloaded", "bare"), ("heavy", "heavy"), ("other", "other")):
        log = read_recording(tmp_path / "run" / f"{file}.parquet")
        rows = np.column_stack((1e4 + log.t, log.q, log.v))[::2]  # 500 Hz
        np.savetxt(tmp_path / f"{name}.csv", rows, fmt="%.9f", header=" ".join(names), comments="")
    for name in ("heavy", "other"):
        (tmp_path / "run" / f"payload-{name}.toml").rename(tmp_path / f"{name}.toml")
    (tmp_path / "arm.urdf").write_text(urdf(load_arm(robot("ur10e").model)))
    lines = [f"[[gains]]\njoint = {j}\nestimate = {gain}\nstd = 0.0\n" for j, gain in enumerate(SHEET, 1)]
    (tmp_path / "sheet.toml").write_text("\n".join(lines))
    return tmp_path


def test_the_tour_leads_from_logs_to_a_patched_model(cell, monkeypatch, capsys):
    monkeypatch.chdir(cell)
    capsys.readouterr()
    for line in LINES:
        command, _, to = line.partition(" > ")
        assert main(shlex.split(command)[1:]) == 0, line
        told = capsys.readouterr()
        if to:
            Path(to).write_text(told.out)
    found, true = read_gains(Path("gains.toml")).gains, robot("ur10e").drives
    dynamics = ET.parse("patched.urdf").getroot().findall("joint/dynamics")
    efforts = [float(each.get("effort")) for each in ET.parse("patched.urdf").getroot().findall("joint/limit")]
    for j, entry in enumerate(found):
        # Five deviations: one choice of seeds in a million misses by chance.
        assert abs(entry.estimate - true.gain[j]) < 5.0 * entry.std, entry
        np.testing.assert_allclose(efforts[j], 240.0 * entry.estimate / SHEET[j], rtol=1e-5)  # six digits
    friction = [float(each.get("friction")) for each in dynamics]
    # Coulomb friction of a short motion with noise: what the gain says to some percent, the fit to as much.
    np.testing.assert_allclose(friction, true.coulomb_friction, rtol=0.1)
    assert len(load_arm("patched.urdf").joint_names) == 6
