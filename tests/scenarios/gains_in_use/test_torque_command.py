import numpy as np
import pandas as pd
import pytest
from bad_files import refused
from printed import printed
from weighed_cell import editable

from ident.recordings.files import read_recording
from ident.recordings.recording import Recording
from scenarios.cli import main
from scenarios.gains_in_use.known_gains import check_currents
from scenarios.results.gains_file import read_gains
from scenarios.support.errors import ScenarioError


def test_torques_are_written_with_units_and_intervals(weighed_cell, capsys):
    log, out, file = (weighed_cell / name for name in ("run/light.parquet", "torque.parquet", "gains.toml"))
    words = ["torque", str(log), "--gains", str(file), "--out"]
    assert main([*words, str(out)]) == 0
    said, missing = " ".join(capsys.readouterr().out.split()), []
    assert "The gains are of robot rx90. Logs do not name their robot" in said
    document = printed(capsys, "torque", [*words, str(out)])
    table, recording, gains = pd.read_parquet(out), read_recording(log), read_gains(file)
    for entry in gains.gains:
        name = f"tau{entry.joint}"
        if not entry.identifiable:
            assert name not in table
            assert f"Joint {entry.joint} has no column" in said
            missing.append(entry.joint)
            continue
        tau, v = table[name], recording.v[:, entry.joint - 1]
        np.testing.assert_allclose(tau, entry.estimate * v, rtol=1e-12)
        for bound, sign in (("high", 1.0), ("low", -1.0)):
            off = sign * (table[f"{name}_{bound}"] - tau)
            np.testing.assert_allclose(off, 2.0 * entry.std * np.abs(v), atol=1e-9)
    assert [each["joint"] for each in document["missing"]] == missing
    assert [each["joint"] for each in document["torques"]] == [x.joint for x in gains.gains if x.identifiable]
    assert document["samples"] == len(recording.t)
    # No Parquet under a name that announces text.
    assert "expected a file name that ends with .parquet" in refused(capsys, [*words, str(out.with_suffix(".csv"))])


def test_the_largest_current_of_any_recording_of_the_gains_counts_whatever_its_sign(weighed_cell):
    given = read_gains(weighed_cell / "gains.toml")
    for each in given.recordings:
        (log,) = weighed_cell.rglob(each.name)
        np.testing.assert_allclose(each.largest, np.abs(read_recording(log).v).max(axis=0), rtol=1e-12)
    one, other = given.recordings
    changed = (one.model_copy(update={"largest": (3.0, 2.0)}), other.model_copy(update={"largest": (1.0, 7.0)}))
    file = given.model_copy(update={"recordings": changed, "gains": given.gains[:2]})

    def log(*largest: float) -> Recording:
        t = np.arange(5.0)
        return Recording(t, np.outer(t, largest), np.outer([0.2, -1.0, 0.5, 0.9, 0.1], largest), "log")

    check_currents(file, log(94.0, 230.0))  # 31.6 times 3, and 7
    check_currents(file, log(90.0, 230.0))
    with pytest.raises(ScenarioError, match=r"log: v1 reaches 96, but 3 when the gains were identified"):
        check_currents(file, log(96.0, 230.0))


def test_torques_of_a_negative_gain_come_with_a_note(weighed_cell, tmp_path, capsys):
    gains, out = tmp_path / "gains.toml", str(tmp_path / "t.parquet")
    for fourth, joints in ((-9, [4]), (9, [])):
        values = (13, 11, 7, fourth, 12, 8)
        gains.write_text("".join(f"[[gains]]\njoint = {j}\nestimate = {g}\nstd = 0\n" for j, g in enumerate(values, 1)))
        log = str(weighed_cell / "run" / "light.parquet")
        notes = printed(capsys, "torque", ["torque", log, "--gains", str(gains), "--out", out])["notes"]
        assert [note.partition(": ")[0] for note in notes] == [f"joint {j}" for j in joints]


def test_torques_of_joints_in_another_order_than_the_gains_are_refused(weighed_cell, capsys):
    words = ["torque", str(weighed_cell / "run" / "light.parquet"), "--gains", str(weighed_cell / "gains.toml")]
    turned = "joint2,joint1,joint3,joint4,joint5,joint6"
    assert main([*words, "--out", str(weighed_cell / "turned.parquet"), "--joints", turned]) == 2
    assert "joints are given as joint2, joint1" in capsys.readouterr().err
    assert not (weighed_cell / "turned.parquet").exists()
    # Gains written by hand need no names, and then nothing is known of the order.
    text = editable(weighed_cell / "gains.toml")
    (weighed_cell / "nameless.toml").write_text(
        "".join(x for x in text.splitlines(True) if not x.startswith('name = "joint'))
    )
    words[3] = str(weighed_cell / "nameless.toml")
    assert main([*words, "--out", str(weighed_cell / "turned.parquet"), "--joints", turned]) == 0
