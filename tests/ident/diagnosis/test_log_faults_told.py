"""What is said of logs that cannot be read as they stand: the cause, and what mends it."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ident.estimation.identifiability import refusal
from ident.payload.payload import payload_from_table
from ident.recordings.description import LogDescription
from ident.recordings.description_files import described, read_description
from ident.recordings.files import read_recording
from ident.recordings.recording import Recording
from ident.support.errors import PayloadError, RecordingError

T = 0.004 * np.arange(60)
Q = np.sin(9.0 * T[:, None] + np.array([0.3, 0.7]))
V = np.cos(5.0 * T[:, None] + np.array([0.2, 0.9]))
ROWS = np.column_stack((T, Q, V))
WORDS = ["t=1[s]", "q={2..3}[rad]", "v={4..5}[A]"]


def said(*words: str, signal: str | None = "current") -> LogDescription:
    return LogDescription(**{kind: getattr(described(words), kind) for kind in "tqv"}, signal=signal)


def frame(**changed) -> pd.DataFrame:
    return pd.DataFrame({"time": T, "a": Q[:, 0], "b": Q[:, 1], "i": V[:, 0], "k": V[:, 1]} | changed)


def text(path: Path, rows: np.ndarray, header: str = "", **how) -> Path:
    np.savetxt(path, rows, header=header, comments="", **{"fmt": "%.9g", "delimiter": ","} | how)
    return path


def test_all_that_is_not_said_is_told_at_once(tmp_path: Path):
    path = tmp_path / "log.csv"
    frame().to_csv(path, index=False)
    with pytest.raises(RecordingError) as caught:
        read_recording(path, said("t=time", "q=a,b", "v=i,k", signal=None))
    for words in ("unit of time", "unit of positions", "unit of currents", "quantity in i, k is not declared"):
        assert words in str(caught.value)
    with pytest.raises(RecordingError) as caught:
        read_recording(path, said("t=time", "q=a,b[rad]", "v=i,k"))
    assert "unit of time is not declared" in str(caught.value)
    assert "unit of currents is not declared" in str(caught.value)
    assert "positions" not in str(caught.value)


@pytest.mark.parametrize(("unit", "factor", "meant"), [("ms", 1.0, "s"), ("s", 1e3, "ms"), ("us", 1e9, "ns")])
def test_a_clock_in_another_unit_than_said_names_the_stated_one(tmp_path: Path, unit, factor, meant):
    path = tmp_path / "log.csv"
    frame(time=factor * T).to_csv(path, index=False)
    words = rf"t is declared in {unit} but advances by .* {unit} a row, .*; is it in .*{meant}"
    with pytest.raises(RecordingError, match=words):
        read_recording(path, said(f"t=time[{unit}]", "q=a,b[rad]", "v=i,k[A]"))


def test_a_file_without_header_needs_numbers_of_columns_alone(tmp_path: Path):
    for how in ({"delimiter": ","}, {"delimiter": " "}, {"delimiter": ";"}):
        found = read_recording(text(tmp_path / "log.csv", ROWS, **how), said(*WORDS))
        np.testing.assert_allclose(found.q, Q, rtol=1e-8)  # nine digits are written
        assert len(found.t) == len(T)  # the first row is a row
    named = read_recording(text(tmp_path / "named.csv", ROWS, "1,2,3,4,5"), said(*WORDS))
    assert len(named.t) == len(T)  # a header that counts the columns stays one
    with pytest.raises(RecordingError, match="has numbers where column names are expected"):
        read_recording(text(tmp_path / "log.csv", ROWS))


def test_decimal_commas_in_quotes_are_read(tmp_path: Path):
    path, lines = tmp_path / "log.csv", ["t,q1,q2,v1,v2"]
    lines += [",".join(f'"{x:.9f}"'.replace(".", ",") for x in row) for row in ROWS]
    path.write_text("\n".join(lines))
    np.testing.assert_allclose(read_recording(path).v, V, atol=1e-9)  # nine decimals are written


def test_a_transposed_array_is_named(tmp_path: Path):
    np.savez(tmp_path / "log.npz", t=T, q=Q.T, v=V)
    with pytest.raises(RecordingError, match=r"q has 2 rows of 60 numbers; .* it is transposed, save its \.T"):
        read_recording(tmp_path / "log.npz")
    np.save(tmp_path / "log.npy", np.zeros((5, 10_000)))
    with pytest.raises(RecordingError, match="the array has 5 rows of 10000 numbers"):
        read_recording(tmp_path / "log.npy")
    square = np.sin(0.1 * np.arange(1.0, 6.0)[:, None] * np.arange(1.0, 6.0))
    np.savez(tmp_path / "square.npz", t=T[:5], q=square, v=square)
    assert read_recording(tmp_path / "square.npz").n == 5
    np.savez(tmp_path / "good.npz", t=T, q=Q, v=V)
    np.testing.assert_array_equal(read_recording(tmp_path / "good.npz").q, Q)
    np.save(tmp_path / "names.npy", ROWS)
    with pytest.raises(RecordingError, match="the file names no column t"):  # and no header is spoken of
        read_recording(tmp_path / "names.npy")


def test_rows_that_are_there_twice_are_told_from_a_coarse_clock_and_from_a_second_recording():
    twice, again = np.repeat(np.arange(60), 1 + (np.arange(60) == 7)), np.tile(np.arange(60), 2)
    with pytest.raises(RecordingError, match=r"row 9: .*1 rows repeat earlier rows: drop the duplicates"):
        Recording(T[twice], Q[twice], V[twice])
    with pytest.raises(RecordingError, match=r"2 rows repeat the time .* write t with more digits"):
        Recording(np.where(np.arange(60) % 30 == 8, T - 0.004, T), Q, V)
    with pytest.raises(RecordingError, match=r"row 61: .*several recordings, .* only = \{ episode_index = 0 \}"):
        Recording(T[again], Q[again], V[again])


def test_a_last_column_that_never_changes_may_be_a_gripper():
    for joint, hinted in ((0, False), (1, True)):
        still = Q.copy()
        still[:, joint] = 0.04
        with pytest.raises(RecordingError, match=f"q{joint + 1} never changes") as caught:
            Recording(T, still, V)
        assert ("to leave out a gripper" in str(caught.value)) == hinted


def test_a_gripper_is_left_out_of_a_column_of_rows(tmp_path: Path):
    state = np.column_stack((Q, np.full(len(T), 0.04)))
    effort = np.column_stack((V, np.zeros(len(T))))
    episode = np.arange(len(T)) // 30
    pd.DataFrame({"time": T % 0.12, "state": list(state), "effort": list(effort), "episode_index": episode}).to_parquet(
        tmp_path / "log.parquet"
    )
    (tmp_path / "log.toml").write_text(
        'signal = "current"\nonly = { episode_index = 1 }\n[t]\ncolumn = "time"\nunit = "s"\n'
        '[q]\ncolumns = "state[{0..1}]"\nunit = "rad"\n[v]\ncolumns = "effort[{0..1}]"\nunit = "A"\n'
    )
    found = read_recording(tmp_path / "log.parquet", read_description(tmp_path / "log.toml"))
    np.testing.assert_array_equal(found.q, Q[30:])


@pytest.mark.parametrize(
    ("mass", "moment", "fits"), [(8.0, 32.5, False), (7.0, 8.7, False), (7.0, 0.6, True), (300.0, 2000.0, True)]
)
def test_an_inertia_that_no_body_of_that_mass_has_is_refused(mass, moment, fits):
    # sqrt(I / m) of 2.0, 1.11, 0.29 and 2.6 m beside 0.35 + 0.15 sqrt(m) = 0.77, 0.75, 0.75 and 2.95 m
    table = {"mass": mass, "known": "mass", "inertia": {"ixx": 0.9 * moment, "iyy": moment, "izz": 0.8 * moment}}
    if fits:
        assert payload_from_table(table).mass == mass
        return
    with pytest.raises(PayloadError, match=r"inertia\.iyy = .* a radius of gyration of .* kg m\^2"):
        payload_from_table(table)


def test_a_refusal_speaks_of_a_payload_only_where_there_is_one():
    assert "the payload puts 0.4 N m rms" in str(refusal(0.3, 0.4, 0.1, "N m"))
    assert "no payload loads this joint" in str(refusal(0.3, 0.0, 0.1, "N m"))
