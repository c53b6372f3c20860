"""Foreign logs: the same recording from whatever columns, units, signs and zeros, if they are declared or known."""

from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from foreign_logs import DESCRIPTION, ROUNDED, Q, T, V, assert_same, channels, csv, table, unread
from refusals import refused

from ident.recordings.description import MEANINGS, Channels, LogDescription, read_description, spread
from ident.recordings.files import decoded, likely_encoding, read_log, read_recording
from ident.recordings.formats import MOST_COLUMNS, Table, listed
from ident.recordings.layouts import resolved
from ident.recordings.recording import Recording
from ident.support.errors import RecordingError

UNITS = {
    ("t", "s"): 1.0, ("t", "ms"): 1e3, ("t", "us"): 1e6, ("t", "ns"): 1e9,
    ("q", "rad"): 1.0, ("q", "deg"): 180.0 / np.pi, ("q", "rev"): 0.5 / np.pi, ("q", "m"): 1.0, ("q", "mm"): 1e3,
    ("v", "A"): 1.0, ("v", "mA"): 1e3,
}  # fmt: skip
"""How many of a unit are one of ours."""
SIGNALS = {
    ("percent", "%"): 1.0, ("percent", "per mille"): 10.0, ("torque-after-drive", "N m"): 1.0,
    ("torque-after-drive", "mN m"): 1e3, ("torque-after-drive", "Nm"): 1.0, ("torque-after-drive", "N"): 1.0,
}  # fmt: skip


def test_a_log_in_another_unit_is_the_same_recording(tmp_path):
    for (kind, unit), many in UNITS.items():
        values = {"t": T, "q": Q, "v": V}
        values[kind] = values[kind] * many
        path = csv(tmp_path / "log.csv", table(**values))
        assert_same(read_recording(path, channels(kind, unit=(unit,))))
    for (signal, unit), many in SIGNALS.items():
        path = csv(tmp_path / "log.csv", table(v=V * many))
        log = read_log(path, replace(channels("v", unit=(unit,)), signal=signal))
        assert_same(log.recording)
        assert log.notes == (MEANINGS[signal].note,)
        assert log.v == f"{MEANINGS[signal].words} [{MEANINGS[signal].unit}]"


def test_a_declared_unit_of_time_is_doubted_and_dates_are_not(tmp_path):
    path = csv(tmp_path / "log.csv", table(t=1e6 * T))
    unread(r"t advances by 4e\+03 ms a row.*is it in us", path, channels("t", unit=("ms",)))


def test_positions_told_against_those_of_other_joints_are_taken_apart(tmp_path):
    logged = np.rad2deg(Q) + np.column_stack((np.zeros_like(T), np.zeros_like(T), np.rad2deg(Q[:, 1])))
    path = csv(tmp_path / "log.csv", table(q=logged))
    (tmp_path / "log.toml").write_text('[q]\nunit = "deg"\ncoupling = [[3, -2]]\n')
    told = read_description(tmp_path / "log.toml").q
    assert_same(read_recording(path, channels("q", unit=told.unit, coupling=told.coupling)))
    unread("coupling of joints 2 and 4: the log has 3 joints", path, channels("q", unit=("deg",), coupling=((2, 4),)))
    for wrong in ("[3, -2]", "[[3, 3]]", "[[-3, 2]]", "[[3, 0]]", "[[3]]", '"3-2"', "[[3, true]]"):
        (tmp_path / "log.toml").write_text(f"[q]\ncoupling = {wrong}\n")
        refused(RecordingError, r"coupling = .*expected pairs of joints", read_description, tmp_path / "log.toml")


