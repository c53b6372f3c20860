"""`rx90 verify`, `payload-of`, `torque`, `compare-gains`: from recordings and a gains file to what is told."""

import json
from pathlib import Path

import jsonschema
import numpy as np
import pandas as pd
import pytest
from printed import printed
from quick import quick_scenario

import rx90_mjcf
from ident.recording_files import read_recording
from scenarios.cli import main
from scenarios.files.gains import read_gains
from scenarios.files.json_schema import schemas

TWO_WEIGHTS = """
[experiment.controller]
bandwidth_hz = 8.0
[plant.payloads]
light = "4.275 kg"
heavy = "7.025 kg"
[belief.payloads]
light = "4.275 kg"
heavy = "7.025 kg"
"""
MODEL = str(rx90_mjcf.MJCF)


@pytest.fixture(scope="module")
def cell(tmp_path_factory) -> Path:
    """Recordings bare, light and heavy in a folder, and gains.toml from bare and heavy."""
    folder = tmp_path_factory.mktemp("cell")
    path = quick_scenario(folder, TWO_WEIGHTS, method="nls")
    text = path.read_text().replace(
        'motion = "short.toml"', 'motion = "short.toml"\nprotocol = ["bare", "light", "heavy"]'
    )
    path.write_text(text)
    main(["run", str(path), "--save", str(folder / "run")])
    words = [*identified(folder), "--gains-out", str(folder / "gains.toml")]
    words += ["--option", "friction=viscous-coulomb"]  # data need not choose what is known, which takes longer
    assert main(words) == 0
    return folder


def identified(cell: Path) -> list[str]:
    run = cell / "run"
    return ["identify", "--model", MODEL, "--unloaded", str(run / "unloaded.parquet"),
            "--loaded", str(run / "heavy.parquet"), "--payload", str(run / "payload-heavy.toml")]  # fmt: skip


def verified(cell: Path, *more: str, which: str = "light", gains: str = "gains.toml") -> list[str]:
    run = cell / "run"
    loaded = ["--loaded", str(run / f"{which}.parquet"), "--payload", str(run / f"payload-{which}.toml")]
    return ["verify", "--model", MODEL, "--gains", str(cell / gains), "--unloaded", str(run / "unloaded.parquet"),
            *loaded, *more]  # fmt: skip


def told(capsys) -> dict:
    return json.loads(capsys.readouterr().out)


def off(cell: Path, joint: int, factor: float, name: str) -> None:
    """A copy of the gains with one of them off."""
    file = read_gains(cell / "gains.toml").model_dump(mode="json", exclude_none=True)
    at = [each["joint"] for each in file["gains"] if each["identifiable"]].index(joint)
    file["gains"][joint - 1]["estimate"] *= factor
    file["gains"][joint - 1]["std"] *= factor
    for k in range(len(file["covariance"])):
        file["covariance"][at][k] *= factor
        file["covariance"][k][at] *= factor
    (cell / name).write_text(json.dumps(file))


def test_a_weight_that_identification_has_not_seen_verifies_its_gains(cell, capsys):
    assert main(verified(cell, "--json")) == 0
    found = printed(capsys, "verify")
    assert found["passed"]
    assert found["together"]["verdict"] == "agrees"
    assert found["mass"] == 4.275
    assert abs(found["together"]["mass"] - 4.275) < 4.0 * found["together"]["std"]
    assert [each["joint"] for each in found["joints"]] == [1, 2, 3, 4, 5, 6]
    assert {each["quantity"] for each in found["payload"]} >= {"mass", "x", "y", "z"}


def test_a_gain_that_is_off_is_named_by_its_joint(cell, capsys):
    off(cell, 3, 1.2, "off.json")
    assert main(verified(cell, "--json", gains="off.json")) == 1
    found = printed(capsys, "verify")
    assert not found["passed"]
    assert [each["joint"] for each in found["joints"] if each["verdict"] == "differs"] == [3]
    third = found["joints"][2]
    assert abs(third["rel_error"] - 0.2) < 4.0 * third["rel_std"]
    assert main(verified(cell, gains="off.json")) == 1
    assert "MISSED: gains are off: joint 3 by +" in capsys.readouterr().out


