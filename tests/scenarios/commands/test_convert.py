import re
from dataclasses import replace
from pathlib import Path

import lerobot_datasets
import numpy as np
import pytest
from bad_files import refused
from bags import Sample, write_bag
from model_files import mjcf
from printed import printed

from ident.recordings.description import Channels, LogDescription, TextLayout, read_description
from ident.recordings.files import read_log, read_recording, write_recording
from ident.recordings.recording import Recording
from ident.support.errors import RecordingError
from scenarios.cli import main
from scenarios.results.written import description_text

JOINTS = ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint")
"""Of the model of `model_files`."""
T = 0.004 * np.arange(400)
Q = 0.8 * np.sin(2.0 * T[:, None] + 0.7 * np.arange(6))
V = 3.0 * np.cos(Q) + 0.1 * Q
DESCRIPTION = """
signal = "current"
[t]
column = "time"
unit = "ms"
[q]
columns = "pos_{1..6}"
unit = ["deg", "deg", "rad", "deg", "deg", "rev"]
sign = [1, -1, 1, 1, -1, 1]
zero = [0, 90, 0, 0, -45, 0.25]
[v]
columns = ["i_1", "i_2", "i_3", "i_4", "i_5", "i_6"]
unit = "mA"
[file]
separator = ";"
decimal = ","
encoding = "latin-1"
"""
SIGN, ZERO = np.array([1, -1, 1, 1, -1, 1]), np.array([0, 90, 0, 0, -45, 0.25])
UNIT = np.array([np.pi / 180, np.pi / 180, 1, np.pi / 180, np.pi / 180, 2 * np.pi])


@pytest.fixture(scope="module")
def cell(tmp_path_factory) -> Path:
    """A folder with one motion as a foreign CSV, a description of it, a bag and a model."""
    folder = tmp_path_factory.mktemp("cell")
    names = ["time", *(f"pos_{j}" for j in range(1, 7)), *(f"i_{j}" for j in range(1, 7))]
    rows = np.column_stack((1e3 * T, SIGN * (Q / UNIT - ZERO), 1e3 * V))
    text = "\n".join([";".join(names), *(";".join(f"{x:.17g}" for x in row) for row in rows.tolist())])
    (folder / "log.csv").write_text(text.replace(".", ","))
    (folder / "log.toml").write_text(DESCRIPTION)
    (folder / "only.toml").write_text("only = { episode_index = 2 }")
    order = [3, 0, 5, 1, 2, 4]
    write_bag(
        folder / "bag",
        (Sample(stamp=float(t), names=[JOINTS[j] for j in order], position=q[order], effort=v[order])
         for t, q, v in zip(T, Q, V, strict=True)),
        storage="mcap",
    )  # fmt: skip
    (folder / "arm.xml").write_text(mjcf())
    write_recording(Recording(T, Q, V), folder / "own.csv")
    q, v = (np.column_stack((x, x[:, 0] + 0.1 * T)) for x in (Q, V))
    write_recording(Recording(T, q, v), folder / "seven.csv")
    return folder


def test_a_foreign_log_is_written_as_a_recording(cell, tmp_path, capsys):
    out = tmp_path / "log.parquet"
    words = ["convert", str(cell / "log.csv"), "--log-description", str(cell / "log.toml"), "--out", str(out), "--json"]
    assert main(words) == 0
    told = printed(capsys, "convert")
    found = read_recording(out)
    for one, other in ((found.t, T), (found.q, Q), (found.v, V)):
        np.testing.assert_allclose(one, other, rtol=1e-14, atol=1e-14)  # a product and a sum of float64 each way
    assert (told["samples"], told["joints"], told["layout"]) == (400, 6, None)
    assert (told["signal"], told["v"]) == ("current", "motor current, measured or commanded [A]")
    assert (told["duration_s"], told["rate_hz"]) == pytest.approx((1.596, 250.0), rel=1e-12)  # 399 intervals of 4 ms
    columns = told["columns"]
    assert (columns["t"], columns["q"][4], columns["v"]) == ("time", "pos_5", [f"i_{j}" for j in range(1, 7)])