def test_units_signs_and_zeros_are_each_joints_own(tmp_path):
    # position = unit (sign logged + zero)
    logged = np.column_stack((41.0 - Q[:, 0] * 180.0 / np.pi, Q[:, 1] * 1e3 - 250.0, Q[:, 2] - 0.3))
    path = csv(tmp_path / "log.csv", table(q=logged, v=V * [1e3, -1.0, -1e3]))
    description = channels("q", unit=("deg", "mm", "rad"), sign=(-1.0, 1.0, 1.0), zero=(41.0, 250.0, 0.3))
    description = replace(description, v=replace(description.v, unit=("mA", "A", "mA"), sign=(1.0, -1.0, -1.0)))
    assert_same(read_recording(path, description))
    csv(path, table(q=30.0 - Q * 180.0 / np.pi))
    assert_same(read_recording(path, channels("q", unit=("deg",), sign=(-1.0,), zero=(30.0,))))


def test_ticks_are_counts_of_a_turn_of_the_joint(tmp_path):
    counts = np.array([4096.0, 524288.0, 100_000.0])
    path = csv(tmp_path / "log.csv", table(q=Q / (2.0 * np.pi) * counts - [0.0, 1024.0, 0.0]))
    description = channels("q", unit=("ticks",), counts_per_turn=tuple(counts), zero=(0.0, 1024.0, 0.0))
    assert_same(read_recording(path, description))
    mixed = csv(tmp_path / "mixed.csv", table(q=Q / (2.0 * np.pi) * [4096.0, 2.0 * np.pi, 100_000.0]))
    units = {"unit": ("ticks", "rad", "ticks"), "counts_per_turn": (4096.0, 7.0, 100_000.0)}
    assert_same(read_recording(mixed, channels("q", **units)))
    unread(r"log\.csv: positions are in ticks; state counts_per_turn", path, channels("q", unit=("ticks",)))


def test_a_torque_from_current_is_divided_by_its_constants_where_they_are_known(tmp_path):
    constants = np.array([0.113, -9.7, 4.1])
    path = csv(tmp_path / "log.csv", table(v=V * constants))
    description = replace(channels("v", unit=("N m",), constant=tuple(constants)), signal="torque-from-current")
    log = read_log(path, description)
    assert_same(log.recording)
    assert "v is the current" in log.notes[0]
    assert (log.v, log.signal) == ("current, from torque by the specified constants [A]", "current")
    unknown = read_log(path, replace(description, v=replace(description.v, constant=())))
    np.testing.assert_array_equal(unknown.recording.v, V * constants)
    assert unknown.notes == (MEANINGS["torque-from-current"].note,)
    with pytest.raises(RecordingError, match="state the constants it was computed with, in N m/A"):
        read_recording(path, replace(description, v=replace(description.v, constant=None)))
    unread("constants are given for v, but v is not a torque-from-current", path, channels("v", constant=(2.0,)))


UNDECLARED = {
    r"no column is declared for currents: v=NAME\.\..* of --columns, or \[v\]": replace(DESCRIPTION, v=Channels()),
    "no column is declared for positions": replace(DESCRIPTION, q=Channels()),
    "no column is declared for time": replace(DESCRIPTION, t=Channels()),
    "quantity in x, y, z .* --signal .*: current, torque-from-current, ": replace(DESCRIPTION, signal=None),
    "the unit of time is not declared": channels("t", unit=()),
    r"the unit of positions is not declared: q=NAME\.\.\[unit\]": channels("q", unit=()),
    "the unit of currents is not declared": channels("v", unit=()),
    "unit 'N m' of v, current, is unknown; known: A, mA": channels("v", unit=("N m",)),
    "unit 'grad' of q is unknown; .*known: rad, deg, rev": channels("q", unit=("grad",)),
    "2 columns of time are added, each with its own unit": channels("t", columns=("time", "mode")),
    r"3 columns of positions \(a, b, c\), 2 of currents \(x, y\)": channels("v", columns=("x", "y")),
    "column 'b' is declared twice": channels("v", columns=("x", "y", "b")),
    r"no column 'mod'; did you mean 'mode'\?; found x, mode": channels("q", columns=("a", "b", "mod")),
    "sign of q has 2 entries for 3 joints": channels("q", sign=(1.0, -1.0)),
    r"column 'q_\{joint\}': the joints' names are unknown": channels("q", columns=("q_{joint}",)),
    "gravity-compensated: it lacks the weight of the payload": replace(DESCRIPTION, signal="gravity-compensated"),
    "found x, mode, b, .*--columns": LogDescription(),
}