def test_gains_are_not_verified_by_what_they_were_found_from(cell, capsys):
    assert main(verified(cell, which="heavy")) == 2
    assert "heavy.parquet: the gains were found from this recording" in capsys.readouterr().err


def test_without_gains_the_motions_predict_each_other(cell, capsys):
    assert main(["verify", *identified(cell)[1:], "--json"]) == 0
    found = printed(capsys, "verify-motions")
    assert [each["joint"] for each in found["joints"]] == [1, 2, 3, 4, 5, 6]
    assert all(each["fitted_rel_error"] < each["predicted_rel_error"] < 1.0 for each in found["joints"])


def test_a_verification_weighs_one_payload(cell, capsys):
    light = cell / "run" / "light.parquet"
    more = ["--loaded", str(light), "--payload", str(cell / "run" / "payload-light.toml")]
    assert main(verified(cell, *more)) == 2
    assert "2 payloads are given" in capsys.readouterr().err
    words = verified(cell)
    words = [*words[:5], *words[7:]]  # no bare motion
    assert main(words) == 2
    assert "no motion is bare" in capsys.readouterr().err


def test_an_unknown_payload_is_found_with_the_gains(cell, capsys):
    run = cell / "run"
    words = ["payload-of", str(run / "light.parquet"), "--gains", str(cell / "gains.toml"), "--model", MODEL,
             "--unloaded", str(run / "unloaded.parquet")]  # fmt: skip
    assert main([*words, "--json"]) == 0
    found = printed(capsys, "payload-of")
    body = {each["quantity"]: each for each in found["body"]}
    for name, true in {"mass": 4.275, "x": 0.0, "y": 0.0, "z": 0.12016}.items():
        assert abs(body[name]["estimate"] - true) < 4.0 * body[name]["std"], name
        parts = [body[name][f"{share}_std"] for share in ("residual", "gain", "model")]
        np.testing.assert_allclose(body[name]["std"], np.linalg.norm(parts), rtol=1e-9)
    assert len(found["parameters"]) == len(found["covariance"]) == 10
    assert {each["verdict"] for each in found["joints"]} <= {"agrees", "says nothing"}
    assert main(words) == 0
    assert "mass " in (said := capsys.readouterr().out)
    assert "disagree" not in said


def weighed(cell: Path, *more: str, loaded: str = "light", unloaded: str = "unloaded", gains: str = "gains.toml"):
    run = cell / "run"
    return ["payload-of", str(run / f"{loaded}.parquet"), "--gains", str(cell / gains), "--model", MODEL,
            "--unloaded", str(run / f"{unloaded}.parquet"), *more]  # fmt: skip


@pytest.mark.parametrize(
    ("loaded", "unloaded", "words"),
    [
        ("unloaded", "light", "probably swapped"),
        ("heavy", "unloaded", "the gains were found from this recording"),
        ("light", "heavy", "given as bare, but it carried a payload when the gains were found"),
    ],
)
def test_a_payload_is_not_found_from_what_cannot_show_it(cell, capsys, loaded, unloaded, words):
    if words == "probably swapped":  # which the gains file would tell, did it know the recordings
        file = read_gains(cell / "gains.toml").model_dump(mode="json", exclude_none=True)
        (cell / "stranger.json").write_text(json.dumps(file | {"recordings": []}))
    gains = "stranger.json" if words == "probably swapped" else "gains.toml"
    assert main(weighed(cell, loaded=loaded, unloaded=unloaded, gains=gains)) == 2
    assert words in capsys.readouterr().err


def test_joints_that_disagree_on_the_mass_are_named(cell, capsys):
    off(cell, 2, 2.0, "doubled.json")
    assert main(weighed(cell, gains="doubled.json")) == 0
    assert "WARNING: joints disagree on the mass: alone, " in (words := capsys.readouterr().out)
    assert "joint 2 says" in words


