"""`rx90 identify` on foreign logs: the gains of the same recording, and how it was read."""

import json
from pathlib import Path

import numpy as np
import pytest
from bags import Sample, write_bag
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, known_logs, ur_like

from ident.recordings.files import write_recording
from scenarios.cli import main


@pytest.fixture(scope="module")
def pair(tmp_path_factory) -> Path:
    """A bare and a loaded motion of known gains, in our columns and as a bag; the payload; the arm as URDF."""
    folder = tmp_path_factory.mktemp("pair")
    model = ur_like(count=3)
    logs = known_logs(model, BRICK, UR_GAIN[:3], np.random.default_rng(5), middle=UR_MIDDLE[:3])
    for log in logs:
        write_recording(log, folder / f"{log.name}.csv")
        order = [2, 0, 1]
        write_bag(
            folder / log.name,
            (Sample(stamp=float(t), names=[f"joint{j + 1}" for j in order], position=q[order], effort=1e3 * v[order])
             for t, q, v in zip(log.t, log.q, log.v, strict=True)),
            storage="mcap",
        )  # fmt: skip
    i = BRICK.inertia
    assert i is not None
    keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    inertia = ", ".join(f"{key} = {value}" for key, value in zip(keys, i, strict=True))
    (folder / "payload.toml").write_text(
        f"mass = {BRICK.mass}\nmass_std = {BRICK.mass_std}\ncom = {list(BRICK.com or ())}\ninertia = {{ {inertia} }}\n"
    )
    (folder / "arm.xml").write_text(
        """<mujoco model="ur-like"><compiler angle="radian"/><worldbody>
  <body name="a" pos="0 0 0.128"><joint name="joint1" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    <body name="b" pos="0 0.22 0" euler="0 1.5707963267948966 0"><joint name="joint2" axis="0 1 0"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <body name="c" pos="0 -0.171 0.612"><joint name="joint3" axis="0 1 0"/>
        <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></body></body>
</worldbody></mujoco>"""
    )
    return folder


def gains(folder: Path, ending: str, capsys, *words: str) -> list[float | None]:
    files = ["--model", "arm.xml", "--unloaded", f"bare{ending}", "--loaded", f"loaded{ending}"]
    files += ["--payload", "payload.toml"]
    paths = [word if word.startswith("--") else str(folder / word) for word in files]
    assert main(["identify", *paths, "--method", "ls-2011", "--json", *words]) == 0
    return [gain["estimate"] for gain in json.loads(capsys.readouterr().out)["gains"]]


def test_a_bag_gives_the_gains_of_the_same_recording(pair, capsys):
    own = gains(pair, ".csv", capsys)
    assert own[0] is None  # its axis is vertical, and this motion too slow
    np.testing.assert_allclose(own[1:], UR_GAIN[1:3], rtol=0.02)  # five of the larger deviation that is claimed
    words = ["--signal", "current", "--columns", "v=joint1.effort,joint2.effort,joint3.effort[mA]"]
    found = gains(pair, "", capsys, *words)
    assert found[0] is None
    np.testing.assert_allclose(found[1:], own[1:], rtol=1e-6)  # header stamps are whole nanoseconds


def test_how_a_foreign_log_was_read_is_told_beside_the_gains(pair, capsys):
    words = ["identify", "--model", str(pair / "arm.xml"), "--unloaded", str(pair / "bare"), "--loaded"]
    words += [str(pair / "loaded"), "--payload", str(pair / "payload.toml"), "--method", "ls-2011"]
    assert main([*words, "--signal", "torque-after-drive"]) == 0
    err = capsys.readouterr().err
    for name in ("bare", "loaded"):
        assert f"{pair / name}: v is measured after the drive: a gain is the scale of the torque sensor" in err
