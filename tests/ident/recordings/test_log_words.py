"""What has to be said of a foreign log: what is not is asked for in one line."""

import re
from dataclasses import replace

import numpy as np
import pytest
from foreign_logs import DESCRIPTION, Q, T, channels, csv, table

from ident.recordings.description import Channels, LogDescription
from ident.recordings.description_files import spread
from ident.recordings.files import read_recording
from ident.recordings.formats.table import listed
from ident.recordings.layouts import resolved
from ident.support.errors import LogDescriptionError, RecordingError

UNSAID = {
    "v": (
        replace(DESCRIPTION, v=Channels()),
        r"no column is declared for currents: v=NAME\.\. of --columns, or \[v\]",
    ),
    "q": (replace(DESCRIPTION, q=Channels()), r"no column is declared for positions"),
    "t": (replace(DESCRIPTION, t=Channels()), r"no column is declared for time"),
    "signal": (
        replace(DESCRIPTION, signal=None),
        r"quantity in x, y, z .* --signal .*: current, torque-from-current, torque-after-drive, percent",
    ),
    "unit of t": (channels("t", unit=()), r"the unit of time is not declared"),
    "unit of q": (channels("q", unit=()), r"the unit of positions is not declared: q=NAME\.\.\[unit\]"),
    "unit of v": (channels("v", unit=()), r"the unit of currents is not declared"),
    "a strange unit": (channels("v", unit=("N m",)), r"unit 'N m' of v, current, is unknown; known: A, mA"),
    "a strange unit of q": (channels("q", unit=("grad",)), r"unit 'grad' of q is unknown; known: rad, deg, rev"),
    "two times": (channels("t", columns=("time", "mode")), r"time is one column, not 2"),
    "joints": (channels("v", columns=("x", "y")), r"3 columns of positions \(a, b, c\), 2 of currents \(x, y\)"),
    "doubled": (channels("v", columns=("x", "y", "b")), r"column 'b' is declared twice"),
    "near": (channels("q", columns=("a", "b", "mod")), r"no column 'mod'; did you mean 'mode'\?; found x, mode"),
    "entries": (channels("q", sign=(1.0, -1.0)), r"sign of q has 2 entries for 3 joints"),
    "names": (channels("q", columns=("q_{joint}",)), r"column 'q_\{joint\}': the joints' names are unknown"),
}


@pytest.mark.parametrize("name", UNSAID)
def test_what_is_not_said_is_asked_for_in_one_line(tmp_path, name):
    description, message = UNSAID[name]
    path = csv(tmp_path / "log.csv", table())
    with pytest.raises(RecordingError, match=message) as caught:
        read_recording(path, description)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_a_log_of_which_nothing_is_said_shows_what_is_there(tmp_path):
    path = csv(tmp_path / "log.csv", table())
    with pytest.raises(RecordingError, match=r"no column t, q1\.\. or v1\.\.; found x, mode, b, .*--columns"):
        read_recording(path)


def test_columns_go_by_the_joints_names(tmp_path):
    path = csv(tmp_path / "log.csv", {"pos_" + name if name in "abc" else name: x for name, x in table().items()})
    description = replace(channels("q", columns=("pos_{joint}",)), joints=("b", "c", "a"))
    np.testing.assert_array_equal(read_recording(path, description).q, Q[:, [1, 2, 0]])
    with pytest.raises(RecordingError, match="no column 'pos_d'"):
        read_recording(path, replace(description, joints=("b", "c", "d")))


def test_a_doubled_name_is_refused_where_it_is_wanted(tmp_path):
    path = csv(tmp_path / "log.csv", table())
    path.write_text(path.read_text().replace("mode", "a", 1))
    with pytest.raises(RecordingError, match="column 'a' appears twice"):
        read_recording(path, DESCRIPTION)
    path.write_text(path.read_text().replace("a,z", "mode,z", 1).replace("x,a", "mode,a", 1))
    with pytest.raises(RecordingError, match="no column 'x'"):
        read_recording(path, DESCRIPTION)


def test_one_joint_more_than_sixty_four_is_too_many(tmp_path):
    many = {"t": T} | {f"{kind}{j}": T * (1.0 + j) for kind in "qv" for j in range(1, 66)}
    path = csv(tmp_path / "log.csv", many)
    with pytest.raises(RecordingError, match="65 joints; recordings of up to 64 are read"):
        read_recording(path)
    for kind in "qv":
        del many[f"{kind}65"]
    assert read_recording(csv(path, many)).n == 64


def test_names_are_listed_up_to_eight_of_them_and_two_hundred_letters():
    assert listed(["a", "b"]) == "a, b"
    assert listed([str(k) for k in range(8)]) == "0, 1, 2, 3, 4, 5, 6, 7"
    assert listed([str(k) for k in range(9)]) == "0, 1, 2, 3, 4, 5, 6, 7, .."
    assert listed(["x" * 150, "y" * 48]) == "x" * 150 + ", " + "y" * 48
    assert listed(["x" * 150, "y" * 49]) == "x" * 150 + ", " + "y" * 48 + ", .."


def test_a_range_stands_for_one_to_sixty_four_names():
    assert spread("q{3..3}_deg", "here") == ["q3_deg"]
    assert spread("q{9..11}", "here") == ["q9", "q10", "q11"]
    assert len(spread("q{2..65}", "here")) == 64
    for word in ("q{2..66}", "q{3..2}"):
        with pytest.raises(LogDescriptionError, match=r"here: 'q\{.*; expected a range of 1 to 64 numbers"):
            spread(word, "here")


@pytest.mark.parametrize(
    ("name", "description"),
    [
        ("time_ms", "is it 'time_ms'? --columns 't=time_ms[ms]'; found"),
        ("Timestamp [us]", "is it 'Timestamp [us]'? --columns 't=Timestamp [us][us]'; found"),
        ("t_robot", "is it 't_robot'? --columns 't=t_robot[unit]'; found"),
        ("temperature", "declare it: --columns t=NAME[unit]; found"),
    ],
)
def test_a_column_that_is_time_by_its_name_is_named_where_t_is_missing(tmp_path, name, description):
    with pytest.raises(RecordingError, match=re.escape(f"column t is missing; {description} q1, v1")):
        resolved(tmp_path / "log.csv", [name, "q1", "v1"], LogDescription())


def test_a_log_with_our_own_columns_beside_one_with_others_says_what_to_do(tmp_path):
    description = LogDescription(t=Channels(columns=("time_ms",), unit=("ms",)))
    with pytest.raises(
        RecordingError,
        match=(
            r"no column 'time_ms'.*this log already has columns "
            r"t, q1, v1, \.\.; convert only"
        ),
    ):
        resolved(tmp_path / "log.csv", ["t", "q1", "v1"], description)
    with pytest.raises(RecordingError, match=r"no column 'time_ms'; found seconds, q1, v1$"):
        resolved(tmp_path / "log.csv", ["seconds", "q1", "v1"], description)
