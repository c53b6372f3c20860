import os
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from bad_files import refused
from one_process import rx90
from PIL import Image

from scenarios.cli import main
from sim.errors import PlantError


def without_egl() -> bool:
    code = "import mujoco; mujoco.Renderer(mujoco.MjModel.from_xml_string('<mujoco/>'), 64, 64)"
    environment = os.environ | {"MUJOCO_GL": "egl"}
    return subprocess.run([sys.executable, "-c", code], capture_output=True, env=environment, check=False).returncode


def test_a_picture_of_both_motions_is_drawn(tmp_path):
    path = tmp_path / "both.png"
    done = rx90("view", "nominal", "--render", path, "--width", "300", "--quiet", MUJOCO_GL="egl")
    if done.returncode and without_egl():
        pytest.skip("this machine has no EGL to draw with")
    pixels = np.asarray(Image.open(path).convert("RGB")).astype(int)
    height, width, _ = pixels.shape
    said = f"{path}: 1 picture of 300 x {height}, from left: unloaded, loaded\n"
    assert (done.returncode, done.stdout, done.stderr) == (0, said, "")
    assert (width, height % 2) == (300, 0)
    yellow = (pixels[..., 0] > 150) & (pixels[..., 2] < 90)  # both arms
    columns = np.flatnonzero(yellow.any(axis=0))
    assert columns.min() < 120
    assert columns.max() > 180


def test_an_unknown_ending_and_a_time_after_the_end_are_refused_and_the_end_is_drawn(tmp_path, capsys, monkeypatch):
    def no_pictures(*_, **__):
        raise PlantError("drawn")

    monkeypatch.setattr("sim.viewer.pictures", no_pictures)
    for name, at, said in (
        ("a.png", "20.02", "--at 20.02 s: the motion ends at 20 s; name a time up to that"),
        ("a.png", "20", "drawn"),
        ("film.avi", "20", "film.avi: unknown ending '.avi'; known: .png, .gif, .mp4"),
    ):
        line = refused(capsys, ["view", "nominal", "--render", str(tmp_path / name), "--at", at])
        assert line.endswith(f"{said}\n")
    assert list(tmp_path.iterdir()) == []


def test_without_a_screen_one_line_says_what_needs_none(capsys, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.setenv(name, "")
    line = refused(capsys, ["view", "nominal"])
    assert line.startswith("rx90: no window can be opened: ")
    assert line.endswith("; --render FILE needs none\n")


def test_a_film_has_every_picture_at_its_rate_from_the_start(tmp_path, monkeypatch):
    asked = []

    def pictures(shown, times, **size):
        return [np.full((40, 60, 3), k) for k in range(len(times))]

    shown = SimpleNamespace(height=lambda width: 64)
    monkeypatch.setattr("sim.viewer.scene", lambda motions, times: asked.append(times) or shown)
    monkeypatch.setattr("sim.viewer.pictures", pictures)
    path = tmp_path / "a.gif"
    assert main(["view", "nominal", "--render", str(path)]) == 0
    np.testing.assert_allclose(asked[0], 0.125 * np.arange(160), rtol=1e-12)
    with Image.open(path) as film:
        assert film.n_frames == 160
        assert (film.info["duration"], film.info["loop"]) == (120, 0)  # a GIF counts hundredths of a second