@pytest.mark.parametrize("command", ["torque", "convert"])
def test_a_log_is_not_written_over_by_what_is_made_of_it(cell, tmp_path, capsys, command):
    log = tmp_path / "log.parquet"
    log.write_bytes((cell / "run" / "light.parquet").read_bytes())
    gains = ["--gains", str(cell / "gains.toml")] if command == "torque" else []
    assert main([command, str(log), *gains, "--out", str(tmp_path / "." / "log.parquet"), "--force"]) == 2
    assert f"log.parquet: rx90 {command} reads this file" in capsys.readouterr().err
    assert log.read_bytes() == (cell / "run" / "light.parquet").read_bytes()


def test_torques_are_written_with_units_and_intervals(cell, capsys):
    log, out = cell / "run" / "light.parquet", cell / "torque.parquet"
    words = ["torque", str(log), "--gains", str(cell / "gains.toml"), "--out", str(out)]
    assert main(words) == 0
    said, missing = capsys.readouterr().out, []
    assert main([*words, "--json"]) == 0
    document = printed(capsys, "torque")
    table, recording, gains = pd.read_parquet(out), read_recording(log), read_gains(cell / "gains.toml")
    for entry in gains.gains:
        if not entry.identifiable:
            assert f"tau{entry.joint}" not in table
            assert f"joint {entry.joint} has no column" in said
            missing.append(entry.joint)
            continue
        tau, v = table[f"tau{entry.joint}"], recording.v[:, entry.joint - 1]
        np.testing.assert_allclose(tau, entry.estimate * v, rtol=1e-12)
        np.testing.assert_allclose(table[f"tau{entry.joint}_high"] - tau, 2.0 * entry.std * np.abs(v), atol=1e-9)
        np.testing.assert_allclose(tau - table[f"tau{entry.joint}_low"], 2.0 * entry.std * np.abs(v), atol=1e-9)
    assert [each["joint"] for each in document["missing"]] == missing
    assert document["joints"] == [entry.joint for entry in gains.gains if entry.identifiable]
    assert document["samples"] == len(recording.t)
    assert main(["torque", str(log), "--gains", str(cell / "gains.toml"), "--out", str(cell / "gains.toml")]) == 2
    assert "rx90 torque reads this file" in capsys.readouterr().err


SIGNED = (13, 11, 7, -9, 12, 8)


def test_torques_of_a_negative_gain_come_with_a_note(cell, tmp_path, capsys):
    values = "".join(f"[[gains]]\njoint = {j + 1}\nestimate = {g}\nstd = 0\n" for j, g in enumerate(SIGNED))
    gains = tmp_path / "gains.toml"
    gains.write_text(values)
    words = ["torque", str(cell / "run" / "light.parquet"), "--gains", str(gains), "--out", str(tmp_path / "t.parquet")]
    assert main(words) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert said.count("but negative") == said.count("Note: joint 4: identified, but negative") == 1
    assert main([*words, "--json"]) == 0
    (note,) = printed(capsys, "torque")["notes"]
    assert note.startswith("joint 4: ")
    gains.write_text(values.replace("-9", "9"))
    assert main([*words, "--json"]) == 0
    assert printed(capsys, "torque")["notes"] == []


def test_torques_of_joints_in_another_order_than_the_gains_are_refused(cell, capsys):
    words = ["torque", str(cell / "run" / "light.parquet"), "--gains", str(cell / "gains.toml")]
    turned = "joint2,joint1,joint3,joint4,joint5,joint6"
    assert main([*words, "--out", str(cell / "turned.parquet"), "--joints", turned]) == 2
    assert "joints are said to be joint2, joint1" in capsys.readouterr().err
    assert not (cell / "turned.parquet").exists()
    # Gains written by hand need no names, and then nothing is known of the order.
    text = (cell / "gains.toml").read_text()
    (cell / "nameless.toml").write_text("".join(x for x in text.splitlines(True) if not x.startswith('name = "joint')))
    words[3] = str(cell / "nameless.toml")
    assert main([*words, "--out", str(cell / "turned.parquet"), "--joints", turned]) == 0


