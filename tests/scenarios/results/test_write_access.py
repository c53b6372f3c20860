import errno
import json
from argparse import Namespace
from pathlib import Path

import pytest

from scenarios.command_line.output import Claim, right_to_write
from scenarios.support.errors import ScenarioError

NAMES = ("a.txt", "b.txt")


def held(folder, names=NAMES, *, command="rx90 test", force=False, reads=()):
    return right_to_write(Namespace(force=force, motions=list(reads)), folder, names, command=command)


def write(folder, text, **more):
    with held(folder, **more).writing():
        for name in NAMES:
            (folder / name).write_text(text)


def test_a_command_writes_again_over_its_own_unchanged_files_and_leaves_those_of_others(tmp_path):
    folder = tmp_path / "deep" / "er"
    write(folder, "first")
    (folder / "else.txt").write_text("mine")
    with held(folder, ["c.txt"], command="rx90 other").writing():
        (folder / "c.txt").write_text("other")
    write(folder, "second")  # the record of the other command does not replace ours
    assert [(folder / name).read_text() for name in ("b.txt", "c.txt", "else.txt")] == ["second", "other", "mine"]
    with pytest.raises(ScenarioError, match="rx90 other did not write this file"):
        held(folder, command="rx90 other")
    (folder / "a.txt").write_text("edited")
    with pytest.raises(ScenarioError, match=r"a\.txt: changed since rx90 test wrote it"):
        held(folder)
    write(folder, "theirs", force=True)
    write(folder, "again")


def test_what_was_written_before_a_stop_is_still_ours(tmp_path):
    def stopped():
        with held(tmp_path).writing():
            (tmp_path / "a.txt").write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped()
    write(tmp_path, "whole")


@pytest.mark.parametrize("text", ["", "[]", '{"rx90 test": ["a.txt"]}'])
def test_a_record_that_is_none_records_nothing(tmp_path, text):
    (tmp_path / ".rx90.json").write_text(text)
    (tmp_path / "a.txt").write_text("mine")
    with pytest.raises(ScenarioError, match="did not write"):
        held(tmp_path)


def test_a_single_file_is_claimed_in_its_folder(tmp_path):
    with held(tmp_path / "a.txt", ()).writing():
        (tmp_path / "a.txt").write_text("ours")
    (tmp_path / "b.txt").write_text("mine")
    held(tmp_path / "a.txt", ())
    with pytest.raises(ScenarioError, match=r"b\.txt: rx90 test did not write this file"):
        held(tmp_path / "b.txt", ())


def test_a_write_that_fails_is_told_with_the_file_asked_for_and_leaves_no_part(tmp_path, monkeypatch):
    with Claim(tmp_path, ("kept.txt",), "rx90 one").writing():
        (tmp_path / "kept.txt").write_text("whole")
    known = json.loads((tmp_path / ".rx90.json").read_text())
    ours = held(tmp_path, ["a.txt"])

    def full(text: str) -> None:
        with ours.writing():
            (tmp_path / "a.txt").write_text(text)
            raise OSError(errno.ENOSPC, "No space left on device")  # an error without a name, as of a file's own write

    with pytest.raises(ScenarioError, match=r"a\.txt: cannot be written: No space left on device$"):
        full("half")
    assert sorted(each.name for each in tmp_path.iterdir()) == [".rx90.json", "kept.txt"]
    assert json.loads((tmp_path / ".rx90.json").read_text())["rx90 one"] == known["rx90 one"]
    monkeypatch.setattr(Path, "write_text", lambda *_, **__: (_ for _ in ()).throw(OSError(28, "No space left")))
    with pytest.raises(ScenarioError, match=r"a\.txt: cannot be written: No space left$"), ours.writing():
        (tmp_path / "a.txt").touch()


def test_a_place_that_takes_no_files_is_found_out_first_and_named_as_it_was_asked_for(tmp_path):
    (tmp_path / "file").write_text("")
    ours = held(tmp_path / "above" / "new")
    (tmp_path / "above").write_text("")  # made by another in the meantime
    places = [(tmp_path / "file" / "sub", NAMES, rf"{tmp_path}/file: Not a directory$")]
    if Path("/proc/self").exists():  # a folder that takes no files, even from root
        places += [(Path("/proc/q"), ["z.csv"], "/proc: No such file or directory$"), (Path("/proc"), NAMES, "")]
    for folder, names, why in places:
        asked_for = folder / names[0] if names != NAMES else folder
        with pytest.raises(ScenarioError, match=rf"^{asked_for}: cannot be written: {why}"):
            held(folder, names)
    with pytest.raises(NotADirectoryError, match=r"above/new"), ours.writing():
        raise AssertionError("nothing is written")


def test_a_file_that_is_read_is_never_written_over(tmp_path):
    write(tmp_path, "ours")
    (tmp_path / "below").mkdir()
    linked = tmp_path / "linked.txt"
    linked.hardlink_to(tmp_path / "b.txt")
    for read in (tmp_path / "b.txt", tmp_path / "below" / ".." / "b.txt", linked, str(linked)):  # also as a word
        for force in (False, True):
            with pytest.raises(ScenarioError, match=r"b\.txt: rx90 test reads this file"):
                held(tmp_path, force=force, reads=[tmp_path / "none.txt", read])
    held(tmp_path, reads=[tmp_path / ("n" * 300), tmp_path / "below"])
