import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from ident.recordings.files import read_recording, write_recording
from ident.recordings.recording import Recording, resampled
from ident.support.errors import RecordingError


@pytest.fixture
def recording(rng) -> Recording:
    return Recording(0.01 * np.arange(50), rng.normal(size=(50, 2)), rng.normal(size=(50, 2)), "motion")


@pytest.mark.parametrize("ending", ["parquet", "csv"])
def test_files_keep_every_digit(recording, tmp_path, ending):
    path = tmp_path / f"log.{ending}"
    write_recording(recording, path)
    back = read_recording(path)
    for name in ("t", "q", "v"):
        np.testing.assert_array_equal(getattr(back, name), getattr(recording, name))


def test_parquet_is_what_pandas_writes(recording, tmp_path):
    write_recording(recording, tmp_path / "log.parquet")
    frame = pd.read_parquet(tmp_path / "log.parquet")
    assert list(frame.columns) == ["t", "q1", "q2", "v1", "v2"]
    frame.assign(note="x").to_parquet(tmp_path / "more.parquet", index=False)  # further columns do not matter
    np.testing.assert_array_equal(read_recording(tmp_path / "more.parquet").v, recording.v)


@pytest.mark.parametrize("values", [[0.3, 0.7, None, 0.2], [3, 7, None, 2]])
def test_a_value_that_is_missing_in_parquet_is_refused_with_its_row(recording, tmp_path, values):
    t, four = 0.125 * np.arange(4), np.array([0.4, 0.5, 0.7, 0.6])
    pq.write_table(pa.table({"t": t, "q1": pa.array(values), "v1": four}), tmp_path / "log.parquet")
    with pytest.raises(RecordingError, match=r"q1.* 3"):
        read_recording(tmp_path / "log.parquet")