def test_gains_of_a_joint_that_turns_and_of_one_that_slides_are_not_compared(cell, capsys):
    first, text = str(cell / "gains.toml"), (cell / "gains.toml").read_text()
    place = text.index("joint = 3")
    slides = text[:place] + text[place:].replace("N m / drive unit", "N / drive unit", 1)
    (cell / "slides.toml").write_text(slides)
    assert main(["compare-gains", first, str(cell / "slides.toml")]) == 2
    assert "joint 3: its gain is in N m / drive unit in A and in N / drive unit in B" in capsys.readouterr().err
    assert main(["compare-gains", str(cell / "slides.toml"), str(cell / "slides.toml")]) == 0
    assert "N (m)/unit" in capsys.readouterr().out
    (cell / "slides.toml").write_text(text.replace("N m / drive unit", "N / drive unit"))
    assert main(["compare-gains", str(cell / "slides.toml"), str(cell / "slides.toml")]) == 0
    said = capsys.readouterr().out
    assert "N/unit" in said
    assert "N m/unit" not in said


def test_gains_that_moved_are_named(cell, capsys):
    off(cell, 3, 1.2, "moved.json")
    first, second = str(cell / "gains.toml"), str(cell / "moved.json")
    assert main(["compare-gains", first, first, "--json"]) == 0
    assert not printed(capsys, "compare-gains")["moved"]
    assert main(["compare-gains", first, second, "--json"]) == 1
    found = printed(capsys, "compare-gains")
    assert [each["joint"] for each in found["joints"] if each["moved"]] == [3]
    np.testing.assert_allclose(found["joints"][2]["rel_change"], 0.2, rtol=1e-9)
    assert main(["compare-gains", first, second]) == 1
    said = capsys.readouterr().out
    assert "MOVED: joint 3 beyond the interval." in said
    assert "both are from heavy.parquet, unloaded.parquet" in said


def test_gains_written_by_hand_are_compared_and_verdicts_have_their_measure(tmp_path, capsys):
    for name, values, extra in (("A", (2.0, 3.0, 5.0), 'name = "shoulder"'), ("B", (2.05, 3.0, 5.0), "")):
        entries = [f"[[gains]]\njoint = {k}\nestimate = {x}\nstd = {0.0075 * x}\n" for k, x in enumerate(values, 1)]
        (tmp_path / f"{name}.toml").write_text(entries[0] + f"{extra}\n" + "".join(entries[1:]))
    assert main(["compare-gains", str(tmp_path / "A.toml"), str(tmp_path / "B.toml")]) == 0
    said = capsys.readouterr().out
    assert "shoulder" in said
    assert "MOVED beyond 2.39 deviations" in said
    assert "SAME: no gain moved beyond its interval, joint 1 beyond 2 sigma" in said  # 2.3 deviations
    assert main(["compare-gains", str(tmp_path / "A.toml"), str(tmp_path / "B.toml"), "--json"]) == 0
    assert printed(capsys, "compare-gains")["scale_joints"] == [1, 2, 3]


def test_run_writes_the_gains_as_well(cell, tmp_path, capsys):
    out = tmp_path / "g.json"
    assert main(["run", str(cell / "quick.toml"), "--gains-out", str(out)]) in (0, 1)
    jsonschema.Draft202012Validator(schemas()["gains"]).validate(json.loads(out.read_text()))
    written = read_gains(out)
    assert [each.payload for each in written.recordings] == [None, 1, 2]
    seen = {each.sha256 for each in read_gains(cell / "gains.toml").recordings}
    assert seen < {each.sha256 for each in written.recordings}  # simulated or read back, the digest is the same
    out.write_text("mine")
    assert main(["run", str(cell / "quick.toml"), "--gains-out", str(out)]) == 2
    assert "changed since rx90 run wrote it" in capsys.readouterr().err
    with pytest.raises(SystemExit, match="2"):
        main(["run", "nominal", "--gains-out", "gains.txt"])
    assert "expected a file that ends with .json or .toml" in capsys.readouterr().err


