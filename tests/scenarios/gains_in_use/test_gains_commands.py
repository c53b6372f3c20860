import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from bad_files import refused
from printed import fits, printed
from weighed_cell import MODEL, PLAIN, editable, identified, light, off, with_other

from scenarios.cli import main
from scenarios.results.gains_file import read_gains

pytestmark = pytest.mark.usefixtures("_computed_once", "_all_undiagnosed")


def by_hand(path: Path, gains: dict[int, float], rel_std: float, more: str = "") -> str:
    """A file of gains of joints 1 to 3; those that are not given are refused."""
    refused = 'identifiable = false\nreason = "no payload"'
    entries = [
        f"[[gains]]\njoint = {k}\n"
        + (f"estimate = {gains[k]}\nstd = {rel_std * abs(gains[k])}" if k in gains else refused)
        for k in (1, 2, 3)
    ]
    path.write_text("\n".join([entries[0], more, *entries[1:]]))
    return str(path)


def test_gains_of_a_joint_that_turns_and_of_one_that_slides_are_not_compared(weighed_cell, capsys):
    first, text = str(weighed_cell / "gains.toml"), editable(weighed_cell / "gains.toml")
    place, slides = text.index("joint = 3"), weighed_cell / "slides.toml"
    slides.write_text(text[:place] + text[place:].replace("N m / drive unit", "N / drive unit", 1))
    line = refused(capsys, ["verify", first, str(slides)])
    assert "joint 3: its gain is in N m / drive unit in A and in N / drive unit in B" in line
    units = list[str]()
    for path in (str(slides), first):
        assert main(["verify", path, path, "--json"]) == 0
        units += [each["unit"] for each in printed(capsys, "verify-gains")["joints"] if each["joint"] == 3]
    assert units == ["N/unit", "N m/unit"]


def test_gains_that_moved_are_named(weighed_cell, capsys):
    off(weighed_cell, 3, 1.2, "moved.json")
    first, second = str(weighed_cell / "gains.toml"), str(weighed_cell / "moved.json")
    moved = json.loads(Path(second).read_text())
    kept = [each for each in moved["recordings"] if each["name"] != "unloaded.parquet"]
    Path(second).write_text(json.dumps(moved | {"recordings": kept}))
    found = printed(capsys, "verify-gains", ["verify", first, second], status=1)
    assert [each["joint"] for each in found["joints"] if each["moved"]] == [3]
    np.testing.assert_allclose(found["joints"][2]["rel_change"], 0.2, rtol=1e-9)
    np.testing.assert_allclose(found["joints"][2]["B"], 1.2 * found["joints"][2]["A"], rtol=1e-9)
    assert found["shared"] == ["heavy.parquet"]
    assert main(["verify", first, second]) == 1
    assert "A and B share heavy.parquet: their errors are correlated" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("A", "B", "rel_std", "status", "sharing", "said"),
    [
        (
            {1: 2.0, 2: 3.0, 3: 5.0}, {1: 2.05, 2: 3.0, 3: 5.0}, 0.0075, 0, [1, 2, 3],
            ["shoulder", "MOVED beyond 2.39 standard deviations",
             "beyond 2, within 2.39 standard deviations: joint 1)."],  # 2.3 deviations
        ),
        (
            {3: 2.0}, {3: 2.2}, 0.005, 1, [3],
            ["MOVED: joint 3 changed significantly (+10 %, 2 sigma 1.6 %).", "Only joint 3 has a gain in both files"],
        ),
        (
            {3: 2.0}, {3: -2.02}, 0.005, 1, [3],
            ["MOVED: joint 3 changed significantly (opposite sign, size +1 %, 2 sigma 1.4 %).", "TURNED"],
        ),
        (
            {1: 2.0, 2: 3.0}, {1: 2.02, 2: 2.94}, 0.0075, 0, [1, 2],  # 0.9 deviations up, and 1.9 down
            ["SAME: no gain changed significantly (most: joint 2, -2 %, 2 sigma 2.1 %)."],
        ),
        (
            # Of 1.41 % each, 2.1 deviations are below the limit of 2.39; the mean has 0.82 % and leaves 1.15 % and 4 %.
            {1: 2.0, 2: 3.0, 3: 5.0},
            {1: 2.0 * np.exp(-0.029), 2: 3.0 * np.exp(-0.029), 3: 5.0 * np.exp(0.03)}, 0.01, 1, None,
            ["MOVED: the gains changed significantly as a whole (p = 0.0048), no single one did; relative to the "
             "common factor: joint 3, +4 %, 2 sigma 2.4 %."],
        ),
    ],
)  # fmt: skip
def test_what_changed_is_concluded_with_its_measure(tmp_path, capsys, A, B, rel_std, status, sharing, said):
    files = [by_hand(tmp_path / "A.toml", A, rel_std, 'name = "shoulder"'), by_hand(tmp_path / "B.toml", B, rel_std)]
    assert main(["verify", *files]) == status
    out = " ".join(capsys.readouterr().out.split())
    assert all(words in out for words in said)
    assert ("Change common to" in out) is ("for all joints together" in out) is (len(A) > 1)
    found = printed(capsys, "verify-gains", ["verify", *files], status=status)
    assert sharing is None or found["scale_joints"] == sharing
    assert (found["pattern"] is None) is (len(A) == 1)
    for each in found["joints"]:
        row = f"{each['A']:.4f} {each['B']:.4f} {100 * each['rel_change']:+.2f} {200 * each['rel_std']:.2f} "
        apart = each["apart"]
        row += f"{100 * apart['rel_change']:+z.2f} {200 * apart['rel_std']:.2f}" if len(A) > 1 else "- -"
        assert row in out