def test_what_is_not_declared_is_asked_for_in_one_line(tmp_path):
    path = csv(tmp_path / "log.csv", table())
    for message, description in UNDECLARED.items():
        assert unread(message, path, description).startswith(f"{path}: ")


OWN = {
    "t,q1": "found t, q1; declare the columns",
    "t,q1,q2,v1": "no column 'v2'; .*found t, q1, q2, v1",
    "t,q1,q3,v1,v3": "no column 'q2'",
    "t,q1,q1,v1": "column 'q1' appears twice",
    "T,q1,v1": "found T, q1, v1; declare the columns",
    "t,q0,v0,q1,v1": "q0, v0: joints are numbered from 1",
    "time_ms,q1,v1": "found time_ms, q1, v1; declare the columns",
    ",".join(f"q{j},v{j}" for j in range(1, 66)) + ",t": "1 to 64 numbers",
    ",".join(["t", "q1", "v1", *map(str, range(MOST_COLUMNS))]): "10003 columns; files of up to 10000 are read",
}


def meant(names: list[str], given: LogDescription | None = None) -> LogDescription:
    return resolved(Table(names, lambda *_: {}), given or LogDescription())[0]


def test_standard_columns_are_complete_and_spelt_so():
    for header, message in OWN.items():
        refused(RecordingError, message, meant, header.split(","))
    names = ["t", "q1", "v1", "Q1", "V", "q01", "q1_ref", "i1", "qd1", "v12345", "time"]
    assert meant(names).names == ("t", "q1", "v1")
    with pytest.raises(RecordingError, match=r"no column 'time_ms'; .*found t, q1, v1"):
        meant(["t", "q1", "v1"], LogDescription(t=Channels(columns=("time_ms",), unit=("ms",))))
    assert len(meant(["t", *(f"{kind}{j}" for kind in "qv" for j in range(1, 65))]).v.columns) == 64
    with pytest.raises(RecordingError, match="quantity in i2, i1 is not declared"):  # not v1, v2, which are currents
        meant(["t", "q1", "q2", "i1", "i2"], LogDescription(v=Channels(columns=("i2", "i1"))))


def test_rows_are_chosen_by_their_value(tmp_path):
    columns = {name: np.concatenate((value, 1.1 * value)) for name, value in table().items()}
    columns |= {"episode_index": np.repeat([4, 7], len(T)), "take": np.tile([1, 2], len(T))}
    path = csv(tmp_path / "log.csv", columns)

    def only(**values: float) -> Recording:
        return read_recording(path, replace(DESCRIPTION, only=tuple(values.items())))

    assert_same(only(episode_index=4.0))
    assert_same(only(episode_index=7.0, take=2.0), 1.1 * T[1::2], 1.1 * Q[1::2], 1.1 * V[1::2])
    for values, message in (
        ({"episode_index": 5.0}, "no row has 'episode_index' = 5; it ranges from 4 to 7"),
        ({"episode": 5.0}, "no column 'episode'; did you mean 'episode_index'"),
    ):
        refused(RecordingError, message, only, **values)
    csv(path, columns | {"take": columns["episode_index"]})
    refused(RecordingError, "no row satisfies all conditions of only", only, episode_index=4.0, take=7.0)


def test_columns_go_by_the_joints_names_and_doubled_names_are_refused(tmp_path):
    path = csv(tmp_path / "log.csv", {"pos_" + name if name in "abc" else name: x for name, x in table().items()})
    description = replace(channels("q", columns=("pos_{joint}",)), joints=("b", "c", "a"))
    np.testing.assert_array_equal(read_recording(path, description).q, Q[:, [1, 2, 0]])
    unread("no column 'pos_d'", path, replace(description, joints=("b", "c", "d")))
    csv(path, table())
    path.write_text(path.read_text().replace("mode", "a", 1))
    unread("column 'a' appears twice", path, DESCRIPTION)


