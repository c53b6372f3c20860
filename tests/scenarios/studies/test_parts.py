import itertools
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from rich.console import Console

import scenarios.experiments.studies.study as study_module
from scenarios.experiments.files.loading import load_scenario
from scenarios.experiments.studies import folder as studied
from scenarios.experiments.studies import parts
from scenarios.experiments.studies.monte_carlo import monte_carlo
from scenarios.experiments.studies.parts import BLOCK, LOST, WHOLE, Part, block_of
from scenarios.experiments.studies.study import Unfinished
from scenarios.experiments.workers.execute import Workers
from scenarios.support.errors import StudyError

IDENTITY = {"study": "monte-carlo"}
SIZE = 384
"""Trials of a part: three do not fill a block of 1024, and its last is cut short."""


def opened(path):
    return studied.study_folder(path, IDENTITY, count=5000, command="", rows_per_trial=2)


def rows_of(numbers: range) -> pa.Table:
    return pa.table(
        {"trial": np.repeat(numbers, 2), "joint": np.tile([1, 2], len(numbers)), "z": np.repeat(numbers, 2) + 0.25}
    )


def cut(numbers: range) -> list[range]:
    return [numbers[start : start + SIZE] for start in range(0, len(numbers), SIZE)]


def write(folder, numbers: range, ending: str = WHOLE) -> None:
    folder.write_part(Part(numbers, ending), rows_of(numbers))


def names(path) -> list[str]:
    return sorted(each.name for each in (path / "trials").iterdir())


def trials_of(path) -> list[int]:
    return sorted(pd.read_parquet(path / "trials")["trial"].tolist())


BOTH = list(itertools.chain.from_iterable((k, k) for k in range(BLOCK, 2 * BLOCK)))
"""The trials of the second block, a row a joint."""


def test_a_full_block_becomes_one_part_with_the_same_rows_and_its_neighbours_stay(tmp_path):
    block = block_of(BLOCK + 3)
    with opened(tmp_path) as folder:
        write(folder, range(BLOCK - 5, BLOCK))
        write(folder, range(2 * BLOCK, 2 * BLOCK + 7))
        for numbers in reversed(cut(block)):
            write(folder, numbers)
        before = folder.table()
        folder.merge(block)
        assert names(tmp_path) == [
            "00001019-00001023.parquet",
            "00001024-00002047.parquet",
            "00002048-00002054.parquet",
        ]
        pd.testing.assert_frame_equal(folder.table(), before, check_exact=True)
        merged = folder.rows(folder.parts()[1], ["trial"])
        assert merged["trial"].to_pylist() == BOTH
        folder.merge(block)  # again is nothing to do
        assert len(names(tmp_path)) == 3
    assert not list(tmp_path.glob(".*.parquet"))


@pytest.mark.parametrize("lack", ["the last", "the last, which was lost", "one, and a part reaches beyond"])
def test_a_block_that_is_not_finished_stays_as_it_is(tmp_path, lack):
    last = 2 * BLOCK - 1
    with opened(tmp_path) as folder:
        for numbers in cut(range(BLOCK + ("beyond" in lack), last)):
            write(folder, numbers)
        if lack != "the last":
            write(folder, range(last, last + 1 + ("beyond" in lack)), LOST if "lost" in lack else WHOLE)
        before = names(tmp_path)
        folder.merge(block_of(BLOCK))
    assert names(tmp_path) == before


@pytest.mark.parametrize("after", [0, 1, 2, 3])
def test_a_merge_that_a_crash_cuts_off_never_shows_a_row_twice_and_loses_none(tmp_path, monkeypatch, after):
    class Crash(BaseException):
        pass

    count = 0

    def step(real):
        def crashing(*args, **kwargs):
            nonlocal count
            if count == after:
                raise Crash
            count += 1
            return real(*args, **kwargs)

        return crashing

    with opened(tmp_path) as folder:
        for numbers in cut(block_of(BLOCK)):
            write(folder, numbers)
        with monkeypatch.context() as patched:
            patched.setattr(parts.Path, "unlink", step(parts.Path.unlink))
            patched.setattr(parts, "_settle", step(parts._settle))
            with pytest.raises(Crash):
                folder.merge(block_of(BLOCK))
        seen = trials_of(tmp_path)
        assert len(seen) == len(set(seen)) * 2  # two joints, each trial once
    with opened(tmp_path) as folder:
        assert folder.missing(2 * BLOCK) == [range(BLOCK)]
    assert trials_of(tmp_path) == BOTH
    assert names(tmp_path) == ["00001024-00002047.parquet"]
    assert not list(tmp_path.glob(".*.parquet"))


def test_a_strange_hidden_table_beside_the_parts_is_refused(tmp_path):
    with opened(tmp_path):
        (tmp_path / ".notes.parquet").write_bytes(b"x")
    with pytest.raises(StudyError, match=r"\.notes\.parquet: not part of a study; move it away"), opened(tmp_path):
        pass


def test_a_file_that_is_no_part_and_comes_meanwhile_does_not_end_a_merge(tmp_path):
    with opened(tmp_path) as folder:
        for numbers in cut(block_of(0)):
            write(folder, numbers)
        (folder.trials / "notes.txt").write_text("x")
        folder.merge(block_of(0))
    assert names(tmp_path) == ["00000000-00001023.parquet", "notes.txt"]


def test_a_block_waits_for_its_missing_trials_alone():
    unfinished = Unfinished([range(10, 700), range(1000, 1030), range(2047, 4000)])
    assert unfinished.finish(range(1000, 1024)) is None
    assert unfinished.finish(range(1024, 1030)) is None
    assert unfinished.finish(range(10, 699)) is None
    assert unfinished.finish(range(699, 700)) == range(1024)
    assert unfinished.finish(range(2047, 2048)) == range(1024, 2048)
    assert unfinished.finish(range(2048, 3072)) == range(2048, 3072)


def no_op(task, lost: int | None = 1500) -> pa.Table:
    """A row a trial, one of them lost."""
    numbers = [trial.number for trial in task.trials]
    failure = ["MemoryError" if number == lost else None for number in numbers]
    return pa.table({"trial": numbers, "failure": pa.array(failure, pa.string())})


def test_a_study_leaves_one_part_a_block_and_no_chunk_reaches_into_another(tmp_path, monkeypatch):
    loaded = load_scenario("nominal")
    one_row = replace(monte_carlo(loaded, 2500, 3), rows_per_joint=Fraction(1, len(loaded.table.tolerance.gain)))
    asked = []
    here = Workers(lambda: ThreadPoolExecutor(1), lambda: 1)
    monkeypatch.setattr(study_module, "CHUNK", 300)
    with monkeypatch.context() as patched:
        patched.setattr(study_module, "run_task", lambda task: asked.append(len(task.trials)) or no_op(task))
        study_module.carry_out(one_row, tmp_path, here, command="", console=Console(quiet=True))
    assert asked == [300, 300, 300, 124, 300, 300, 300, 124, 300, 152]
    assert names(tmp_path)[0] == "00000000-00001023.parquet"
    tail = ["00002048-00002347.parquet", "00002348-00002499.parquet"]
    assert {"00001500-00001500.lost.parquet", *tail} < set(names(tmp_path))
    with monkeypatch.context() as patched:
        patched.setattr(study_module, "run_task", lambda task: no_op(task, lost=None))
        study_module.carry_out(one_row, tmp_path, here, command="", console=Console(quiet=True))
    assert names(tmp_path) == ["00000000-00001023.parquet", "00001024-00002047.parquet", *tail]
    assert trials_of(tmp_path) == list(range(2500))