def test_a_bags_joints_are_ordered_by_the_model_or_by_name(cell, tmp_path):
    words = ["convert", str(cell / "bag"), "--out", str(tmp_path / "log.parquet"), "--signal", "current"]
    for said in (["--model", str(cell / "arm.xml")], ["--joints", ",".join(JOINTS)]):
        assert main([*words, *said]) == 0
        np.testing.assert_array_equal(read_recording(tmp_path / "log.parquet").q, Q)
    assert main([*words, "--joints", f"{JOINTS[4]},{JOINTS[1]}", "--force"]) == 0
    np.testing.assert_array_equal(read_recording(tmp_path / "log.parquet").v, V[:, [4, 1]])


LOGS = {
    "an unknown ending": (["own.csv", "--out", "log.pq"], r"log\.pq: unknown ending '\.pq' .*\.parquet, \.csv, \.txt"),
    "no signal": (["log.csv", "--columns", "t=time[ms]", "q=pos_{1..6}[deg]", "v=i_{1..6}[mA]"], "is not declared"),
    "a bag without signal": (["bag", "--model", "arm.xml"], r"declared.* --signal .*: current, torque-from"),
    "no constant": (["bag", "--model", "arm.xml", "--signal", "torque-from-current"], "state the constants"),
    "wrong order": (["bag", "--model", "arm.xml", "--joints", ",".join(JOINTS[::-1])], "expected the model's order"),
    "a joint twice": (["bag", "--joints", "a,a"], "expected names, each once, separated by commas"),
    "no word": (["log.csv", "--columns", "time"], r"--columns: 'time'; expected t=NAME\[unit\], q=NAME"),
    "a word twice": (["log.csv", "--columns", "t=a", "t=b"], "--columns: t= is given twice"),
    "no names": (["log.csv", "--columns", "q=a,,b[rad]"], r"--columns: q='a,,b' lacks a name"),
    "said twice": (
        ["log.csv", "--log-description", "log.toml", "--signal", "percent"],
        r"log\.toml says signal, and so does the command line; state it once",
    ),
    "episode of a CSV": (["own.csv", "--episode", "1"], r"own\.csv: no column 'episode_index'; found t"),
    "episode said twice": (
        ["log.csv", "--log-description", "only.toml", "--episode", "1"],
        r"only\.toml says only, and so does the command line; state it once",
    ),
    "seven joints": (["seven.csv", "--model", "arm.xml"], "7 joints, but robot .* to leave out a gripper"),
    "nine names": (["own.csv", "--joints", "a,b,c,d,e,f,g,h,i"], "9 joints are named, but the log has \\d; name"),
    "no dataset": (["absent.lerobot"], r"absent\.lerobot: expected the folder of a LeRobot dataset, with meta"),
}  # fmt: skip


