from collections.abc import Callable
from pathlib import Path

import pytest
from bad_files import refused

from ident.recordings.files import read_recording, write_recording
from ident.recordings.recording import Motion, Recording
from ident.support.errors import NotIdentifiable
from scenarios.cli import main
from scenarios.experiments.robots import model_links

Asked = Callable[..., list[tuple[str, float, int | None]]]


def words(folder: Path, *names: str) -> list[str]:
    """`rx90 identify` of files in a folder; what begins with a hyphen stays."""
    files = [name if name.startswith("--") else str(folder / name) for name in names]
    return ["identify", "--model", str(folder / "arm.xml"), *files]


UNPAIRED = {
    ("--unloaded", "a.csv", "--payload", "payload.toml"): "payload.toml: no --loaded without a payload precedes it",
    ("--payload", "p.toml", "--loaded", "a", "--loaded", "b", "--payload", "q.toml"): "p.toml: no --loaded",
    ("--loaded", "a", "--payload", "p.toml", "--loaded", "b"): "b: no payload follows it",
    (): "no recording is given",
    ("--unloaded", "a.csv", "a.csv"): "contain the same motion",
}


def test_files_that_do_not_go_together_are_one_line(good, capsys):
    for names, message in UNPAIRED.items():
        assert message in refused(capsys, words(good, *names))


@pytest.fixture
def asked(good, tmp_path, monkeypatch) -> Asked:
    """The log, the start and the payload, by the order in which it appears, of the motions that words give."""
    for name, source, start in (("a", "a", 40.0), ("b", "b", 90.0), ("a-2", "a", 0.0), ("b-2", "b", -1.7e9 + 50.0)):
        log = read_recording(good / f"{source}.csv")
        write_recording(Recording(log.t + 1.7e9 + start, log.q, log.v), tmp_path / f"{name}.csv")
    for name in ("arm.xml", "payload.toml"):
        (tmp_path / name).write_bytes((good / name).read_bytes())
    seen = list[tuple[str, float, int | None]]()

    def watched(arm: object, motions: list[Motion], **named: object) -> None:
        payloads = list(dict.fromkeys(id(each.payload) for each in motions if each.payload))
        for each in motions:
            mounting = payloads.index(id(each.payload)) if each.payload else None
            seen.append((Path(each.recording.name).stem, each.recording.t[0], mounting))
        raise NotIdentifiable("seen")

    def run(*names: str) -> list[tuple[str, float, int | None]]:
        seen.clear()
        assert main(words(tmp_path, *names)) == 2
        return list(seen)

    monkeypatch.setattr("ident.identification.identify", watched)
    return run


LOADED, PAYLOAD = ("--loaded", "b.csv"), ("--payload", "payload.toml")


def test_every_group_is_a_mounting_of_its_own_and_an_only_payload_may_stand_first(asked):
    usual = asked("--unloaded", "a.csv", *LOADED, *PAYLOAD)
    assert [each[2] for each in usual] == [None, 0]
    assert asked(*PAYLOAD, "--unloaded", "a.csv", *LOADED) == usual
    start = ("--unloaded", "a.csv", *LOADED)
    one, two = asked(*start, "b-2.csv", *PAYLOAD), asked(*start, *PAYLOAD, "--loaded", "b-2.csv", *PAYLOAD)
    assert [each[2] for each in one] == [None, 0, 0]
    assert [each[2] for each in two] == [None, 0, 1]


def test_motions_with_absolute_time_are_taken_in_its_order_and_others_as_given(asked):
    bare = ("--unloaded", "a.csv", "a-2.csv", *LOADED)
    assert [each[0] for each in asked(*bare, *PAYLOAD)] == ["a-2", "a", "b"]
    assert [each[0] for each in asked(*bare, "b-2.csv", *PAYLOAD)] == ["a", "a-2", "b", "b-2"]


def test_a_model_without_masses_is_no_witness_and_no_fault(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(
        '<robot name="bare"><link name="a"/><link name="b"/><joint name="j" type="revolute"><parent link="a"/>'
        '<child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    assert model_links(path, None) is None
