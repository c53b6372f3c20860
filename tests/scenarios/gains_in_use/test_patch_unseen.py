"""`patch --unseen`: a copy of a model is written if it predicts a motion better than the model does."""

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from printed import printed
from weighed_cell import MODEL, elsewhere, heavier, off, with_other

import ident
import rx90_mjcf
from ident.model.arm import load_arm
from ident.model.structure import structure_of
from ident.parameters.arm import Parameter
from ident.parameters.links import nearest_links
from ident.recordings.files import write_recording
from scenarios.cli import main
from scenarios.experiments.gains_file import read_gains
from scenarios.experiments.robot_models import PLACEHOLDER, is_placeholder, model_base, nominal_links
from scenarios.results.links import links_document
from sim.errors import ModelFileError

pytestmark = pytest.mark.usefixtures("_computed_once")


def test_a_copy_that_predicts_better_is_written(patching, tmp_path, capsys):
    assert main([*patching, "--arm", str(tmp_path / "bare.json")]) == 0
    told = printed(capsys, "patch")
    assert (told["written"], told["unseen"]["verdict"]) == (True, "better")
    assert told["unseen"]["rel_error"] < 0.5 * told["unseen"]["other_rel_error"]
    assert (tmp_path / "patched.xml").exists()


def test_a_copy_that_predicts_no_better_is_written_by_force_alone(patching, tmp_path, capsys):
    assert main(patching) == 1
    told = printed(capsys, "patch")
    assert (told["written"], told["unseen"]["verdict"]) == (False, "no different")
    assert not (tmp_path / "patched.xml").exists()
    assert main([*patching, "--force"]) == 1
    assert printed(capsys, "patch")["written"]
    assert (tmp_path / "patched.xml").exists()


def test_a_right_copy_is_written_though_its_model_has_neither_rotor_inertia_nor_offsets(
    patching, weighed_cell, tmp_path, capsys
):
    drives = tomllib.loads((Path(MODEL).parent / "robot.toml").read_text())["drives"]
    base, gains = structure_of(load_arm(MODEL)).base, read_gains(weighed_cell / "gains.toml").gains
    inertia = base.standard(np.zeros((6, 10)), {"Ia": np.array(drives["rotor_inertia"]["value"])})
    whole = (model_base(Path(MODEL), None, base) + base.regrouping @ inertia) / gains[0].estimate
    bare = json.loads((tmp_path / "bare.json").read_text())
    bare["base_parameters"] = [
        {"parameter": name, "estimate": value, "std": 0.03 * value}
        for name, value in zip(base.names, whole.tolist(), strict=True)
        if name in ("ZZ1", "ZZ2", "Ia3", "Ia5")
    ]
    (tmp_path / "bare.json").write_text(json.dumps(bare))
    words = [*patching, "--arm", str(tmp_path / "bare.json")]
    off(weighed_cell, 2, 1.3, "off.json")
    good, wrong = str(weighed_cell / "gains.toml"), str(weighed_cell / "off.json")
    for more, verdict in (([], "better"), (["--nominal", wrong], "better"), (["--nominal", good], "no different")):
        (tmp_path / "patched.xml").unlink(missing_ok=True)
        assert main([*words, *more]) == 0
        told = printed(capsys, "patch")
        assert (told["written"], told["unseen"]["verdict"]) == (True, verdict)
        assert (tmp_path / "patched.xml").exists()
    joints = {each["joint"]: each for each in told["unseen"]["joints"]}
    assert min(joints[j]["unstated_rel"] for j in (1, 2)) > 0.03  # Ia1 and Ia2 are regrouped, so the copy has none
    assert max(joints[j]["rel_error"] for j in (1, 2, 3)) < 0.05
    assert [joints[j]["unstated_rel"] for j in (3, 5)] == [0.0, 0.0]  # these are written
    assert main([*with_other(words, "--gains", wrong), "--nominal", good]) == 1
    assert printed(capsys, "patch")["unseen"]["verdict"] == "worse"


def test_a_model_is_held_against_the_copy_with_its_own_gains(patching, weighed_cell, capsys):
    off(weighed_cell, 2, 1.4, "nominal.json")
    main(patching)
    same = printed(capsys, "patch")["unseen"]["joints"]
    main([*patching, "--nominal", str(weighed_cell / "nominal.json")])
    other = printed(capsys, "patch")["unseen"]["joints"]
    assert other[1]["other_rel_error"] != pytest.approx(same[1]["other_rel_error"], rel=0.02)
    assert [each["rel_error"] for each in other] == [each["rel_error"] for each in same]
    assert other[2]["other_rel_error"] == same[2]["other_rel_error"]


def test_a_copy_that_beats_the_model_and_predicts_nothing_is_not_written(patching, weighed_cell, tmp_path, capsys):
    words = [*patching, "--arm", str(tmp_path / "bare.json")]
    log = ident.read(weighed_cell / "run" / "light.parquet").recording
    write_recording(replace(log, v=1000.0 * log.v), tmp_path / "scaled.parquet")
    off(weighed_cell, 3, 2.0, "twice.json")
    cases = {
        ("--unseen", str(tmp_path / "scaled.parquet")): [1, 2, 3, 5],
        ("--unseen-payload", heavier(weighed_cell, 1.6, tmp_path)): None,
        ("--gains", str(weighed_cell / "twice.json")): [3],
    }
    for more, joints in cases.items():
        other = with_other(words, *more)
        assert main(other) == 1
        told = printed(capsys, "patch")
        beyond = [each["joint"] for each in told["unseen"]["joints"] if (each["rel_error"] or 0.0) > 0.15]
        assert beyond
        assert joints in (None, beyond)
        assert "link masses" not in [each["name"] for each in told["unseen"]["diagnoses"]]  # it carries a payload
        assert {each["largest_rel_error"] for each in told["unseen"]["joints"]} <= {None, 0.15}
        assert (told["written"], told["unseen"]["verdict"]) == (False, "better")
    assert main([word for word in other if word != "--json"]) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert "The prediction of light.parquet fails on joint 3 (" in out
    assert "); at most 15 % is expected. Its payload" in out
    assert "NOT WRITTEN: it does not pass; --force writes it." in out