def test_names_of_messages_and_ranges_are_bounded():
    assert listed([str(k) for k in range(8)]) == "0, 1, 2, 3, 4, 5, 6, 7"
    assert listed([str(k) for k in range(9)]) == "0, 1, 2, 3, 4, 5, 6, 7, .."
    assert listed(["x" * 150, "y" * 49]) == "x" * 150 + ", " + "y" * 48 + ", .."
    assert spread("q{3..3}_deg", "here") == ["q3_deg"]
    assert spread("q{9..11}", "here") == ["q9", "q10", "q11"]
    assert len(spread("q{2..65}", "here")) == 64
    for word in ("q{2..66}", "q{3..2}"):
        refused(RecordingError, r"here: 'q\{.*; expected a range of 1 to 64 numbers", spread, word, "here")


def ur_columns(*currents: str) -> dict[str, np.ndarray]:
    q, v = (np.column_stack((x, -0.9 * x[:, ::-1])) for x in (Q, V))
    columns = {"timestamp": T} | {f"target_q_{j}": 1.01 * q[:, j] for j in range(6)}
    columns |= {f"actual_q_{j}": q[:, j] for j in range(6)}
    return columns | {f"{kind}_{j}": (1.0 + k) * v[:, j] for k, kind in enumerate(currents) for j in range(6)}


@pytest.mark.parametrize("separator", [" ", ","])
def test_a_log_of_universal_robots_is_known_by_its_columns(tmp_path, separator):
    columns = ur_columns("target_current", "actual_current")
    path = csv(tmp_path / "log.csv", columns, separator)
    log = read_log(path)
    for joint in range(6):
        np.testing.assert_array_equal(log.recording.q[:, joint], columns[f"actual_q_{joint}"])
        np.testing.assert_array_equal(log.recording.v[:, joint], columns[f"actual_current_{joint}"])
    assert (log.layout, log.signal) == ("ur-rtde", "current")
    assert log.notes == ("v is actual_current_0 .. [A], as measured; --layout ur-rtde-target selects target_current",)
    log = read_log(path, LogDescription(layout="ur-rtde-target"))
    np.testing.assert_array_equal(log.recording.v[:, 5], columns["target_current_5"])
    assert "as commanded" in log.notes[0]


def test_declarations_replace_what_is_known_of_a_layout(tmp_path):
    columns = ur_columns("actual_current")
    path = csv(tmp_path / "log.csv", columns, " ")
    plain = read_recording(path)
    turned = read_recording(path, LogDescription(q=Channels(sign=(1.0, -1.0, 1.0, 1.0, -1.0, 1.0), zero=(0.4,))))
    np.testing.assert_allclose(turned.q, plain.q * [1, -1, 1, 1, -1, 1] + 0.4, **ROUNDED)
    other = LogDescription(v=Channels(columns=tuple(f"target_q_{j}" for j in range(6)), unit=("A",)))
    unread(r"quantity in target_q_0, target_q_1, target_q_2, .. is not declared", path, other)
    with pytest.raises(RecordingError, match="the unit of currents is not declared"):
        read_recording(path, LogDescription(signal="current", v=Channels(columns=other.v.columns)))
    log = read_log(path, replace(other, signal="current"))
    np.testing.assert_array_equal(log.recording.v[:, 4], columns["target_q_4"])
    assert not log.notes
    unread("not of the layout ur-rtde-target; found timestamp", path, LogDescription(layout="ur-rtde-target"))
    ms = 1_710_000_000_000 + 4 * np.arange(len(T))
    pq.write_table(pa.table(columns | {"timestamp": pa.array(ms, pa.timestamp("ms"))}), tmp_path / "log.parquet")
    found = read_recording(tmp_path / "log.parquet", LogDescription(t=Channels(unit=("iso",))))
    np.testing.assert_allclose(found.t, ms / 1000, rtol=0.0, atol=3e-7)  # float64 has 2.4e-7 s in 2024


