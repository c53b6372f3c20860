"""Files of gains: which moved, those of a run, those that bare recordings take."""

import json

import jsonschema
import numpy as np
import pytest
from bad_files import only_line
from printed import printed
from weighed_cell import MODEL, PLAIN, identified, light, off, with_other

from scenarios.cli import main
from scenarios.experiments.gains_file import read_gains
from scenarios.results.json_schemas import schema


def test_gains_of_a_joint_that_turns_and_of_one_that_slides_are_not_compared(weighed_cell, capsys):
    first, text = str(weighed_cell / "gains.toml"), (weighed_cell / "gains.toml").read_text()
    place = text.index("joint = 3")
    slides = text[:place] + text[place:].replace("N m / drive unit", "N / drive unit", 1)
    (weighed_cell / "slides.toml").write_text(slides)
    assert main(["verify", first, str(weighed_cell / "slides.toml")]) == 2
    assert "joint 3: its gain is in N m / drive unit in A and in N / drive unit in B" in capsys.readouterr().err
    assert main(["verify", str(weighed_cell / "slides.toml"), str(weighed_cell / "slides.toml")]) == 0
    assert "N (m)/unit" in capsys.readouterr().out
    (weighed_cell / "slides.toml").write_text(text.replace("N m / drive unit", "N / drive unit"))
    assert main(["verify", str(weighed_cell / "slides.toml"), str(weighed_cell / "slides.toml")]) == 0
    said = capsys.readouterr().out
    assert "N/unit" in said
    assert "N m/unit" not in said


def test_gains_that_moved_are_named(weighed_cell, capsys):
    off(weighed_cell, 3, 1.2, "moved.json")
    first, second = str(weighed_cell / "gains.toml"), str(weighed_cell / "moved.json")
    assert main(["verify", first, first, "--json"]) == 0
    assert not printed(capsys, "verify-gains")["moved"]
    assert main(["verify", first, second, "--json"]) == 1
    found = printed(capsys, "verify-gains")
    assert [each["joint"] for each in found["joints"] if each["moved"]] == [3]
    np.testing.assert_allclose(found["joints"][2]["rel_change"], 0.2, rtol=1e-9)
    assert main(["verify", first, second]) == 1
    said = capsys.readouterr().out
    assert "MOVED: joint 3 changed significantly (" in said
    assert "A and B share heavy.parquet, unloaded.parquet: their errors are correlated" in said


def test_gains_written_by_hand_are_compared_and_verdicts_have_their_measure(tmp_path, capsys):
    for name, values, extra in (("A", (2.0, 3.0, 5.0), 'name = "shoulder"'), ("B", (2.05, 3.0, 5.0), "")):
        entries = [f"[[gains]]\njoint = {k}\nestimate = {x}\nstd = {0.0075 * x}\n" for k, x in enumerate(values, 1)]
        (tmp_path / f"{name}.toml").write_text(entries[0] + f"{extra}\n" + "".join(entries[1:]))
    assert main(["verify", str(tmp_path / "A.toml"), str(tmp_path / "B.toml")]) == 0
    said = capsys.readouterr().out
    assert "shoulder" in said
    assert "MOVED beyond 2.39 standard deviations" in said
    assert "beyond 2, within 2.39 standard deviations: joint 1)." in said  # 2.3 deviations
    assert main(["verify", str(tmp_path / "A.toml"), str(tmp_path / "B.toml"), "--json"]) == 0
    assert printed(capsys, "verify-gains")["scale_joints"] == [1, 2, 3]


def test_a_change_of_a_single_common_joint_is_not_called_common_to_all(tmp_path, capsys):
    for name, joint_3 in (("A", "estimate = 2.0\nstd = 0.01"), ("B", "estimate = 2.2\nstd = 0.01")):
        refused = 'identifiable = false\nreason = "no payload"\n'
        text = f"[[gains]]\njoint = 1\n{refused}[[gains]]\njoint = 2\n{refused}[[gains]]\njoint = 3\n{joint_3}\n"
        (tmp_path / f"{name}.toml").write_text(text)
    assert main(["verify", str(tmp_path / "A.toml"), str(tmp_path / "B.toml")]) == 1
    said = capsys.readouterr().out
    assert "Only joint 3 has a gain in both files" in said
    assert "Change common to" not in said
    assert "for all joints together" not in said
    assert "MOVED: joint 3 changed significantly (+10 %, 2 sigma 1.5 %)." in said


def test_gains_that_moved_as_a_whole_name_the_joint_that_differs_from_the_common_factor(tmp_path, capsys):
    for name, logs in (("A", (0.0, 0.0, 0.0)), ("B", (-0.029, -0.029, 0.03))):
        values = [(k, x * np.exp(log)) for k, (x, log) in enumerate(zip((2.0, 3.0, 5.0), logs, strict=True), 1)]
        entries = [f"[[gains]]\njoint = {k}\nestimate = {x}\nstd = {0.01 * x}\n" for k, x in values]
        (tmp_path / f"{name}.toml").write_text("".join(entries))
    assert main(["verify", str(tmp_path / "A.toml"), str(tmp_path / "B.toml")]) == 1
    said = " ".join(capsys.readouterr().out.split())
    # Of 1.41 % each, 2.1 deviations are below the limit of 2.39; the mean has 0.82 % and leaves 1.15 % and 4.0 %.
    assert (
        "MOVED: the gains changed significantly as a whole (p = 0.0048), no single one did; relative to the common "
        "factor: joint 3, +4 %, 2 sigma 2.4 %."
    ) in said


