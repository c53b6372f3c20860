"""What a command line reads, and what it may therefore not write over."""

from argparse import Namespace
from pathlib import Path
from types import SimpleNamespace

import pytest

from scenarios.command_line.writing import files_read, right_to_write
from scenarios.support.errors import ScenarioError

WRITTEN = ("out", "save", "gains_out", "ros_params", "render", "seal")


def test_everything_on_a_command_line_is_read_but_what_is_written_and_words_that_name_nothing(tmp_path):
    there = tmp_path / "there.toml"
    there.write_text("")
    read = [Path(name) for name in ("a.csv", "b.csv", "c.csv", "d.csv", "e.csv")]
    options = Namespace(
        gains=read[0],
        logs=[read[1], (read[2],)],
        group=[SimpleNamespace(files=(read[3],))],
        pair=(None, read[4]),
        scenario=str(there),
        word="nothing-of-this-name",
        jobs=3,
        force=False,
        **{name: Path(f"{name}.csv") for name in WRITTEN},
    )
    assert sorted(files_read(options)) == sorted([*read, there])


def test_a_file_that_is_read_is_never_written_over_and_one_of_others_when_forced(tmp_path):
    for name in ("log.csv", "notes.csv"):
        (tmp_path / name).write_text("mine")

    def asked(name: str, *, force: bool) -> None:
        options = Namespace(logs=[tmp_path / "log.csv"], out=tmp_path / name, force=force)
        right_to_write(options, tmp_path, [name], command="rx90 test")

    for force in (False, True):
        with pytest.raises(ScenarioError, match=r"log\.csv: rx90 test reads this file"):
            asked("log.csv", force=force)
    with pytest.raises(ScenarioError, match=r"notes\.csv: rx90 test did not write this file"):
        asked("notes.csv", force=False)
    asked("notes.csv", force=True)