def test_what_cannot_be_meant_is_one_line(cell, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(cell)
    for words, message in LOGS.values():
        out = [] if "--out" in words else ["--out", str(tmp_path / "out.csv")]
        line = refused(capsys, ["convert", words[0], *out, *words[1:]])
        assert re.search(message, line), line
    assert not list(tmp_path.iterdir())


DESCRIPTIONS = {
    "empty": ("", "the file is empty"),
    "a strange key": (DESCRIPTION + "colums = 1", r"unknown key 'colums'"),
    "a strange signal": (DESCRIPTION.replace('"current"', '"curent"'), r"signal = 'curent': expected .*'current'"),
    "zero of v": ("[v]\nzero = 1", r"\[v\]: unknown key 'zero'; known: columns, unit, sign, factor, sign_bit, bits"),
    "a range": ("[q]\ncolumns = 'a{4..2}'", r"\[q\]: 'a\{4\.\.2\}'; expected a range"),
    "zero huge": ("[q]\nzero = [0.0, 1e13]", r"zero = \[0\.0, 10000000000000\.0\]"),
    "no counts": ("[q]\ncounts_per_turn = [4096, 0]", r"counts_per_turn = \[4096, 0\]"),
    "file": ("[file]\nseperator = ';'", r"\[file\]: unknown key 'seperator'; did you mean 'separator'"),
    "decimal as separator": ("[file]\ndecimal = ','\nseparator = ','", r"expected a character other than"),
    "encoding": ("[file]\nencoding = 'utf8000'", r"encoding = 'utf8000'"),
    "rows": ("[file]\nheader = 4\nrows = 4", r"rows = 4: expected a line after that of the header, 4"),
}  # fmt: skip


def test_a_faulty_description_is_one_line(cell, tmp_path, capsys):
    path = tmp_path / "said.toml"
    for content, message in DESCRIPTIONS.values():
        path.write_text(content)
        with pytest.raises(RecordingError, match=message) as caught:
            read_description(path)
        assert str(caught.value).startswith(f"{path}: ")
        assert "\n" not in str(caught.value)
    words = ["convert", str(cell / "log.csv"), "--out", str(tmp_path / "out.csv"), "--log-description", str(path)]
    assert refused(capsys, words).startswith(f"rx90: {path}: ")


def test_all_that_a_description_may_say_is_read(tmp_path):
    (tmp_path / "said.toml").write_text(
        "signal = 'torque-from-current'\nlayout = 'joint-states'\njoints = ['a', 'b']\ntopic = '/x'\n"
        "only = { episode_index = 3, take = 1.5 }\n[t]\ncolumn = 'stamp'\nunit = 'us'\n"
        "[q]\ncolumns = ['p{3..4}']\nunit = 'ticks'\ncounts_per_turn = [4096, -8192]\nsign = -1\nzero = [0.5, 7]\n"
        "[v]\ncolumns = 'x'\nunit = ['N m', 'mN m']\nsign = [1, -1]\nconstant = [0.7, -0.3]\n"
        "[file]\nseparator = '!'\ndecimal = ','\nheader = 3\nrows = 5\nencoding = 'cp1252'\n"
    )
    ticks = {"counts_per_turn": (4096.0, -8192.0), "sign": (-1.0,), "zero": (0.5, 7.0)}
    assert read_description(tmp_path / "said.toml") == LogDescription(
        signal="torque-from-current",
        layout="joint-states",
        joints=("a", "b"),
        topic="/x",
        only=(("episode_index", 3.0), ("take", 1.5)),
        t=Channels(columns=("stamp",), unit=("us",)),
        q=Channels(columns=("p3", "p4"), unit=("ticks",), **ticks),
        v=Channels(columns=("x",), unit=("N m", "mN m"), sign=(1.0, -1.0), constant=(0.7, -0.3)),
        text=TextLayout(separator="!", decimal=",", header=3, rows=5, encoding="cp1252"),
    )
    (tmp_path / "said.toml").write_text("[file]\nheader = 'none'\n[v]\nconstant = 'unknown'\n")
    said = read_description(tmp_path / "said.toml")
    assert (said.text.header, said.v.constant, said.joints) == (0, (), None)


def test_what_is_declared_is_written_as_a_description_of_other_logs_like_it(cell, tmp_path, capsys):
    out, said = tmp_path / "log.parquet", tmp_path / "said.toml"
    words = ["convert", str(cell / "log.csv"), "--out", str(out), "--json", "--log-description", str(cell / "log.toml")]
    words += ["--state", "q.factor = [2, -3, 1, 1, 0.25, 1]", "--state", "q.coupling = [[3, -2], [5, 1]]"]
    assert main([*words, "v.bits = 16", "--description-out", str(said)]) == 0
    assert printed(capsys, "convert")["description"] == str(said)
    again = read_log(cell / "log.csv", read_description(said)).recording
    np.testing.assert_array_equal(
        np.hstack((again.q, again.v)), np.hstack((read_recording(out).q, read_recording(out).v))
    )
    assert not np.allclose(again.q, Q)


def test_a_description_is_written_as_it_is_read(tmp_path):
    told = LogDescription(
        signal="percent", layout="joint-states", joints=("a", 'b"c'), topic="/x", rate_hz=62.5,
        only=(("episode_index", 3.0), ("take 1.2", 1.5)), t=Channels(columns=("sec", "nanosec"), unit=("s", "ns")),
        q=Channels(
            columns=("p", "r"), unit=("ticks",), counts_per_turn=(4096.0, -8192.5), sign=(-1.0,), factor=(0.25, 3.0),
            zero=(0.5, 7.0), coupling=([2, -1], [1, 3]),
        ),
        v=Channels(columns=("x",), unit=("%",), sign_bit=(10.0, 11.0), bits=(16.0,), constant=()),
        text=TextLayout(separator="!", decimal=",", header=0, rows=5, encoding="cp1252", series="joint"),
    )  # fmt: skip
    (tmp_path / "said.toml").write_text(description_text(told))
    assert read_description(tmp_path / "said.toml") == replace(told, only=told.only[1:])  # an episode is of one log


def test_units_of_a_dataset_are_said_in_few_words(tmp_path):
    names = [f"{joint}.{kind}" for kind in ("pos", "current") for joint in lerobot_datasets.JOINTS]
    rows = [np.column_stack(lerobot_datasets.motion(episode)[1:]) for episode in range(3)]
    features = {"observation.state": lerobot_datasets.feature("float32", 6, names)}
    log = lerobot_datasets.write(tmp_path / "set", features, {"observation.state": rows})
    words = ["convert", str(log), "--episode", "2", "--joints", "shoulder_lift,shoulder_pan", "--signal", "current"]
    assert main([*words, "--columns", "q=[deg]", "v=[mA]", "--out", str(tmp_path / "log.parquet")]) == 0
    t, q, v = lerobot_datasets.motion(2)
    found = read_recording(tmp_path / "log.parquet")
    np.testing.assert_array_equal(found.t, t)
    np.testing.assert_array_equal(found.q, q[:, [1, 0]] * (np.pi / 180.0))
    np.testing.assert_array_equal(found.v, v[:, [1, 0]] * 1e-3)


def test_lines_of_the_command_line_complete_a_description_and_their_factors_multiply(cell, tmp_path, capsys):
    words = ["convert", str(cell / "log.csv"), "--out", str(tmp_path / "log.parquet")]
    words += ["--log-description", str(cell / "log.toml"), "--state", "q.factor = [2, -3, 1, 1, 0.25, 1]"]
    lines = ["q.factor = -0.7", "v = { factor = 1.3, sign = [1, 1, -1, 1, 1, 1] }", "t.factor = 1.02"]
    assert main([*words, *lines]) == 0
    found = read_recording(tmp_path / "log.parquet")
    np.testing.assert_allclose(found.t, 1.02 * T, rtol=1e-15)
    np.testing.assert_allclose(found.q, Q * [-1.4, 2.1, -0.7, -0.7, -0.175, -0.7], rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(found.v, V * [1.3, 1.3, -1.3, 1.3, 1.3, 1.3], rtol=1e-14)
    for line, message in {
        "q.zero = 3": r"--state 'q.zero = 3': zero = \[0, 90, .* is stated already; state it once",
        "q.factor = [1, 2]": r"factor = \[2, -3, 1, 1, 0.25, 1\] is stated already",
        "q.factor = 0": r"\[q\]: factor = .*expected a number.*not 0",
        "q.factor": r"--state 'q.factor': not TOML",
    }.items():
        assert re.search(message, refused(capsys, [*words, line])), line


def test_lines_of_the_command_line_complete_declared_columns(tmp_path, capsys):
    rows = np.column_stack((T, Q[:, :2], V[:, :2]))
    np.savetxt(tmp_path / "log.csv", rows, fmt="%.17g", delimiter=",", header="t,q1,q2,v1,v2", comments="")
    words = ["convert", str(tmp_path / "log.csv"), "--out", str(tmp_path / "new.csv"), "--state", "q.factor = [1, 0.4]"]
    assert main([*words, "--columns", "q=q2,q1[deg]"]) == 0
    expected = np.deg2rad(Q[:, [1, 0]]) * [1.0, 0.4]
    np.testing.assert_allclose(read_recording(tmp_path / "new.csv").q, expected, rtol=1e-15)
    assert "--state says q, and so does" in refused(capsys, [*words, "q.unit = 'rad'", "--columns", "q=q2,q1[deg]"])


def test_the_folder_of_a_written_file_is_not_created(cell, tmp_path, capsys):
    words = ["convert", str(cell / "log.csv"), "--log-description", str(cell / "log.toml")]
    line = refused(capsys, [*words, "--out", str(tmp_path / "typo" / "log.parquet")])
    assert line.endswith(f"typo/log.parquet: there is no folder {tmp_path / 'typo'}; create it, or correct the path\n")
    assert not (tmp_path / "typo").exists()