def test_run_writes_the_gains_as_well(weighed_cell, tmp_path, capsys):
    out = tmp_path / "g.json"
    assert main(["run", str(weighed_cell / "quick.toml"), "--gains-out", str(out)]) in (0, 1)
    jsonschema.Draft202012Validator(schema("gains")).validate(json.loads(out.read_text()))
    written = read_gains(out)
    assert [each.payload for each in written.recordings] == [None, 1, 2]
    seen = {each.sha256 for each in read_gains(weighed_cell / "gains.toml").recordings}
    assert seen < {each.sha256 for each in written.recordings}  # simulated or read back, the digest is the same
    out.write_text("mine")
    assert main(["run", str(weighed_cell / "quick.toml"), "--gains-out", str(out)]) == 2
    assert "changed since rx90 run wrote it" in capsys.readouterr().err
    with pytest.raises(SystemExit, match="2"):
        main(["run", "nominal", "--gains-out", "gains.txt"])
    assert "expected a file name that ends with .json or .toml" in capsys.readouterr().err


def test_bare_recordings_alone_give_ratios(weighed_cell, capsys):
    words = [
        "identify",
        "--model",
        MODEL,
        "--unloaded",
        str(weighed_cell / "run" / "unloaded.parquet"),
        "--max-rel-std",
        "0.5",
        *PLAIN,
    ]
    assert main([*words, "--json"]) == 0
    found = printed(capsys, "identify-bare")
    assert len(found["joints"]) == 6
    assert all(0.0 < each["fitted_rel_error"] < each["predicted_rel_error"] for each in found["joints"])
    shown = [each for each in found["joints"] if each["ratio"] is not None]
    assert len(shown) >= 2
    assert (found["if_loaded"], found["consistent"]) == (None, None)
    assert "--gains" in found["consistent_reason"]
    assert not any("is predicted with an error" in each for each in found["notes"])
    reference = found["joints"][found["reference"] - 1]
    assert (reference["ratio"], reference["rel_std"]) == (1.0, 0.0)
    assert main([*words, "--gains", str(weighed_cell / "gains.toml")]) == 0
    said = capsys.readouterr().out
    assert f" to joint {found['reference']} is " in " ".join(said.split())
    assert "Essential base parameters, in SI" in said
    assert "Physically consistent links, in SI" in said
    assert "If the same motions" not in said
    payload = str(weighed_cell / "run" / "payload-heavy.toml")
    assert main([*words, "--gains", str(weighed_cell / "gains.toml"), "--if-loaded", payload, "--json"]) == 0
    found = printed(capsys, "identify-bare")
    assert found["if_loaded"]["mass"] > 0.0
    own = read_gains(weighed_cell / "gains.toml").gains
    assert [each["gain"] for each in found["joints"]] == [each.estimate for each in own]
    assert [each["joint"] for each in found["if_loaded"]["joints"]] == [1, 2, 3, 4, 5, 6]
    assert all((each["rel_std"] is None) == (each["reason"] is not None) for each in found["if_loaded"]["joints"])
    assert [each["mass"] > 0.0 for each in found["consistent"]["links"]] == [True] * 6
    assert found["consistent_reason"] is None
    for more, complaint in (
        (["--gains-out", str(weighed_cell / "none.toml")], "bare recordings give only ratios of gains"),
        (["--method", "ls-2011"], "--method ls-2011 needs a payload"),
        (["--if-loaded", payload], "the forecast needs approximate gains"),
    ):
        assert main([*words, *more]) == 2
        assert complaint in capsys.readouterr().err
    assert main([*identified(weighed_cell), "--gains", str(weighed_cell / "gains.toml")]) == 2
    assert "--gains: for bare recordings only" in capsys.readouterr().err
    assert main([*identified(weighed_cell), "--if-loaded", payload]) == 2
    assert "--if-loaded: for bare recordings only" in capsys.readouterr().err
    unloaded = str(weighed_cell / "run" / "unloaded.parquet")
    assert main(["identify", "--model", MODEL, "--unloaded", unloaded, "--cutoff-hz", "4000"]) == 2
    assert "4000 Hz" in capsys.readouterr().err


def test_gains_of_another_robot_and_a_data_sheet_of_another_sign_are_refused(weighed_cell, patching, capsys):
    file = read_gains(weighed_cell / "gains.toml").model_dump(mode="json", exclude_none=True)
    (weighed_cell / "stranger.json").write_text(json.dumps(file | {"robot": "ur10e"}))
    run, stranger = weighed_cell / "run", str(weighed_cell / "stranger.json")
    of_robot = "gains: of robot ur10e, but the model is of rx90; if both are one arm, write robot = 'rx90'"
    bare = ["--model", MODEL, "--unloaded", str(run / "unloaded.parquet")]
    weighed = ["--loaded", str(run / "light.parquet"), "--payload", str(run / "payload-light.toml")]
    turned = "gains to compare with: joint 3: -1.1, but its gain is"
    for words, message in (
        (with_other(patching, "--gains", stranger), of_robot),
        ([*patching, "--nominal", stranger], of_robot),
        (["verify", *bare, *weighed, "--gains", stranger], of_robot),
        (["identify", *bare, "--gains", stranger], of_robot),
        ([*identified(weighed_cell), *PLAIN, "--compare-with", stranger], of_robot),
        ([*identified(weighed_cell), *PLAIN, "--compare-with", "1,1,-1.1,1,1,1"], turned),
        (
            ["verify", *identified(weighed_cell)[1:], *PLAIN, *light(weighed_cell), "--compare-with", "1,1,-1.1,1,1,1"],
            turned,
        ),
    ):
        assert main(words) == 2
        assert message in only_line(capsys)
