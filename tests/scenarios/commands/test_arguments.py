"""Words of the command line, and what is said of wrong ones."""

import os

import pytest

from scenarios import __main__ as entry
from scenarios import json_schemas
from scenarios.command_line.arguments import LONGEST, quoted


def test_a_long_argument_is_cut_where_it_is_repeated_and_a_shorter_one_is_not():
    assert quoted("x" * LONGEST) == repr("x" * LONGEST)
    assert quoted("x" * (LONGEST + 1)) == repr("x" * LONGEST) + "..."


def test_the_command_keeps_linear_algebra_to_one_thread_unless_told_otherwise(monkeypatch):
    monkeypatch.setattr("sys.argv", ["rx90", "--version"])
    for name in ("freeze", "set_threshold"):  # of a process that ends, which this one does not
        monkeypatch.setattr(f"gc.{name}", lambda *_: None)
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    with pytest.raises(SystemExit):
        entry.main()
    assert os.environ["OPENBLAS_NUM_THREADS"] == "1"
    assert os.environ["OMP_NUM_THREADS"] == "3"


def test_schemas_are_written_into_a_folder_that_is_made(tmp_path, monkeypatch):
    monkeypatch.setattr(json_schemas, "FOLDER", tmp_path / "schemas")
    json_schemas.write_schemas()
    names = {path.name for path in (tmp_path / "schemas").iterdir()}
    assert names == {f"{name}{json_schemas.ENDING}" for name in json_schemas.schemas()}
