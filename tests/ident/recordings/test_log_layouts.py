"""Foreign logs whose columns are known, and our own columns in other units."""

from dataclasses import replace

import numpy as np
import pytest
from foreign_logs import DESCRIPTION, ROUNDED, Q, T, V, assert_same, csv, table

from ident.recordings.description import Channels, LogDescription
from ident.recordings.files import read_log, read_recording, write_recording
from ident.recordings.recording import Recording
from ident.support.errors import RecordingError


def ur_columns(current: tuple[str, ...]) -> dict[str, np.ndarray]:
    q, v = (np.column_stack((x, -0.9 * x[:, ::-1])) for x in (Q, V))
    columns = {"timestamp": T} | {f"target_q_{j}": 1.01 * q[:, j] for j in range(6)}
    columns |= {f"actual_q_{j}": q[:, j] for j in range(6)}
    return columns | {f"{kind}_{j}": (1.0 + k) * v[:, j] for k, kind in enumerate(current) for j in range(6)}


@pytest.mark.parametrize("separator", [" ", ","])
def test_a_log_of_universal_robots_is_known_by_its_columns(tmp_path, separator):
    columns = ur_columns(("target_current", "actual_current"))
    path = csv(tmp_path / "log.csv", columns, separator)
    log = read_log(path, LogDescription())
    for joint in range(6):
        np.testing.assert_array_equal(log.recording.q[:, joint], columns[f"actual_q_{joint}"])
        np.testing.assert_array_equal(log.recording.v[:, joint], columns[f"actual_current_{joint}"])
    assert log.read.layout == "ur-rtde"
    assert "v is actual_current_0 .. [A], as measured; --layout ur-rtde-target selects target_current" in log.read.notes
    log = read_log(path, LogDescription(layout="ur-rtde-target"))
    for joint in range(6):
        np.testing.assert_array_equal(log.recording.v[:, joint], columns[f"target_current_{joint}"])
    assert log.read.notes == ("v is target_current_0 .. [A], as commanded by the controller",)


def test_what_is_said_of_a_known_layout_replaces_what_is_known_of_it(tmp_path):
    columns = ur_columns(("actual_current",))
    path = csv(tmp_path / "log.csv", columns, " ")
    plain = read_recording(path)
    turned = read_recording(path, LogDescription(q=Channels(sign=(1.0, -1.0, 1.0, 1.0, -1.0, 1.0), zero=(0.4,))))
    np.testing.assert_allclose(turned.q, plain.q * [1, -1, 1, 1, -1, 1] + 0.4, **ROUNDED)
    other = LogDescription(v=Channels(columns=tuple(f"target_q_{j}" for j in range(6)), unit=("A",)))
    with pytest.raises(RecordingError, match=r"quantity in target_q_0, target_q_1, target_q_2, .. is not declared"):
        read_recording(path, other)
    with pytest.raises(RecordingError, match="the unit of currents is not declared"):
        read_recording(path, LogDescription(signal="current", v=Channels(columns=other.v.columns)))
    log = read_log(path, replace(other, signal="current"))
    np.testing.assert_array_equal(log.recording.v[:, 4], columns["target_q_4"])
    assert not any("actual_current" in note for note in log.read.notes)
    with pytest.raises(RecordingError, match="not of the layout ur-rtde-target; found timestamp"):
        read_recording(path, LogDescription(layout="ur-rtde-target"))


def test_our_own_columns_may_be_in_other_units_and_need_no_word_on_v(tmp_path):
    path = tmp_path / "log.csv"
    write_recording(Recording(T, np.rad2deg(Q), 1e3 * V), path)
    assert_same(read_recording(path, LogDescription(q=Channels(unit=("deg",)))), v=1e3 * V)
    description = LogDescription(signal="current", q=Channels(unit=("deg",)), v=Channels(unit=("mA",)))
    assert_same(read_recording(path, description))
    with pytest.raises(RecordingError, match="the unit of currents is not declared"):
        read_recording(path, replace(description, v=Channels()))


def test_some_columns_may_be_ours_and_others_not(tmp_path):
    columns = {"t": T} | {f"q{j + 1}": Q[:, j] for j in range(3)} | {name: table()[name] for name in "xyz"}
    path = csv(tmp_path / "log.csv", columns)
    assert_same(read_recording(path, LogDescription(signal="current", v=DESCRIPTION.v)))
    with pytest.raises(RecordingError, match=r"columns v1, v2, .. are missing"):
        read_recording(path)
    csv(path, {"t" if name == "time" else name: value for name, value in table().items()})
    assert_same(read_recording(path, replace(DESCRIPTION, t=Channels())))