def test_a_copy_is_held_against_the_same_arm_and_friction_with_the_gains_of_the_data_sheet(
    patching, weighed_cell, tmp_path, capsys
):
    words = [*patching, "--arm", str(tmp_path / "bare.json")]
    off(weighed_cell, 3, 1.6, "off.json")
    good, wrong = str(weighed_cell / "gains.toml"), str(weighed_cell / "off.json")
    assert main(with_other(words, "--gains", wrong)) == 1
    assert printed(capsys, "patch")["unseen"]["verdict"] == "better"  # than the model, which has no friction
    assert main([*with_other(words, "--gains", wrong), "--nominal", good]) == 1
    lost = printed(capsys, "patch")["unseen"]
    assert main([*words, "--nominal", wrong]) == 0
    won = printed(capsys, "patch")["unseen"]
    assert (lost["verdict"], won["verdict"]) == ("worse", "better")
    for one, other in ((lost, won), (won, lost)):
        # The copy of one is the rival of the other: friction in currents is that of bare.json, whatever the gain.
        assert [each["other_rel_error"] for each in other["joints"]] == [each["rel_error"] for each in one["joints"]]


def test_a_copy_with_links_of_bare_motions_is_to_predict_as_these_predict_each_other(patching, tmp_path, capsys):
    structure, nominal = structure_of(load_arm(MODEL)), nominal_links(Path(MODEL), None)
    b = model_base(Path(MODEL), None, structure.base).tolist()
    shown = [Parameter(name=k, unit="", value=v, std=0.01) for k, v in zip(structure.base.names, b, strict=True)]
    shown = [each for each in shown if each.name[0] not in "Fo"]  # friction and offsets are no links'
    found = nearest_links(structure.base, shown, 1e-4 * np.eye(len(shown)), nominal)
    bare = json.loads((tmp_path / "bare.json").read_text())
    bare["joints"][2] |= {"predicted_rel_error": 0.031, "fitted_rel_error": 0.022}
    bare["consistent"] = links_document(found, nominal, structure.arm).model_dump(mode="json")
    (tmp_path / "links.json").write_text(json.dumps(bare))
    words = [*patching, "--arm", str(tmp_path / "links.json")]
    main(words)
    assert {each["largest_rel_error"] for each in printed(capsys, "patch")["unseen"]["joints"]} <= {None, 0.15}
    main([*words, "--links"])
    joints = printed(capsys, "patch")["unseen"]["joints"]
    assert [each["fitted_rel_error"] for each in joints] == [None, None, 0.022, None, None, None]
    # The deviations of gain and payload add a little to three times 3.1 %.
    assert [joints[1]["largest_rel_error"], joints[2]["largest_rel_error"]] == [0.15, pytest.approx(0.093, rel=0.05)]
    heavier = [replace(each, value=1.3 * each.value) for each in shown]
    found = nearest_links(structure.base, heavier, 1e-4 * np.eye(len(shown)), nominal)
    bare["consistent"] = links_document(found, nominal, structure.arm).model_dump(mode="json")
    (tmp_path / "links.json").write_text(json.dumps(bare))
    main([*words, "--links", "--nominal", words[words.index("--gains") + 1]])
    joints = printed(capsys, "patch")["unseen"]["joints"]  # of equal gains the rival has the same links
    assert [each["rel_error"] for each in joints] == [each["other_rel_error"] for each in joints]


def test_a_copy_says_what_a_bare_motion_and_the_model_as_it_is_do_not_test(patching, weighed_cell, tmp_path, capsys):
    words = patching[: patching.index("--unseen")]
    words += ["--unseen", str(weighed_cell / "run" / "unloaded.parquet")]
    large, sound = (elsewhere(weighed_cell, factor, tmp_path / f"{factor}.json") for factor in (2.3, 1.03))
    for gains, doubted in ((large, True), (sound, False)):
        main(with_other(words, "--gains", gains))
        out = " ".join(capsys.readouterr().out.split())
        assert ("WARNING: with these gains the arm's masses are 2." in out) is doubted
        assert "the gains are tested against the link masses in that file" in out
        assert "this comparison does not test the gains. Give --nominal" in out
    main([*with_other(words, "--gains", sound), "--nominal", large])
    assert "does not test the gains" not in " ".join(capsys.readouterr().out.split())


def test_a_file_of_kinematics_alone_predicts_nothing(tmp_path):
    links = nominal_links(rx90_mjcf.MJCF, None)
    assert not is_placeholder(links)
    assert is_placeholder(replace(links, own=np.tile(PLACEHOLDER, (6, 1))))
    text = '<body pos="0 0 {0}"><joint axis="0 1 0"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
    path = tmp_path / "bare.xml"
    path.write_text(f"<mujoco><worldbody>{text.format(0.3)}{text.format(0.7)}</body></body></worldbody></mujoco>")
    with pytest.raises(ModelFileError, match=r"bare\.xml: the model file has the kinematics only"):
        model_base(path, None, structure_of(load_arm(path)).base)