def test_bare_recordings_alone_give_ratios(cell, capsys):
    words = ["identify", "--model", MODEL, "--unloaded", str(cell / "run" / "unloaded.parquet"), "--max-rel-std", "0.5"]
    words += ["--option", "friction=viscous-coulomb"]
    assert main([*words, "--json"]) == 0
    found = printed(capsys, "identify-bare")
    assert len(found["joints"]) == 6
    shown = [each for each in found["joints"] if each["ratio"] is not None]
    assert len(shown) >= 2
    assert (found["if_loaded"], found["consistent"]) == (None, None)
    assert "--gains" in found["consistent_reason"]
    assert not any("is predicted within" in each for each in found["notes"])
    reference = found["joints"][found["reference"] - 1]
    assert (reference["ratio"], reference["rel_std"]) == (1.0, 0.0)
    assert main([*words, "--gains", str(cell / "gains.toml")]) == 0
    said = capsys.readouterr().out
    assert f"what joint {found['reference']} says" in said
    assert "Essential base parameters, in SI" in said
    assert "Links as bodies, in SI" in said
    assert "If the same motions" not in said
    payload = str(cell / "run" / "payload-heavy.toml")
    assert main([*words, "--gains", str(cell / "gains.toml"), "--if-loaded", payload, "--json"]) == 0
    found = printed(capsys, "identify-bare")
    assert found["if_loaded"]["mass"] > 0.0
    assert [each["joint"] for each in found["if_loaded"]["joints"]] == [1, 2, 3, 4, 5, 6]
    assert all((each["rel_std"] is None) == (each["reason"] is not None) for each in found["if_loaded"]["joints"])
    assert [each["mass"] > 0.0 for each in found["consistent"]["links"]] == [True] * 6
    assert found["consistent_reason"] is None
    for more, complaint in (
        (["--gains-out", str(cell / "none.toml")], "bare recordings give ratios of gains alone"),
        (["--method", "ls-2011"], "--method ls-2011 needs a payload"),
        (["--if-loaded", payload], "takes the size of the gains"),
    ):
        assert main([*words, *more]) == 2
        assert complaint in capsys.readouterr().err
    assert main([*identified(cell), "--gains", str(cell / "gains.toml")]) == 2
    assert "--gains goes with bare recordings alone" in capsys.readouterr().err
    assert main([*identified(cell), "--if-loaded", payload]) == 2
    assert "--if-loaded goes with bare recordings alone" in capsys.readouterr().err


def test_options_that_the_gains_were_found_with_hold_until_others_are_given(cell, capsys):
    file = read_gains(cell / "gains.toml")
    from scenarios.weighing.problem import model_options, observe_options

    shorter = file.model_copy(
        update={
            "options": file.options.model_copy(
                update={
                    "method": {"friction": "cbrt", "gain_joint": 2, "gain_value": 1.5},
                    "observe": {"cutoff_hz": 9.0},
                }
            )
        }
    )
    chosen = model_options(shorter, ["prior-std=2"])
    assert (chosen.friction, chosen.prior_std, chosen.gain_joint) == ("cbrt", 2.0, None)
    assert observe_options(shorter, ["reversal_speed=0.2"]).cutoff_hz == 9.0
    assert observe_options(shorter, ["cutoff_hz=8"]).cutoff_hz == 8.0
    others = shorter.model_copy(update={"method": "ls-2011"})
    assert model_options(others, []).friction == "viscous-coulomb"
    assert main(verified(cell, "--observe", "cutof_hz=3")) == 2
    assert "unknown option 'cutof_hz'" in capsys.readouterr().err
