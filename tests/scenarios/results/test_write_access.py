import pytest

from scenarios.results.write_access import claim
from scenarios.support.errors import ScenarioError

NAMES = ("a.txt", "b.txt")


def held(folder, *, command="rx90 test", force=False, reads=()):
    return claim(folder, NAMES, command=command, force=force, reads=reads)


def write(folder, text, **more):
    with held(folder, **more).writing():
        for name in NAMES:
            (folder / name).write_text(text)


def test_a_command_writes_again_over_what_it_wrote(tmp_path):
    folder = tmp_path / "deep" / "er"
    write(folder, "first")
    write(folder, "second")
    assert (folder / "b.txt").read_text() == "second"


def test_a_file_of_somebody_else_is_left_alone_unless_forced(tmp_path):
    (tmp_path / "b.txt").write_text("mine")
    with pytest.raises(ScenarioError, match=r"b\.txt: rx90 test did not write this file; .* add --force"):
        held(tmp_path)
    write(tmp_path, "theirs", force=True)
    write(tmp_path, "again")


def test_a_file_that_was_changed_since_is_left_alone(tmp_path):
    write(tmp_path, "first")
    (tmp_path / "a.txt").write_text("edited")
    with pytest.raises(ScenarioError, match=r"a\.txt: changed since rx90 test wrote it"):
        held(tmp_path)


def test_another_command_s_files_are_not_ours_and_its_record_stays(tmp_path):
    write(tmp_path, "first")
    with pytest.raises(ScenarioError, match="rx90 other did not write this file"):
        held(tmp_path, command="rx90 other")
    with claim(tmp_path, ["c.txt"], command="rx90 other", force=False, reads=()).writing():
        (tmp_path / "c.txt").write_text("other")
    write(tmp_path, "second")


def test_what_was_written_before_a_stop_is_still_ours(tmp_path):
    def stopped():
        with held(tmp_path).writing():
            (tmp_path / "a.txt").write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped()
    write(tmp_path, "whole")


@pytest.mark.parametrize("text", ["", "[]", "{", '{"rx90 test": 3}', '{"rx90 test": ["a.txt"]}'])
def test_a_record_that_is_none_records_nothing(tmp_path, text):
    (tmp_path / ".rx90.json").write_text(text)
    (tmp_path / "a.txt").write_text("mine")
    with pytest.raises(ScenarioError, match="did not write"):
        held(tmp_path)


def test_files_beside_them_do_not_matter(tmp_path):
    (tmp_path / "else.txt").write_text("mine")
    write(tmp_path, "first")
    assert (tmp_path / "else.txt").read_text() == "mine"


def test_a_folder_that_is_a_file_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(NotADirectoryError):
        held(tmp_path / "file" / "sub")


def test_a_folder_that_cannot_be_made_is_named_with_the_reason(tmp_path):
    ours = held(tmp_path / "above" / "new")
    (tmp_path / "above").write_text("")  # made by another in the meantime
    with pytest.raises(ScenarioError, match=r"^cannot create .*new: Not a directory$"), ours.writing():
        raise AssertionError("nothing is written")


@pytest.mark.parametrize("force", [False, True])
@pytest.mark.parametrize("way", ["itself", "another path", "a hard link"])
def test_a_file_that_is_read_is_never_written_over(tmp_path, way, force):
    write(tmp_path, "ours")
    (tmp_path / "below").mkdir()
    linked = tmp_path / "linked.txt"
    linked.hardlink_to(tmp_path / "b.txt")
    read = {"itself": tmp_path / "b.txt", "another path": tmp_path / "below" / ".." / "b.txt", "a hard link": linked}
    with pytest.raises(ScenarioError, match=r"b\.txt: rx90 test reads this file"):
        held(tmp_path, force=force, reads=[tmp_path / "none.txt", read[way]])
    held(tmp_path, reads=[tmp_path / ("n" * 300), tmp_path / "below"])
