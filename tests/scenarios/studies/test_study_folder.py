import json
import resource

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

from scenarios.experiments.study_folder import STUDY, study_folder
from scenarios.support.errors import ScenarioError

IDENTITY = {"study": "monte-carlo", "scenario": {"name": "x", "table": {"plant": {"gain": [1.0, 2.0]}}}, "seed": 0}


def opened(path, identity=IDENTITY, count=10):
    return study_folder(path, identity, count=count, command="rx90 x", rows_per_trial=2)


def part(first: int, last: int, failure: str | None = None) -> pa.Table:
    numbers = np.repeat(np.arange(first, last + 1), 2)
    failures = pa.array([failure] * len(numbers), pa.string())
    joints = np.tile([1, 2], last - first + 1)
    return pa.table({"trial": numbers, "joint": joints, "z": numbers + 0.5, "failure": failures})


def test_what_is_written_is_there_and_the_rest_is_missing(tmp_path):
    with opened(tmp_path / "study") as folder:
        folder.keep(part(4, 5))
        folder.keep(part(0, 2))
        assert folder.missing(8) == [range(3, 4), range(6, 8)]
    with opened(tmp_path / "study") as folder:
        assert folder.missing(6) == [range(3, 4)]
        folder.keep(part(9, 9))  # of a larger study before
        assert folder.missing(7) == [range(3, 4), range(6, 7)]
        assert folder.missing(10**8)[-1] == range(10, 10**8)  # which takes no memory
        (folder.trials / "00000009-00000009.parquet").unlink()
        table = folder.table()
    assert table["trial"].tolist() == [0, 0, 1, 1, 2, 2, 4, 4, 5, 5]
    pd.testing.assert_frame_equal(
        table, pd.read_parquet(tmp_path / "study" / "trials").sort_values(["trial", "joint"], ignore_index=True)
    )


def test_the_record_names_what_was_requested_and_the_folder_of_another_study_is_refused(tmp_path):
    for count, most in ((9, 9), (4, 9), (13, 13)):
        with opened(tmp_path, count=count):
            record = json.loads((tmp_path / STUDY).read_text())
        assert record["trials"] == most
    assert record["scenario"] == IDENTITY["scenario"]
    assert (record["seed"], record["command"]) == (0, "rx90 x")
    assert {"python", "mujoco", "numpy", "pin"} <= set(record["versions"])
    other = json.loads(json.dumps(IDENTITY))
    other["scenario"]["table"]["plant"]["gain"] = [1.0, 3.0]
    said = r"another study: scenario\.table\.plant\.gain is \[1\.0, 2\.0\] there and \[1"
    with pytest.raises(ScenarioError, match=said), opened(tmp_path, other):
        pass
    del record["digest"]
    record["versions"]["mujoco"] = "3.0"
    (tmp_path / "study.json").write_text(json.dumps(record))
    with pytest.raises(ScenarioError, match=r'versions\.mujoco is "3\.0" there'), opened(tmp_path):
        pass


def test_a_folder_that_is_no_study_or_has_a_damaged_record_is_refused_and_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("x")
    with pytest.raises(ScenarioError, match=r"contains 'thesis\.tex' but no study\.json"), opened(tmp_path):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]
    for text in ("", "[]", "{", '{"trials": "many"}'):
        (tmp_path / "study.json").write_text(text)
        with pytest.raises(ScenarioError, match=r"study\.json: not the record of a study"), opened(tmp_path):
            pass


def test_strange_or_damaged_parts_and_those_under_another_name_or_twice_are_refused(tmp_path):
    with opened(tmp_path) as folder:
        folder.keep(part(0, 3))
        good = (folder.trials / "00000000-00000003.parquet").read_bytes()
        other = "contains 8 rows of trials 0 to 3"
        for name, content, message in (
            ("notes.txt", b"x", "not part of a study; move it away"),
            ("00000004-00000007.parquet", good, other),
            ("00000000-00000003.copy.parquet", good, other),
            ("00000000-00000003", good, other),
        ):
            (folder.trials / name).write_bytes(content)
            with pytest.raises(ScenarioError, match=rf"{name}: {message}"):
                folder.missing(10)
            (folder.trials / name).unlink()
        folder.keep(part(3, 4))
        with pytest.raises(ScenarioError, match=r"00000003-00000004\.parquet: its trials are also in 0"):
            folder.missing(10)
        folder.keep(part(5, 7).slice(0, 5))
        with pytest.raises(ScenarioError, match="contains 5 rows of trials 5 to 7"):
            folder.parts()


def test_no_bit_that_flips_changes_the_rows_in_silence(tmp_path, rng):
    with opened(tmp_path) as folder:
        folder.keep(part(0, 30))
        folder.keep(part(31, 33))
        sound, path = folder.table(), folder.trials / "00000000-00000030.parquet"
        content, refused = path.read_bytes(), 0
        for bit in rng.choice(8 * len(content), 90, replace=False):
            flipped = bytearray(content)
            flipped[bit // 8] ^= 1 << (bit % 8)
            path.write_bytes(flipped)
            try:
                pd.testing.assert_frame_equal(folder.table(), sound)  # some bits hold nothing that is read
            except ScenarioError:
                refused += 1
        assert refused > 30


def test_a_study_is_open_in_one_place_at_a_time_and_what_a_crash_left_half_written_is_cleared_away(tmp_path):
    with opened(tmp_path) as folder:
        folder.keep(part(0, 0))
        with pytest.raises(ScenarioError, match="another process uses it"), opened(tmp_path):
            pass
    (tmp_path / ".unfinished").write_bytes(b"half a part")
    with opened(tmp_path) as folder:
        assert folder.missing(2) == [range(1, 2)]
        assert not (tmp_path / ".unfinished").exists()


def test_a_full_disk_is_one_line_and_the_finished_parts_stay(tmp_path):
    # A limit on the size of files stands in for a full disk: the same failing write.
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    said = r"00000001-00000001\.parquet: cannot be written: File too large; finished trials are kept"
    with opened(tmp_path) as folder:
        folder.keep(part(0, 0))
        resource.setrlimit(resource.RLIMIT_FSIZE, (100, hard))
        try:
            with pytest.raises(ScenarioError, match=said):
                folder.keep(part(1, 1))
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert [path.name for path in (tmp_path / "trials").iterdir()] == ["00000000-00000000.parquet"]
    assert not (tmp_path / ".unfinished").exists()
