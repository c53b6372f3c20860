"""Gains that fall with the current, from a plant of which they do: identified, written, and used by every command."""

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from bad_files import refused
from printed import fits, printed
from quick import quick_scenario
from undiagnosed import undiagnosed
from weighed_cell import TWO_WEIGHTS, identified

from ident.estimation.known_gains import KnownGains
from ident.recordings.files import read_recording, write_recording
from ident.recordings.recording import Recording
from ident.support.errors import NotIdentifiable
from scenarios.cli import main
from scenarios.experiments.scenario import load_scenario, setup_of
from scenarios.gains_in_use.controller_files import ros_parameters
from scenarios.gains_in_use.known_gains import check_currents
from scenarios.results.gains_file import read_gains
from scenarios.support.errors import ScenarioError
from sim.effects.motors import gain_at

LAW = "[plant.errors]\ntorque_constant_falls = 0.15\n"
ONE_LAW = [each for law in ("scale", "sign", "position", "time") for each in ("--option", f"{law}_std=0")]


@pytest.fixture(scope="module")
def cell(tmp_path_factory) -> Path:
    """Recordings bare, light and heavy, and gains from bare and heavy: constant.toml, and curve.toml with gain_laws."""
    folder = tmp_path_factory.mktemp("bent")
    path = quick_scenario(folder, TWO_WEIGHTS + LAW, method="nls", lasts=6.0)
    path.write_text(
        path.read_text().replace(
            'motion = "short.toml"', 'motion = "short.toml"\nprotocol = ["bare", "light", "heavy"]'
        )
    )
    with undiagnosed():
        main(["run", str(path), "--save", str(folder / "run"), "--gains-out", str(folder / "constant.toml")])
        words = [*identified(folder), "--option", "gain_laws=true", *ONE_LAW, "--gains-out", str(folder / "curve.toml")]
        assert main([*words, "--save", str(folder / "saved")]) == 0
    return folder


def true_gain(cell: Path, current: np.ndarray) -> np.ndarray:
    plant = setup_of(load_scenario(str(cell / "quick.toml"))).plant
    return np.array([gain_at(plant.errors, plant.drives, each) for each in current])


STEEP = [1, 2]
"""The joints, from 0, that carry most: their currents range over enough of the law."""


def test_torques_of_another_log_are_nearer_to_the_plant_s_through_the_curve(cell, tmp_path, capsys):
    log, off = read_recording(cell / "run" / "light.parquet"), []
    true = true_gain(cell, log.v) * log.v
    for name in ("curve", "constant"):
        out = tmp_path / f"{name}.parquet"
        words = ["--gains", str(cell / f"{name}.toml"), "--out", str(out), "--json"]
        assert main(["torque", str(cell / "run" / "light.parquet"), *words]) == 0
        notes, table = printed(capsys, "torque")["notes"], pd.read_parquet(out)
        assert [each[:8] for each in notes] == ([f"joint {j}:" for j in (1, 2, 3, 5)] if name == "curve" else [])
        off.append([np.linalg.norm(table[f"tau{j + 1}"] - true[:, j]) / np.linalg.norm(true[:, j]) for j in STEEP])
    assert (np.array(off[0]) < 0.4 * np.array(off[1])).all()  # 1.7 % of 5.1, and .4 of 2.1
    assert np.max(off[0]) < 0.025


def test_a_curve_is_written_with_the_gains_and_in_the_result(cell, capsys):
    capsys.readouterr()
    file = read_gains(cell / "curve.toml")
    text = tomllib.loads((cell / "curve.toml").read_text())
    fits(text, "gains")
    result = json.loads((cell / "saved" / "result.json").read_text())
    fits(result, "result")
    assert [each["curve"] for each in result["gains"]] == [each.get("curve") for each in text["gains"]]
    (line,) = [each for each in ros_parameters(file, tuple("abcdef"), {}).splitlines() if "joint 2" in each]
    told, second = re.findall(r"(?<= )\d+\.?\d*(?= N m|,)", line)[:2], text["gains"][1]
    np.testing.assert_allclose([*map(float, told)], [second["estimate"], second["curve"]["current"]], rtol=5e-3)


