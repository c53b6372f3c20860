"""Foreign logs: the same recording from whatever columns, units, signs and zeros, if they are said."""

from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest
from foreign_logs import DESCRIPTION, Q, T, V, assert_same, channels, csv, table

from ident.recordings.description import MEANINGS
from ident.recordings.files import read_log, read_recording, write_recording
from ident.recordings.recording import Recording
from ident.support.errors import RecordingError

UNITS = {
    ("t", "s"): 1.0, ("t", "ms"): 1e3, ("t", "us"): 1e6, ("t", "ns"): 1e9,
    ("q", "rad"): 1.0, ("q", "deg"): 180.0 / np.pi, ("q", "rev"): 0.5 / np.pi, ("q", "m"): 1.0, ("q", "mm"): 1e3,
    ("v", "A"): 1.0, ("v", "mA"): 1e3,
}  # fmt: skip
"""How many of a unit are one of ours."""


@pytest.mark.parametrize(("kind", "unit"), UNITS)
def test_a_log_in_another_unit_is_the_same_recording(tmp_path, kind, unit):
    values = {"t": T, "q": Q, "v": V}
    values[kind] = values[kind] * UNITS[kind, unit]
    path = csv(tmp_path / "log.csv", table(**values))
    assert_same(read_recording(path, channels(kind, unit=(unit,))))


SIGNALS = {
    ("percent", "%"): 1.0, ("percent", "per mille"): 10.0,
    ("torque-after-drive", "N m"): 1.0, ("torque-after-drive", "mN m"): 1e3, ("torque-after-drive", "Nm"): 1.0,
    ("torque-after-drive", "N"): 1.0,
}  # fmt: skip


@pytest.mark.parametrize(("signal", "unit"), SIGNALS)
def test_v_keeps_its_unit_and_what_it_is_is_told(tmp_path, signal, unit):
    path = csv(tmp_path / "log.csv", table(v=V * SIGNALS[signal, unit]))
    log = read_log(path, replace(channels("v", unit=(unit,)), signal=signal))
    assert_same(log.recording)
    assert log.read.notes == (MEANINGS[signal].note,)
    assert log.read.v == f"{MEANINGS[signal].words} [{MEANINGS[signal].unit}]"


def test_units_signs_and_zeros_are_each_joints_own(tmp_path):
    logged = np.column_stack((-(Q[:, 0] * 180.0 / np.pi - 41.0), Q[:, 1] * 1e3 - 250.0, Q[:, 2] - 0.3))
    path = csv(tmp_path / "log.csv", table(q=logged, v=V * [1e3, -1.0, -1e3]))
    description = channels("q", unit=("deg", "mm", "rad"), sign=(-1.0, 1.0, 1.0), zero=(41.0, 250.0, 0.3))
    description = replace(description, v=replace(description.v, unit=("mA", "A", "mA"), sign=(1.0, -1.0, -1.0)))
    assert_same(read_recording(path, description))


def test_a_zero_is_added_behind_the_sign_and_before_the_unit(tmp_path):
    # position = unit (sign logged + zero): a motor encoder that counts backwards from where the arm is at 30 degrees.
    path = csv(tmp_path / "log.csv", table(q=30.0 - Q * 180.0 / np.pi))
    assert_same(read_recording(path, channels("q", unit=("deg",), sign=(-1.0,), zero=(30.0,))))


def test_ticks_are_counts_of_a_turn_of_the_joint(tmp_path):
    counts = np.array([4096.0, 524288.0, 100_000.0])
    path = csv(tmp_path / "log.csv", table(q=Q / (2.0 * np.pi) * counts - [0.0, 1024.0, 0.0]))
    description = channels("q", unit=("ticks",), counts_per_turn=tuple(counts), zero=(0.0, 1024.0, 0.0))
    assert_same(read_recording(path, description))
    with pytest.raises(
        RecordingError, match=r"log\.csv: positions are in ticks; state counts_per_turn, of the joint, in \[q\]"
    ):
        read_recording(path, channels("q", unit=("ticks",)))


def test_a_torque_from_current_is_divided_by_its_constants_where_they_are_known(tmp_path):
    constants = np.array([0.113, -9.7, 4.1])
    path = csv(tmp_path / "log.csv", table(v=V * constants))
    description = replace(channels("v", unit=("N m",), constant=tuple(constants)), signal="torque-from-current")
    log = read_log(path, description)
    assert_same(log.recording)
    assert "v is the current" in log.read.notes[0]
    assert log.read.v == "current, from torque by the specified constants [A]"
    unknown = read_log(path, replace(description, v=replace(description.v, constant=())))
    np.testing.assert_array_equal(unknown.recording.v, V * constants)
    assert "a gain is the correction factor of its torque constant" in unknown.read.notes[0]
    with pytest.raises(RecordingError, match=r"state the constants it was computed with, in N m/A"):
        read_recording(path, replace(description, v=replace(description.v, constant=None)))
    with pytest.raises(RecordingError, match="constants are given for v, but v is not a torque-from-current"):
        read_recording(path, channels("v", constant=(2.0,)))


def test_a_log_that_is_said_to_be_gravity_compensated_is_refused_with_the_reason(tmp_path):
    path = csv(tmp_path / "log.csv", table())
    with pytest.raises(
        RecordingError,
        match=r"gravity-compensated: it lacks the weight of the payload, from which "
        "gains",
    ):
        read_recording(path, replace(DESCRIPTION, signal="gravity-compensated"))


def test_rows_are_chosen_by_their_value(tmp_path):
    columns = {name: np.concatenate((value, 1.1 * value)) for name, value in table().items()}
    columns |= {"episode_index": np.repeat([4, 7], len(T)), "take": np.tile([1, 2], len(T))}
    path = csv(tmp_path / "log.csv", columns)
    assert_same(read_recording(path, replace(DESCRIPTION, only=(("episode_index", 4.0),))))
    both = read_recording(path, replace(DESCRIPTION, only=(("episode_index", 7.0), ("take", 2.0))))
    assert_same(both, 1.1 * T[1::2], 1.1 * Q[1::2], 1.1 * V[1::2])
    with pytest.raises(RecordingError, match="no row has 'episode_index' = 5; it ranges from 4 to 7"):
        read_recording(path, replace(DESCRIPTION, only=(("episode_index", 5.0),)))
    with pytest.raises(RecordingError, match="no column 'episode'; did you mean 'episode_index'"):
        read_recording(path, replace(DESCRIPTION, only=(("episode", 5.0),)))
    columns["take"] = columns["episode_index"]
    csv(path, columns)
    with pytest.raises(RecordingError, match="no row satisfies all conditions of only"):
        read_recording(path, replace(DESCRIPTION, only=(("episode_index", 4.0), ("take", 7.0))))


def test_what_v_is_is_written_beside_it(tmp_path):
    recording = Recording(T, Q, V)
    write_recording(recording, tmp_path / "log.csv", signal="current [A]")
    assert (tmp_path / "log.csv").read_text().startswith("# v: current [A]\nt,q1,")
    write_recording(recording, tmp_path / "log.parquet", signal="current [A]")
    assert pq.read_schema(tmp_path / "log.parquet").metadata[b"v"] == b"current [A]"
    for name in ("log.csv", "log.parquet"):
        assert_same(read_recording(tmp_path / name))