MILLI = np.rint(1e3 * V)
"""Currents as numbers of a register [mA]; a sign and ten bits do not hold the third, of up to 2100."""


def registers(sign_bit: int, bits: int) -> np.ndarray:
    return np.where(MILLI < 0.0, 2.0**sign_bit - MILLI if sign_bit else 2.0**bits + MILLI, MILLI)


@pytest.mark.parametrize(("sign_bit", "bits"), [(12, 0), (15, 0), (0, 16), (0, 32)])
def test_a_register_logged_as_read_is_refused_with_the_key_that_decodes_it(tmp_path, sign_bit, bits):
    path = csv(tmp_path / "log.csv", table(v=registers(sign_bit, bits)))
    stated = channels("v", unit=("mA",))
    key = f"sign_bit = {sign_bit}" if sign_bit else f"bits = {bits}"
    unread(rf"column '[xyz]' jumps .* add --state 'v\.{key}'", path, stated)
    (tmp_path / "log.toml").write_text(f"[v]\n{key}\n")
    told = read_description(tmp_path / "log.toml").v
    right = replace(stated, v=replace(stated.v, sign_bit=told.sign_bit, bits=told.bits))
    assert_same(read_recording(path, right), v=1e-3 * MILLI)
    of_q = channels("q", columns=("x", "y", "z"), unit=("mm",), sign_bit=told.sign_bit, bits=told.bits)
    of_q = replace(of_q, v=replace(of_q.v, columns=("a", "b", "c")))
    assert_same(read_recording(path, of_q), q=1e-3 * MILLI, v=Q)


def test_noise_about_zero_hides_no_sign_and_columns_that_reach_a_power_of_two_have_none(rng):
    slow = np.rint(300.0 * np.sin(np.arange(4000) / 700.0) + rng.normal(0.0, 60.0, 4000))
    assert likely_encoding(np.where(slow < 0.0, 1024.0 - slow, slow)) == "sign_bit = 10"
    for offset in (1023.0, 1500.0, 32_768.0, 65_400.0):
        assert likely_encoding(slow + offset) == ""
    assert likely_encoding(slow) == likely_encoding(np.abs(slow)) == likely_encoding(slow + 1024.5) == ""
    assert DESCRIPTION.v.sign_bit == ()
    for key, register in {
        "bits": np.where(slow < 0.0, 65_536.0 + slow, slow),
        "sign_bit": np.where(slow < 0.0, 1024.0 - slow, slow),
    }.items():
        logged = np.round(2.69 * register, 2)  # in mA
        value = {"bits": 16, "sign_bit": 10}[key]
        assert likely_encoding(logged) == f"{key} = {value}"
        np.testing.assert_allclose(decoded(logged, **{key: value}), 2.69 * slow, rtol=0.0, atol=1e-9)
        assert likely_encoding(logged + rng.normal(0.0, 0.1, 4000)) == ""


def test_an_encoder_that_passes_the_end_of_its_turn_is_no_register(tmp_path):
    for turn in (4096, 65_536):
        ticks = np.column_stack([np.rint(turn * each) % turn for each in (0.07 * np.sin(9.0 * T), 0.2 * T, -0.11 * T)])
        assert (np.abs(np.diff(ticks, axis=0)) > 0.9 * turn).any()
        path = csv(tmp_path / "log.csv", table(q=ticks))
        log = read_log(path, channels("q", unit=("ticks",), counts_per_turn=(float(turn),)), check=None)
        np.testing.assert_allclose(log.recording.q, 2.0 * np.pi * ticks / turn, rtol=1e-12)
    assert likely_encoding(np.array([4093.0, 4094.0, 4095.0, 0.0, 3.0])) == ""  # no sign in bit 11
