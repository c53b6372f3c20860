"""Groups of `rx90 identify`: each `--loaded` with its payload is a mounting of its own."""

import json
from pathlib import Path

import pytest

import rx90_mjcf
import scenarios.commands.identify as command
from ident.estimation.gain_options import GainOptions
from ident.identification import identify
from ident.model.arm import load_arm
from ident.payload.payload import read_payload
from ident.preparation import KNOWN
from ident.recordings.files import read_recording, write_recording
from ident.recordings.motion import Motion
from ident.recordings.recording import Recording
from scenarios.cli import main
from scenarios.experiments.robot_models import model_links
from scenarios.experiments.robots import robot
from scenarios.results.run_folder import save_run

pytestmark = pytest.mark.usefixtures("_computed_once")


@pytest.fixture(scope="module")
def saved(repeated, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("saved")
    save_run(repeated, folder)
    return folder


def words(folder: Path, *names: str) -> list[str]:
    """`rx90 identify` of files in a folder; what begins with a hyphen stays."""
    files = [name if name.startswith("--") else str(folder / name) for name in names]
    return ["identify", "--model", str(rx90_mjcf.MJCF), *files]


UNPAIRED = {
    (
        "--unloaded",
        "unloaded.parquet",
        "--payload",
        "payload.toml",
    ): "payload.toml: no --loaded without a payload precedes it",
    ("--payload", "p.toml", "--loaded", "a", "--loaded", "b", "--payload", "q.toml"): "p.toml: no --loaded",
    ("--loaded", "a", "--payload", "p.toml", "--loaded", "b"): "b: no payload follows it",
    (): "no recording is given",
    ("--unloaded", "unloaded.parquet"): "bare motions determine no ratio of gains",
    (
        "--loaded",
        "loaded.parquet",
        "loaded-2.parquet",
        "--payload",
        "payload.toml",
    ): "loaded-2.parquet carry the same payload of 7.025 kg, and no log is bare: a gain needs motions with and without "
    "it; give the log of the bare flange with --unloaded, or record one",
    ("--unloaded", "unloaded.parquet", "unloaded.parquet"): "contain the same motion",
}


@pytest.mark.parametrize("names", UNPAIRED)
def test_files_that_do_not_go_together_are_one_line_and_exit_status_2(saved, names, capsys):
    assert main(words(saved, *names)) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert UNPAIRED[names] in output.err
    assert output.err.count("\n") == 1


def estimates(arguments: list[str], capsys) -> list[float | None]:
    capsys.readouterr()
    assert main([*arguments, "--json"]) == 0
    return [gain["estimate"] for gain in json.loads(capsys.readouterr().out)["gains"]]


def test_an_only_payload_may_stand_before_the_only_loaded_group(saved, capsys):
    loaded, payload = ("--loaded", "loaded.parquet"), ("--payload", "payload.toml")
    method = ["--method", "ls-2011"]
    usual = estimates(words(saved, "--unloaded", "unloaded.parquet", *loaded, *payload) + method, capsys)
    other = estimates(words(saved, *payload, "--unloaded", "unloaded.parquet", *loaded) + method, capsys)
    assert usual == other


def test_every_group_is_a_mounting_of_its_own(saved, capsys):
    # As `identify` is told by payloads that are one object or two.
    bare, loaded, again = (read_recording(saved / f"{n}.parquet") for n in ("unloaded", "loaded", "loaded-2"))
    (saved / "mass.toml").write_text('mass = 7.025\nknown = "mass"\n')
    one, two = read_payload(saved / "mass.toml"), read_payload(saved / "mass.toml")
    arm, wide = load_arm(robot().model), GainOptions(max_rel_std=3.0)  # 6 s show little of a mass alone
    quickly = {"method": "ls-2011", "gains": wide, "policy": KNOWN}
    joint_by_joint = ("--method", "ls-2011", "--max-rel-std", "3")
    shared, apart = (
        [j.value if hasattr(j, "value") else None for j in identify(arm, motions, **quickly).estimate.joints]
        for motions in (
            (Motion(bare), Motion(loaded, one), Motion(again, one)),
            (Motion(bare), Motion(loaded, one), Motion(again, two)),
        )
    )
    assert shared != apart
    start = ("--unloaded", "unloaded.parquet", "--loaded", "loaded.parquet")
    one_group = words(saved, *start, "loaded-2.parquet", "--payload", "mass.toml")
    two = words(saved, *start, "--payload", "mass.toml", "--loaded", "loaded-2.parquet", "--payload", "mass.toml")
    assert estimates([*one_group, *joint_by_joint], capsys) == shared
    assert estimates([*two, *joint_by_joint], capsys) == apart


def test_motions_with_absolute_time_are_taken_in_its_order_and_others_as_given(saved, tmp_path, monkeypatch):
    seen: list[list[float]] = []
    original = command.identify

    def watched(arm, motions, **named):
        seen.append([round(float(motion.recording.t[0])) for motion in motions])
        return original(arm, motions, **named)

    monkeypatch.setattr(command, "identify", watched)
    for name, start in (("unloaded", 1.7e9 + 40), ("loaded", 1.7e9 + 90), ("unloaded-2", 1.7e9), ("loaded-2", 50.0)):
        log = read_recording(saved / f"{name}.parquet")
        write_recording(Recording(log.t + start, log.q, log.v), tmp_path / f"{name}.parquet")
    (tmp_path / "payload.toml").write_text((saved / "payload.toml").read_text())
    bare = ("--unloaded", "unloaded.parquet", "unloaded-2.parquet", "--loaded", "loaded.parquet")
    method = ["--method", "ls-2011"]
    assert main(words(tmp_path, *bare, "--payload", "payload.toml") + method) == 0
    assert main(words(tmp_path, *bare, "loaded-2.parquet", "--payload", "payload.toml") + method) == 0
    assert seen == [
        [1_700_000_000, 1_700_000_040, 1_700_000_090],
        [1_700_000_040, 1_700_000_000, 1_700_000_090, 50],
    ]


def test_a_model_without_masses_is_no_witness_and_no_fault(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(
        '<robot name="bare"><link name="a"/><link name="b"/><joint name="j" type="revolute"><parent link="a"/>'
        '<child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    assert model_links(path, None) is None