def test_csv_may_have_comments_spaces_and_other_columns(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("# cell 4\nt, mode, q1, v1\n0, a, 1, 2 # start\n\n0.1, b, 1.5, 3\n")
    back = read_recording(path)
    np.testing.assert_array_equal(back.q[:, 0], [1, 1.5])
    np.testing.assert_array_equal(back.v[:, 0], [2, 3])


CSV_FAULTS = {
    "t,q1,v1\n0,1,2\n0.1,abc,3\n": r"line 3, column q1: 'abc' is not a number",
    "t,q1,v1\n0,1,2\n0.1,1.5\n": r"line 3 has 2 cells, but the header names 3",
    "q1,v1\n1,2\n2,3\n": r"column t is missing; declare it: --columns t=NAME\[unit\]; found q1, v1",
    "t,q1\n0,2\n1,3\n": "columns v1, v2, .. are missing",
    "t,q1,q2,v1\n0,2,1,1\n1,3,2,2\n": "joint 2 has only one of the columns q2 and v2",
    "t,q1,q3,v1,v3\n0,2,1,1,2\n1,3,2,2,3\n": "columns q2 and v2 are missing",
    "t,q1,q1,v1\n0,2,1,1\n": "column q1 appears twice",
    "time,pos,cur\n0,2,1\n": "names no column t, q1.. or v1..; found time, pos, cur",
    "t,q1,v1\n": "expected a header line and at least one row",
    "t,q1,v1\n0,1,2\n0,2,3\n": r"time does not increase at row 2: t = 0 s after 0 s$",
    "t,q1,v1\n0,1,2\n.1,2,3\n.1,2,3\n.2,1,3\n.2,1,2\n": r"row 3: t = 0\.1 s after 0\.1 s; 2 rows repeat .*more digits",
    "t,q1,v1\n0,1,2\n.2,2,3\n.2,2,3\n.1,1,3\n.3,1,2\n": r"row 3: t = 0\.2 s after 0\.2 s$",
    "t,q1,v1\n0,1,2\n1,nan,3\n": r"q1 is not a finite number at row 2 \(1 such values\)",
    "t,q1,v1\n0,1,2\n1,inf,3\n": r"q1 is not a finite number at row 2",
    "t,q1,v1\n0,1,2\n1,1,3\n": "q1 never changes",
    "t,q1,v1\n0,1,2\n1,2,2\n": "v1 never changes",
    "t,q1,v1\n0,1,2\n": "1 samples are too few",
}


@pytest.mark.parametrize("text", CSV_FAULTS)
def test_a_faulty_csv_is_one_line_that_names_file_and_fault(tmp_path, text):
    path = tmp_path / "log.csv"
    path.write_text(text)
    with pytest.raises(RecordingError, match=CSV_FAULTS[text]) as caught:
        read_recording(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_file_a_wrong_kind_and_a_text_column_are_named(tmp_path):
    with pytest.raises(RecordingError, match=r"absent\.csv: no such file"):
        read_recording(tmp_path / "absent.csv")
    (tmp_path / "fake.parquet").write_text("t,q1,v1\n")
    with pytest.raises(RecordingError, match=r"fake\.parquet: not a readable Parquet file"):
        read_recording(tmp_path / "fake.parquet")
    (tmp_path / "binary.csv").write_bytes(bytes(range(256)))
    with pytest.raises(RecordingError, match="not a text file"):
        read_recording(tmp_path / "binary.csv")
    pd.DataFrame({"t": [0.0, 1.0], "q1": ["a", "b"], "v1": [1.0, 2.0]}).to_parquet(tmp_path / "text.parquet")
    with pytest.raises(RecordingError, match=r"column q1 is .*string, expected numbers"):
        read_recording(tmp_path / "text.parquet")


def test_arrays_are_read_only_copies(recording):
    with pytest.raises(ValueError, match="read-only"):
        recording.q[0, 0] = 0.0


def test_a_uniform_clock_is_left_alone_and_a_jittered_one_resampled(rng):
    t = 0.01 * np.arange(400)
    motion = Recording(t, np.sin(t)[:, None], np.cos(t)[:, None])
    assert resampled(motion) is motion
    uneven = t + np.r_[0, rng.uniform(-0.003, 0.003, 398), 0]
    jittered = Recording(uneven, np.sin(uneven)[:, None], np.cos(uneven)[:, None])
    even = resampled(jittered)
    assert even.jitter < 1e-9
    np.testing.assert_allclose(even.q[:, 0], np.sin(even.t), atol=1e-9)  # cubic spline: h^4 / 384
    np.testing.assert_allclose(even.v[:, 0], np.cos(even.t), atol=4e-5)  # straight lines: h^2 / 8, h = 16 ms


def test_a_hole_in_the_log_is_refused_with_its_row(rng):
    t = np.r_[0.01 * np.arange(100), 3.0 + 0.01 * np.arange(100)]
    holed = Recording(t, rng.normal(size=(200, 1)), rng.normal(size=(200, 1)), "log")
    with pytest.raises(
        RecordingError, match=r"log: samples are missing: 2\.01 s pass from row 100 to the next, usually 0\.01 s"
    ):
        resampled(holed)


@pytest.mark.parametrize(("share", "holed"), [(9.9, False), (10.1, True)])
def test_an_interval_of_ten_others_is_a_hole_and_nothing_is_invented_for_it(rng, share, holed):
    # 40 and 59 samples on either side: the interval begins in row 40.
    t = 0.02 * (np.arange(99) + (share - 1.0) * (np.arange(99) >= 40))
    motion = Recording(t, rng.normal(size=(99, 2)), rng.normal(size=(99, 2)), "motion")
    if not holed:
        np.testing.assert_allclose(np.diff(resampled(motion).t), motion.period, rtol=1e-9)  # of sums in float64
        return
    with pytest.raises(
        RecordingError, match=r"samples are missing: 0\.202 s pass from row 40 to the next, usually 0\.02 s"
    ):
        resampled(motion)