def test_two_files_are_compared_at_one_current(tmp_path, capsys):
    curve = {"current": 3.0, "largest": 5.0, "slope": 0.02, "by_sign": 0.0, "covariance": [[0.0] * 3] * 2}
    other = curve | {"current": 1.5, "slope": 0.02 / 1.03}  # the same, where the gain is 3 % larger
    for name, gain, own in (("A", 2.5, curve), ("B", 1.03 * 2.5, other)):
        entry = {"joint": 1, "estimate": gain, "std": 0.01 * gain, "curve": own}
        (tmp_path / f"{name}.json").write_text(json.dumps({"gains": [entry]}))
    words = ["verify", str(tmp_path / "A.json"), str(tmp_path / "B.json")]
    (joint,) = printed(capsys, "verify-gains", words)["joints"]
    np.testing.assert_allclose([joint["B"], 1.0 + joint["rel_change"]], [joint["A"], 1.0], rtol=1e-12)


def test_currents_beyond_those_with_which_a_gain_is_known_are_said(cell, tmp_path, capsys):
    file = read_gains(cell / "curve.toml")
    largest, log = file.largest_currents, read_recording(cell / "run" / "light.parquet")
    np.testing.assert_allclose(largest[STEEP], [file.gains[j].curve.largest for j in STEEP], rtol=1e-3)
    v = log.v.copy()
    v[7] = 1.3 * largest * np.array([0.0, -1.0, 0.5, 1.0, 0.7, -0.7])  # joint 4 has no gain
    assert check_currents(file, log) == ()
    (said,) = check_currents(file, beyond := Recording(log.t, log.q, v, "log"))
    most = f"v2 reaches {1.3 * largest[1]:.3g}, known up to {largest[1]:.3g}"
    assert said == f"{most}: at larger currents a gain may differ"
    write_recording(beyond, tmp_path / "beyond.parquet")
    words = ["--gains", str(cell / "curve.toml"), "--out", str(tmp_path / "torque.parquet"), "--json"]
    assert main(["torque", str(tmp_path / "beyond.parquet"), *words]) == 0
    assert printed(capsys, "torque")["notes"][-1] == said


def test_a_gain_written_by_hand_states_the_largest_current_at_which_it_holds(tmp_path):
    path = tmp_path / "firmware.toml"
    of = "[[gains]]\njoint = {}\nestimate = {}\nstd = 0.1\n{}\n"
    path.write_text(of.format(1, 2.5, "largest_current = 4.5") + of.format(2, -7.0, ""))
    t = np.arange(5.0)
    log = Recording(t, np.outer(t, (0.3, 0.7)), np.outer((0.2, -1.0, 0.5, 0.9, 0.1), (4.6, 900.0)), "log")
    assert check_currents(read_gains(path), log) == (
        "v1 reaches 4.6, known up to 4.5: at larger currents a gain may differ",
    )
    path.write_text(of.format(1, 2.5, "largest_current = 0"))
    with pytest.raises(ScenarioError, match=r"gains\.1\.largest_current"):
        read_gains(path)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, "gains.1: refused but has a number"),
        ({"slopes": 2.0}, "unknown key gains.1.curve.slopes; did you mean 'slope'"),
        ({"slope": 0.7}, "gains: joint 1: its gain changes its sign with the current; check the curve"),
    ],
)
def test_a_curve_that_cannot_be_is_refused_in_one_line(tmp_path, changes, words):
    curve = {"current": 3.0, "largest": 5.0, "slope": 0.02, "by_sign": 0.01, "covariance": [[0.0] * 3] * 2}
    path = tmp_path / "gains.json"
    known = {} if changes == {} else {"estimate": 2.0, "std": 0.1}
    entry = {"joint": 1, "identifiable": bool(known), **known, "curve": curve | changes}
    path.write_text(json.dumps({"gains": [entry]}))
    with pytest.raises(ScenarioError, match=re.escape(words)):
        read_gains(path)


def test_bare_motions_are_identified_through_the_curve(cell, monkeypatch, capsys):
    def ratios(_: object, __: object, believed: KnownGains) -> None:
        raise NotIdentifiable(f"curves of {[*believed.curves]}")

    monkeypatch.setattr("scenarios.gains_in_use.known_gains.gain_ratios", ratios)
    words = [*identified(cell)[:5], "--gains", str(cell / "curve.toml")]
    with undiagnosed():
        assert "curves of [0, 1, 2, 4]" in refused(capsys, words)