def test_run_writes_the_gains_as_well(weighed_cell, tmp_path, capsys):
    out = Path(shutil.copy(weighed_cell / "run.json", tmp_path))  # elsewhere it is nobody's
    fits(json.loads(out.read_text()), "gains")
    written = read_gains(out)
    assert [each.payload for each in written.recordings] == [None, 1, 2]
    seen = {each.sha256 for each in read_gains(weighed_cell / "gains.toml").recordings}
    assert seen < {each.sha256 for each in written.recordings}  # simulated or read back, the digest is the same
    out.write_text("mine")
    words = ["run", str(weighed_cell / "quick.toml"), "--gains-out", str(out)]
    assert "rx90 run did not write this file" in refused(capsys, words)


def test_bare_recordings_alone_give_ratios(weighed_cell, capsys):
    words = [*identified(weighed_cell)[:5], "--max-rel-std", "0.5", *PLAIN]
    found = printed(capsys, "identify-bare", [*words])
    assert len(found["joints"]) == 6
    assert all(0.0 < each["fitted_rel_error"] < each["predicted_rel_error"] for each in found["joints"])
    assert sum(each["ratio"] is not None for each in found["joints"]) >= 2
    assert (found["consistent"], "--gains" in found["consistent_reason"]) == (None, True)
    reference = found["joints"][found["reference"] - 1]
    assert (reference["ratio"], reference["rel_std"]) == (1.0, 0.0)
    assert main([*words, "--gains", str(weighed_cell / "gains.toml")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "Essential base parameters, in SI" in said
    assert "Physically consistent links, in SI" in said
    found = printed(capsys, "identify-bare", [*words, "--gains", str(weighed_cell / "gains.toml")])
    own = read_gains(weighed_cell / "gains.toml").gains
    assert [each["gain"] for each in found["joints"]] == [each.estimate for each in own]
    known = [each for each in found["joints"] if each["off"] is not None]
    for each in known:
        way = "below" if each["off"] < 0.0 else "above"
        assert re.search(rf"joint {each['joint']} to joint {found['reference']} is \S+ % {way} that of the given", said)
    assert all(
        each["off_std"] > (1.0 + each["off"]) * each["rel_std"] for each in known
    )  # with that of the given gains
    assert [each["mass"] > 0.0 for each in found["consistent"]["links"]] == [True] * 6
    assert found["consistent_reason"] is None
    for more, complaint in (
        (["--gains-out", str(weighed_cell / "none.toml")], "bare recordings give only ratios of gains"),
        (["--method", "ls-2011"], "--method ls-2011 needs a payload"),
    ):
        assert complaint in refused(capsys, [*words, *more])
    words = [*identified(weighed_cell), "--gains", str(weighed_cell / "gains.toml")]
    assert "--gains: for bare recordings only" in refused(capsys, words)
    assert "4000 Hz" in refused(capsys, [*words[:5], "--cutoff-hz", "4000"])


def test_gains_of_another_robot_and_a_data_sheet_of_another_sign_are_refused(weighed_cell, patching, capsys):
    file = read_gains(weighed_cell / "gains.toml").model_dump(mode="json", exclude_none=True)
    (weighed_cell / "stranger.json").write_text(json.dumps(file | {"robot": "ur10e"}))
    run, own, stranger = weighed_cell / "run", *(str(weighed_cell / x) for x in ("gains.toml", "stranger.json"))
    of_robot = "gains: of robot ur10e, but the model is of rx90; if both are one arm, write robot = 'rx90'"
    bare = ["--model", MODEL, "--unloaded", str(run / "unloaded.parquet")]
    weighed = ["--loaded", str(run / "light.parquet"), "--payload", str(run / "payload-light.toml")]
    turned = "assumed gains: joint 3: -1.1, but its gain is"
    for words, message in (
        (with_other(patching, "--gains", stranger), of_robot),
        ([*patching, "--nominal", stranger], of_robot),
        (["verify", *bare, *weighed, "--gains", stranger], of_robot),
        (["identify", *bare, "--gains", stranger], of_robot),
        ([*identified(weighed_cell), *PLAIN, "--compare-with", stranger], of_robot),
        ([*identified(weighed_cell), *PLAIN, "--compare-with", "1,1,-1.1,1,1,1"], turned),
        (["verify", *bare, *weighed, "--gains", own, *light(weighed_cell), "--compare-with", "1,1,-1.1,1,1,1"], turned),
    ):
        assert message in refused(capsys, words)


def test_two_files_are_compared_without_options_of_recordings(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("a.toml", "b.toml"):
        (tmp_path / name).write_text("")
    for option in (["--gains", "a.toml"], ["--model", "rx90"], ["--current-delay", "auto"]):
        assert f"{option[0]}: for recordings" in refused(capsys, ["verify", "a.toml", "b.toml", *option])
    assert "a.toml: expected two files of gains" in refused(capsys, ["verify", "a.toml"])
    for given, lacking in ((["--model", "rx90"], "--gains"), (["--gains", "a.toml"], "--model")):
        assert f"{lacking}: give " in refused(capsys, ["verify", *given])
