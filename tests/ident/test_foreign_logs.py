"""Foreign logs: the same recording from whatever columns, units, signs and zeros, if they are said."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from ident.errors import RecordingError
from ident.logs.column_words import described
from ident.logs.description import Channels, LogDescription
from ident.logs.meaning import MEANINGS
from ident.logs.notes import signal_of
from ident.logs.text_layout import TextLayout
from ident.recording import Recording
from ident.recording_files import read_log, read_recording, write_recording

T = 3.7 + 0.004 * np.arange(90)
Q = np.column_stack((np.sin(3.0 * T), -0.7 * np.cos(2.0 * T), 0.3 * np.sin(5.0 * T + 0.4)))
V = np.column_stack((1.3 * np.cos(5.0 * T), np.sin(4.0 * T) + 0.2, -2.1 * np.cos(3.0 * T)))
ROUNDED = {"rtol": 1e-14, "atol": 1e-14}  # a product and a sum of float64 each way
SAID = LogDescription(
    signal="current",
    t=Channels(columns=("time",), unit=("s",)),
    q=Channels(columns=("a", "b", "c"), unit=("rad",)),
    v=Channels(columns=("x", "y", "z"), unit=("A",)),
)


def table(t: np.ndarray = T, q: np.ndarray = Q, v: np.ndarray = V) -> dict[str, np.ndarray]:
    """Columns of a foreign log, in an order of their own."""
    return {"x": v[:, 0], "mode": 7.0 + 0.0 * T, "b": q[:, 1], "y": v[:, 1], "time": t, "c": q[:, 2], "a": q[:, 0]} | {
        "z": v[:, 2]
    }


def csv(path: Path, columns: dict[str, np.ndarray], separator: str = ",", header: bool = True) -> Path:
    rows = np.column_stack(list(columns.values()))
    head = separator.join(columns) if header else ""
    np.savetxt(path, rows, fmt="%.17g", delimiter=separator, header=head, comments="")
    if not header:
        path.write_text(path.read_text().lstrip("\n"))
    return path


def channels(kind: str, **changes: tuple) -> LogDescription:
    return replace(SAID, **{kind: replace(getattr(SAID, kind), **changes)})


def assert_same(found: Recording, t: np.ndarray = T, q: np.ndarray = Q, v: np.ndarray = V) -> None:
    for one, other in ((found.t, t), (found.q, q), (found.v, v)):
        np.testing.assert_allclose(one, other, **ROUNDED)


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
}  # fmt: skip


@pytest.mark.parametrize(("signal", "unit"), SIGNALS)
def test_v_keeps_its_unit_and_what_it_is_is_told(tmp_path, signal, unit):
    path = csv(tmp_path / "log.csv", table(v=V * SIGNALS[signal, unit]))
    log = read_log(path, replace(channels("v", unit=(unit,)), signal=signal))
    assert_same(log.recording)
    assert log.notes == (MEANINGS[signal].note,)
    assert signal_of(log.read) == f"{MEANINGS[signal].words} [{MEANINGS[signal].unit}]"


def test_units_signs_and_zeros_are_each_joints_own(tmp_path):
    logged = np.column_stack((-(Q[:, 0] * 180.0 / np.pi - 41.0), Q[:, 1] * 1e3 - 250.0, Q[:, 2] - 0.3))
    path = csv(tmp_path / "log.csv", table(q=logged, v=V * [1e3, -1.0, -1e3]))
    said = channels("q", unit=("deg", "mm", "rad"), sign=(-1.0, 1.0, 1.0), zero=(41.0, 250.0, 0.3))
    said = replace(said, v=replace(said.v, unit=("mA", "A", "mA"), sign=(1.0, -1.0, -1.0)))
    assert_same(read_recording(path, said))


def test_a_zero_is_added_behind_the_sign_and_before_the_unit(tmp_path):
    # position = unit (sign logged + zero): a motor encoder that counts backwards from where the arm is at 30 degrees.
    path = csv(tmp_path / "log.csv", table(q=30.0 - Q * 180.0 / np.pi))
    assert_same(read_recording(path, channels("q", unit=("deg",), sign=(-1.0,), zero=(30.0,))))


def test_ticks_are_counts_of_a_turn_of_the_joint(tmp_path):
    counts = np.array([4096.0, 524288.0, 100_000.0])
    path = csv(tmp_path / "log.csv", table(q=Q / (2.0 * np.pi) * counts - [0.0, 1024.0, 0.0]))
    said = channels("q", unit=("ticks",), counts_per_turn=tuple(counts), zero=(0.0, 1024.0, 0.0))
    assert_same(read_recording(path, said))
    with pytest.raises(RecordingError, match=r"log\.csv: positions are in ticks; say counts_per_turn of \[q\]"):
        read_recording(path, channels("q", unit=("ticks",)))


def test_a_torque_from_current_is_divided_by_its_constants_where_they_are_known(tmp_path):
    constants = np.array([0.113, -9.7, 4.1])
    path = csv(tmp_path / "log.csv", table(v=V * constants))
    said = replace(channels("v", unit=("N m",), constant=tuple(constants)), signal="torque-from-current")
    log = read_log(path, said)
    assert_same(log.recording)
    assert "v is current again" in log.notes[0]
    assert signal_of(log.read) == "current, from torque by the constants stated [A]"
    unknown = read_log(path, replace(said, v=replace(said.v, constant=())))
    np.testing.assert_array_equal(unknown.recording.v, V * constants)
    assert "a gain is what its constant has to be multiplied by" in unknown.notes[0]
    with pytest.raises(RecordingError, match=r"say the constants it was computed with, N m/A"):
        read_recording(path, replace(said, v=replace(said.v, constant=None)))
    with pytest.raises(RecordingError, match="constants are said of v, but v is no torque-from-current"):
        read_recording(path, channels("v", constant=(2.0,)))


def test_a_log_that_is_said_to_be_gravity_compensated_is_refused_with_the_reason(tmp_path):
    path = csv(tmp_path / "log.csv", table())
    with pytest.raises(RecordingError, match=r"gravity-compensated: the weight of the payload, .*, is missing in it"):
        read_recording(path, replace(SAID, signal="gravity-compensated"))


def test_rows_are_chosen_by_their_value(tmp_path):
    columns = {name: np.concatenate((value, 1.1 * value)) for name, value in table().items()}
    columns |= {"episode_index": np.repeat([4, 7], len(T)), "take": np.tile([1, 2], len(T))}
    path = csv(tmp_path / "log.csv", columns)
    assert_same(read_recording(path, replace(SAID, only=(("episode_index", 4.0),))))
    both = read_recording(path, replace(SAID, only=(("episode_index", 7.0), ("take", 2.0))))
    assert_same(both, 1.1 * T[1::2], 1.1 * Q[1::2], 1.1 * V[1::2])
    with pytest.raises(RecordingError, match="no row has 'episode_index' = 5; it goes from 4 to 7"):
        read_recording(path, replace(SAID, only=(("episode_index", 5.0),)))
    with pytest.raises(RecordingError, match="no column 'episode'; did you mean 'episode_index'"):
        read_recording(path, replace(SAID, only=(("episode", 5.0),)))
    columns["take"] = columns["episode_index"]
    csv(path, columns)
    with pytest.raises(RecordingError, match="no row has all that only"):
        read_recording(path, replace(SAID, only=(("episode_index", 4.0), ("take", 7.0))))


DATES = {
    "T": "2031-07-19T09:41:07.125000",
    "a space": "2031-07-19 09:41:07.125000",
    "UTC": "2031-07-19T09:41:07.125000Z",
    "an offset": "2031-07-19T11:41:07.125000+02:00",
    "nanoseconds": "2031-07-19T09:41:07.125000000",
}


@pytest.mark.parametrize("form", DATES)
@pytest.mark.parametrize("separator", [",", ";"])
def test_dates_are_seconds_since_1970(tmp_path, form, separator):
    start = datetime(2031, 7, 19, 9, 41, 7, 125000, tzinfo=UTC)
    head, microseconds = DATES[form].split(".")[0], DATES[form].split(".")[1].lstrip("0123456789")
    more = "000" if form == "nanoseconds" else ""
    lines = [separator.join(("time", "a", "x"))]
    for k in range(len(T)):
        text = head + f".{125000 + 4000 * k:06d}" + more + microseconds
        lines.append(separator.join((text, repr(float(Q[k, 0])), repr(float(V[k, 0])))))
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines))
    said = LogDescription(
        signal="current",
        t=Channels(columns=("time",), unit=("iso",)),
        q=Channels(columns=("a",), unit=("rad",)),
        v=Channels(columns=("x",), unit=("A",)),
    )
    found = read_recording(path, said).t
    expected = [(start + timedelta(microseconds=4000 * k)).timestamp() for k in range(len(T))]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=5e-7)  # float64 has 2.4e-7 s in 2031
    path.write_text("\n".join(lines).replace(f"{137000:06d}", "x", 1))
    with pytest.raises(RecordingError, match=r"line 5, column time: '2031-07-19.*' is no date; expected 2031-07-19T09"):
        read_recording(path, said)


def test_dates_with_decimal_commas_and_of_our_own_column_are_read(tmp_path):
    path = tmp_path / "log.csv"
    rows = "".join(f"2031-07-19T09:41:07,{k:03d};{k * k};{1 + k % 3}\n" for k in range(8))
    path.write_text("t;q1;v1\n" + rows)
    found = read_recording(path, LogDescription(t=Channels(unit=("iso",))))
    np.testing.assert_allclose(np.diff(found.t), 1e-3, rtol=0.0, atol=5e-7)  # float64 has 2.4e-7 s in 2031


def test_a_log_without_header_has_columns_by_number(tmp_path):
    order = ["time", "a", "b", "c", "x", "y", "z"]
    said = described(["t=1[s]", "q={2..4}[rad]", "v={5..7}[A]"])
    said = replace(said, signal="current", text=TextLayout(header=0))
    for separator in (",", ";", "\t", " "):
        path = csv(tmp_path / "log.csv", {name: table()[name] for name in order}, separator, header=False)
        assert_same(read_recording(path, said))
    text = path.read_text().replace(".", ",").replace(" ", ";")
    path.write_text(text)
    assert_same(read_recording(path, said))
    with pytest.raises(RecordingError, match=r'line 1 has numbers where .*, or say header = "none"'):
        read_recording(path, SAID)
    with pytest.raises(RecordingError, match="no column '8'"):
        read_recording(path, replace(said, v=replace(said.v, columns=("5", "6", "8"))))


def test_header_and_first_row_may_stand_anywhere(tmp_path):
    path = csv(tmp_path / "log.csv", table())
    header, rows = path.read_text().split("\n", 1)
    path.write_text(f"Scope export\nserial 7\n\n{header}\nA,-,rad,A,s,rad,rad,A\n\n{rows}")
    said = replace(SAID, text=TextLayout(header=4, rows=7))
    assert_same(read_recording(path, said))
    with pytest.raises(RecordingError, match="line 5, column time: 's' is not a number"):
        read_recording(path, replace(SAID, text=TextLayout(header=4)))
    with pytest.raises(RecordingError, match="line 3, said to be the header, is empty"):
        read_recording(path, replace(SAID, text=TextLayout(header=3)))
    with pytest.raises(RecordingError, match="has no line 4444"):
        read_recording(path, replace(SAID, text=TextLayout(header=4444)))
    path.write_text(path.read_text().replace(f"{T[5]:.17g}", "broken", 1))
    with pytest.raises(RecordingError, match="line 12, column time: 'broken' is not a number"):
        read_recording(path, said)


def test_separator_decimal_sign_and_encoding_may_be_said(tmp_path):
    names = {"a": "Gelenk 1, °", "b": "Gelenk 2, °", "c": "Gelenk 3, °"}
    path = csv(tmp_path / "log.csv", {names.get(name, name): value for name, value in table().items()}, "!")
    text = path.read_text().replace(".", ",")
    said = channels("q", columns=tuple(names.values()))
    for encoding in ("cp1252", "utf-16-le", "utf-8"):
        path.write_bytes(text.encode(encoding))
        assert_same(read_recording(path, replace(said, text=TextLayout(separator="!", decimal=",", encoding=encoding))))
    path.write_bytes(b"\xff\xfe" + text.encode("utf-16-le")[:-1])
    with pytest.raises(RecordingError, match="broken UTF-16 at byte"):
        read_recording(path, said)
    path.write_text(text.replace("°", "\xb0"), encoding="latin-1")
    with pytest.raises(RecordingError, match="broken UTF-8 at byte"):
        read_recording(path, replace(said, text=TextLayout(separator="!", encoding="utf-8")))


def test_what_is_said_of_a_text_goes_before_what_it_looks_like(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t;q1;v1\n0;0;4\n" + "".join(f"0,{k:02d};{k * k},5;{k % 3}\n" for k in range(1, 9)))
    found = read_recording(path, LogDescription(text=TextLayout(decimal=",")))
    np.testing.assert_allclose(found.t, 0.01 * np.arange(9), rtol=1e-15)
    assert found.q[4, 0] == 16.5
    path.write_text("".join(f"0,{k:02d} {k},5 {k % 3}\n" for k in range(9)))  # two commas, two spaces
    said = replace(described(["t=1[s]", "q=2[rad]", "v=3[A]"]), signal="current")
    found = read_recording(path, replace(said, text=TextLayout(header=0, separator=" ")))
    assert found.q[:, 0].tolist() == [k + 0.5 for k in range(9)]


def test_names_in_quotes_may_hold_the_separator(tmp_path):
    path = csv(tmp_path / "log.csv", table())
    path.write_text(path.read_text().replace("a,z", '"a, left",z', 1))
    assert_same(read_recording(path, channels("q", columns=("a, left", "b", "c"))))


def test_names_with_spaces_do_not_make_spaces_the_separator(tmp_path):
    names = {"a": "axis 1 angle", "b": "axis 2 angle", "c": "axis 3 angle"}
    path = csv(tmp_path / "log.csv", {names.get(name, name): value for name, value in table().items()}, ";")
    assert_same(read_recording(path, channels("q", columns=tuple(names.values()))))


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
    assert "v is actual_current_0 .. [A], as measured; --layout ur-rtde-target takes target_current" in log.notes
    log = read_log(path, LogDescription(layout="ur-rtde-target"))
    for joint in range(6):
        np.testing.assert_array_equal(log.recording.v[:, joint], columns[f"target_current_{joint}"])
    assert log.notes == ("v is target_current_0 .. [A], as the controller asked for",)


def test_what_is_said_of_a_known_layout_replaces_what_is_known_of_it(tmp_path):
    columns = ur_columns(("actual_current",))
    path = csv(tmp_path / "log.csv", columns, " ")
    plain = read_recording(path)
    turned = read_recording(path, LogDescription(q=Channels(sign=(1.0, -1.0, 1.0, 1.0, -1.0, 1.0), zero=(0.4,))))
    np.testing.assert_allclose(turned.q, plain.q * [1, -1, 1, 1, -1, 1] + 0.4, **ROUNDED)
    other = LogDescription(v=Channels(columns=tuple(f"target_q_{j}" for j in range(6)), unit=("A",)))
    with pytest.raises(RecordingError, match=r"what target_q_0, target_q_1, target_q_2, .. is has to be said"):
        read_recording(path, other)
    with pytest.raises(RecordingError, match="the unit of currents is not said"):
        read_recording(path, LogDescription(signal="current", v=Channels(columns=other.v.columns)))
    log = read_log(path, replace(other, signal="current"))
    np.testing.assert_array_equal(log.recording.v[:, 4], columns["target_q_4"])
    assert not any("actual_current" in note for note in log.notes)
    with pytest.raises(RecordingError, match="not of the layout ur-rtde-target; found timestamp"):
        read_recording(path, LogDescription(layout="ur-rtde-target"))


def test_our_own_columns_may_be_in_other_units_and_need_no_word_on_v(tmp_path):
    path = tmp_path / "log.csv"
    write_recording(Recording(T, np.rad2deg(Q), 1e3 * V), path)
    assert_same(read_recording(path, LogDescription(q=Channels(unit=("deg",)))), v=1e3 * V)
    said = LogDescription(signal="current", q=Channels(unit=("deg",)), v=Channels(unit=("mA",)))
    assert_same(read_recording(path, said))
    with pytest.raises(RecordingError, match="the unit of currents is not said"):
        read_recording(path, replace(said, v=Channels()))


def test_some_columns_may_be_ours_and_others_not(tmp_path):
    columns = {"t": T} | {f"q{j + 1}": Q[:, j] for j in range(3)} | {name: table()[name] for name in "xyz"}
    path = csv(tmp_path / "log.csv", columns)
    assert_same(read_recording(path, LogDescription(signal="current", v=SAID.v)))
    with pytest.raises(RecordingError, match=r"columns v1, v2, .. are missing"):
        read_recording(path)
    csv(path, {"t" if name == "time" else name: value for name, value in table().items()})
    assert_same(read_recording(path, replace(SAID, t=Channels())))


UNSAID = {
    "v": (replace(SAID, v=Channels()), r"which columns currents are is not said: v=NAME\.\. of --columns, or \[v\]"),
    "q": (replace(SAID, q=Channels()), r"which columns positions are is not said"),
    "t": (replace(SAID, t=Channels()), r"which column time is is not said"),
    "signal": (
        replace(SAID, signal=None),
        r"what x, y, z is has to be said, with --signal .*: current, torque-from-current, torque-after-drive, percent",
    ),
    "unit of t": (channels("t", unit=()), r"the unit of time is not said"),
    "unit of q": (channels("q", unit=()), r"the unit of positions is not said: q=NAME\.\.\[unit\]"),
    "unit of v": (channels("v", unit=()), r"the unit of currents is not said"),
    "a strange unit": (channels("v", unit=("N m",)), r"unit 'N m' of v, current, is unknown; there are A, mA"),
    "a strange unit of q": (channels("q", unit=("grad",)), r"unit 'grad' of q is unknown; there are rad, deg, rev"),
    "two times": (channels("t", columns=("time", "mode")), r"time is one column, not 2"),
    "joints": (channels("v", columns=("x", "y")), r"3 columns of positions \(a, b, c\), 2 of currents \(x, y\)"),
    "doubled": (channels("v", columns=("x", "y", "b")), r"column 'b' is said to be two things"),
    "near": (channels("q", columns=("a", "b", "mod")), r"no column 'mod'; did you mean 'mode'\?; found x, mode"),
    "entries": (channels("q", sign=(1.0, -1.0)), r"sign of q has 2 entries for 3 joints"),
    "names": (channels("q", columns=("q_{joint}",)), r"column 'q_\{joint\}': the joints' names are not known"),
}


@pytest.mark.parametrize("name", UNSAID)
def test_what_is_not_said_is_asked_for_in_one_line(tmp_path, name):
    said, message = UNSAID[name]
    path = csv(tmp_path / "log.csv", table())
    with pytest.raises(RecordingError, match=message) as caught:
        read_recording(path, said)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_a_log_of_which_nothing_is_said_shows_what_is_there(tmp_path):
    path = csv(tmp_path / "log.csv", table())
    with pytest.raises(RecordingError, match=r"no column t, q1\.\. or v1\.\.; found x, mode, b, .*--columns"):
        read_recording(path)


def test_columns_go_by_the_joints_names(tmp_path):
    path = csv(tmp_path / "log.csv", {"pos_" + name if name in "abc" else name: x for name, x in table().items()})
    said = replace(channels("q", columns=("pos_{joint}",)), joints=("b", "c", "a"))
    np.testing.assert_array_equal(read_recording(path, said).q, Q[:, [1, 2, 0]])
    with pytest.raises(RecordingError, match="no column 'pos_d'"):
        read_recording(path, replace(said, joints=("b", "c", "d")))


def test_a_doubled_name_is_refused_where_it_is_wanted(tmp_path):
    path = csv(tmp_path / "log.csv", table())
    path.write_text(path.read_text().replace("mode", "a", 1))
    with pytest.raises(RecordingError, match="column 'a' appears twice in the header"):
        read_recording(path, SAID)
    path.write_text(path.read_text().replace("a,z", "mode,z", 1).replace("x,a", "mode,a", 1))
    with pytest.raises(RecordingError, match="no column 'x'"):
        read_recording(path, SAID)


def test_seventeen_times_four_joints_are_too_many(tmp_path):
    many = {"t": T} | {f"{kind}{j}": T * (1.0 + j) for kind in "qv" for j in range(1, 66)}
    path = csv(tmp_path / "log.csv", many)
    with pytest.raises(RecordingError, match="65 joints; recordings of up to 64 are read"):
        read_recording(path)
    for kind in "qv":
        del many[f"{kind}65"]
    assert read_recording(csv(path, many)).n == 64


ROWS = {"list": pa.list_(pa.float32()), "fixed": pa.list_(pa.float64(), 3)}


def lerobot(path: Path, kind: str, episodes: tuple[int, ...] = (3, 5)) -> Path:
    """As LeRobot writes data sets: rows of numbers, times that begin anew with each episode."""
    many = len(episodes)
    columns = {
        "observation.state": pa.array(np.tile(np.rad2deg(Q), (many, 1)).tolist(), ROWS[kind]),
        "observation.effort": pa.array(np.tile(V, (many, 1)).tolist(), ROWS[kind]),
        "timestamp": pa.array(np.tile(T, many).astype(np.float32)),
        "episode_index": pa.array(np.repeat(episodes, len(T))),
        "task": pa.array(["pick"] * many * len(T)),
    }
    pq.write_table(pa.table(columns), path)
    return path


LEROBOT = LogDescription(
    signal="current",
    only=(("episode_index", 5.0),),
    t=Channels(columns=("timestamp",), unit=("s",)),
    q=Channels(columns=("observation.state",), unit=("deg",)),
    v=Channels(columns=("observation.effort",), unit=("A",)),
)


@pytest.mark.parametrize("kind", ROWS)
def test_rows_of_numbers_in_parquet_are_columns_entry_by_entry(tmp_path, kind):
    path = lerobot(tmp_path / "log.parquet", kind)
    log = read_log(path, LEROBOT)
    atol = 4e-7 if kind == "list" else 1e-14  # half the last place of float32 at 4, or of float64
    np.testing.assert_allclose(log.recording.q, Q, rtol=0.0, atol=1e-6 if kind == "list" else 1e-14)
    np.testing.assert_allclose(log.recording.v, V, rtol=0.0, atol=atol)
    assert log.read.description.q.columns == tuple(f"observation.state[{k}]" for k in range(3))
    picked = replace(LEROBOT.v, columns=("observation.effort[2]", "observation.effort[0]", "observation.effort[1]"))
    np.testing.assert_allclose(read_recording(path, replace(LEROBOT, v=picked)).v, V[:, [2, 0, 1]], rtol=0.0, atol=atol)
    with pytest.raises(RecordingError, match="time does not increase at row 91"):
        read_recording(path, replace(LEROBOT, only=()))


def test_rows_of_unequal_length_are_named(tmp_path):
    path = tmp_path / "log.parquet"
    cells = [row[: 3 - (k == 17)] for k, row in enumerate(Q.tolist())]
    pq.write_table(pa.table({"timestamp": T, "observation.state": cells, "observation.effort": V.tolist()}), path)
    said = replace(LEROBOT, only=())
    with pytest.raises(RecordingError, match=r"column observation.state: row 18 has not 3 numbers as the first has"):
        read_recording(path, said)
    pq.write_table(pa.table({"timestamp": T, "observation.state": [None, *cells[1:]]}), path)
    with pytest.raises(RecordingError, match=r"no column 'observation\.state'"):
        read_recording(path, said)


@pytest.mark.parametrize("zone", [None, "UTC", "Europe/Paris"])
def test_dates_in_parquet_are_seconds_since_1970(tmp_path, zone):
    path = tmp_path / "log.parquet"
    ms = 1_710_000_000_000 + 4 * np.arange(len(T))
    columns = {name: pa.array(value) for name, value in table().items()}
    pq.write_table(pa.table(columns | {"time": pa.array(ms, pa.timestamp("ms", zone))}), path)
    found = read_recording(path, channels("t", unit=("iso",)))
    np.testing.assert_allclose(found.t, ms / 1000, rtol=0.0, atol=3e-7)  # float64 has 2.4e-7 s in 2024
    with pytest.raises(RecordingError, match=r'column time is timestamp.*, expected numbers; .*; say unit = "iso"'):
        read_recording(path, SAID)
    pq.write_table(pa.table(columns), path)
    with pytest.raises(RecordingError, match="column time is double, no dates; say s, ms, us or ns"):
        read_recording(path, channels("t", unit=("iso",)))


def test_nanoseconds_since_1970_keep_what_float64_has(tmp_path):
    path = tmp_path / "log.parquet"
    ns = 1_710_000_000_000_000_000 + 4_000_000 * np.arange(len(T))
    pq.write_table(pa.table(table() | {"time": ns}), path)
    found = read_recording(path, channels("t", unit=("ns",)))
    np.testing.assert_allclose(np.diff(found.t), 0.004, rtol=0.0, atol=1e-6)  # twice the spacing of float64 there


ARRAYS = {
    "own.npz": lambda path: np.savez(path, t=T, q=Q, v=V),
    "packed.npz": lambda path: np.savez_compressed(path, t=T, q=Q, v=V, note=np.array("a text")),
}


@pytest.mark.parametrize("name", ARRAYS)
def test_archives_of_arrays_are_read(tmp_path, name):
    ARRAYS[name](tmp_path / name)
    found = read_recording(tmp_path / name)
    for one, other in ((found.t, T), (found.q, Q), (found.v, V)):
        np.testing.assert_array_equal(one, other)


def test_arrays_of_other_names_are_columns_entry_by_entry(tmp_path):
    path = tmp_path / "log.npz"
    np.savez(path, time=T, pos=np.rad2deg(Q), cur=V, more=T[:-1])
    said = replace(described(["t=time[s]", "q=pos[deg]", "v=cur[0],cur[1],cur[2][A]"]), signal="current")
    assert_same(read_recording(path, said))
    with pytest.raises(RecordingError, match=r"columns of different lengths: more: 89, pos\[0\]: 90"):
        read_recording(path, replace(said, t=Channels(columns=("more",), unit=("s",))))


def test_an_archive_that_unpacks_to_too_much_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "log.npz"
    np.savez_compressed(path, t=T, q=Q, v=V, zeros=np.zeros(100_000))
    monkeypatch.setattr("ident.logs.arrays.LARGEST", 700_000)
    with pytest.raises(RecordingError, match=r"log\.npz: 0\.8.* MB unpacked; take a part of it"):
        read_recording(path)
    monkeypatch.setattr("ident.logs.arrays.LARGEST", 900_000)
    assert_same(read_recording(path))


def test_one_array_is_rows_or_named_fields(tmp_path):
    path = tmp_path / "log.npy"
    np.save(path, np.column_stack((T, Q, V)))
    said = replace(described(["t=1[s]", "q={2..4}[rad]", "v={5..7}[A]"]), signal="current")
    assert_same(read_recording(path, said))
    with pytest.raises(RecordingError, match="found 1, 2, 3, 4, 5, 6, 7; say which columns"):
        read_recording(path)
    fields = np.zeros(len(T), dtype=[("t", "f4"), ("q1", "f8"), ("v1", "i4"), ("stamp", "M8[ms]"), ("word", "U3")])
    fields["t"], fields["q1"], fields["v1"] = np.arange(len(T)) / 64.0, Q[:, 0], np.round(100.0 * V[:, 0])
    fields["stamp"] = np.datetime64("2031-07-19T09:41:07.125") + 4 * np.arange(len(T))
    np.save(path, fields)
    found = read_recording(path)
    np.testing.assert_array_equal(found.t, np.arange(len(T)) / 64.0)
    np.testing.assert_array_equal(found.v[:, 0], np.round(100.0 * V[:, 0]))
    dated = read_recording(path, LogDescription(t=Channels(columns=("stamp",), unit=("iso",))))
    start = datetime(2031, 7, 19, 9, 41, 7, 125000, tzinfo=UTC).timestamp()
    np.testing.assert_allclose(dated.t, start + 0.004 * np.arange(len(T)), rtol=0.0, atol=5e-7)  # float64 in 2031
    with pytest.raises(RecordingError, match="'word' is <U3, expected numbers"):
        read_recording(path, LogDescription(t=Channels(columns=("word",), unit=("s",))))
    with pytest.raises(RecordingError, match="'t' is float32, expected datetime64"):
        read_recording(path, LogDescription(t=Channels(columns=("t",), unit=("iso",))))


def test_what_v_is_is_written_beside_it(tmp_path):
    recording = Recording(T, Q, V)
    write_recording(recording, tmp_path / "log.csv", signal="current [A]")
    assert (tmp_path / "log.csv").read_text().startswith("# v: current [A]\nt,q1,")
    write_recording(recording, tmp_path / "log.parquet", signal="current [A]")
    assert pq.read_schema(tmp_path / "log.parquet").metadata[b"v"] == b"current [A]"
    for name in ("log.csv", "log.parquet"):
        assert_same(read_recording(tmp_path / name))
