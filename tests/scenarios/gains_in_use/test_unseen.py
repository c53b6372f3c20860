"""`--unseen` of identify, verify and patch: what is told, what passes, what is written, what is refused."""

import json
import re
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bad_files import only_line
from printed import printed
from weighed_cell import MODEL, identified, off

import ident
import rx90_mjcf
from ident.model.arm import load_arm
from ident.model.structure import structure_of
from ident.recordings.files import write_recording
from scenarios.cli import main
from scenarios.experiments.files.gains import read_gains
from scenarios.experiments.nominal_links import PLACEHOLDER, is_placeholder, model_base, nominal_links
from scenarios.results.models.run import Result
from scenarios.results.record import read_result
from sim.errors import ModelFileError

PLAIN = ["--option", "friction=viscous-coulomb"]


def light(cell: Path) -> list[str]:
    run = cell / "run"
    return ["--unseen", str(run / "light.parquet"), "--unseen-payload", str(run / "payload-light.toml")]


@pytest.fixture
def sheet(weighed_cell) -> str:
    """Gains that are off up and down."""
    off(weighed_cell, 3, 1.2, "sheet.json")
    return str(weighed_cell / "sheet.json")


def test_identify_predicts_a_motion_better_than_a_data_sheet(weighed_cell, tmp_path, sheet, capsys):
    words = [*identified(weighed_cell), *PLAIN, *light(weighed_cell), "--compare-with", sheet]
    assert main([*words, "--json", "--save", str(tmp_path / "saved")]) == 0
    unseen = printed(capsys, "result")["unseen"]
    assert (unseen["verdict"], unseen["loaded"]) == ("better", True)
    third = unseen["joints"][2]
    assert third["other_rel_error"] > 2.0 * third["rel_error"]
    assert third["explained"] == 1.0 - third["rel_error"] ** 2
    # Noise of the same size on both motions: what was not fitted to is predicted about as well.
    np.testing.assert_allclose(third["rel_error"], third["fitted_rel_error"], rtol=0.5)
    assert read_result(tmp_path / "saved", Result).unseen.model_dump(mode="json") == unseen
    page = tmp_path / "page.html"
    assert main(["report", str(tmp_path / "saved"), "--out", str(page)]) == 0
    assert "A motion that no fit has seen" in page.read_text(encoding="utf-8")
    capsys.readouterr()
    assert main(words) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert re.search(
        r"PASSED: prediction error [\d.]+ % with the gains found, [\d.]+ % with the others, of the currents of", out
    )


def test_gains_as_good_as_those_found_fail_the_gate(weighed_cell, capsys):
    words = [*identified(weighed_cell), *PLAIN, *light(weighed_cell)]
    assert main([*words, "--compare-with", str(weighed_cell / "gains.toml")]) == 1
    assert "no more than chance" in " ".join(capsys.readouterr().out.split())
    assert main(words) == 0


def test_verify_predicts_with_the_gains_of_a_file_and_with_those_it_finds(weighed_cell, sheet, capsys):
    run, good = weighed_cell / "run", str(weighed_cell / "gains.toml")
    bare = ["--model", MODEL, "--unloaded", str(run / "unloaded.parquet")]
    weighed = ["--loaded", str(run / "light.parquet"), "--payload", str(run / "payload-light.toml")]
    words = ["verify", *bare, *weighed, *light(weighed_cell), "--json"]
    assert main([*words, "--gains", good, "--compare-with", sheet]) == 0
    by_file = printed(capsys, "verify")
    assert (by_file["passed"], by_file["unseen"]["verdict"]) == (True, "better")
    assert main([*words, "--gains", sheet, "--compare-with", good]) == 1
    assert printed(capsys, "verify")["unseen"]["verdict"] == "worse"
    words = ["verify", *identified(weighed_cell)[1:], *PLAIN, *light(weighed_cell), "--json"]
    assert main([*words, "--compare-with", sheet]) == 0
    found = printed(capsys, "verify-motions")["unseen"]
    np.testing.assert_allclose(found["rel_error"], by_file["unseen"]["rel_error"], rtol=1e-3)
    assert main([*words, "--compare-with", good]) == 1


def test_python_says_the_same_as_the_command(weighed_cell, sheet, capsys):
    run = weighed_cell / "run"
    assert main([*identified(weighed_cell), *light(weighed_cell), "--compare-with", sheet, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["unseen"]
    heavy = ident.read(run / "heavy.parquet", payload=run / "payload-heavy.toml")
    found = ident.identify(ident.load_arm(MODEL), [ident.read(run / "unloaded.parquet"), heavy])
    log = ident.read(run / "light.parquet", payload=run / "payload-light.toml")
    unseen = ident.predict_unseen(found, log, other=read_gains(Path(sheet)).known)
    np.testing.assert_allclose([unseen.rel_error, unseen.other_rel_error], [told["rel_error"], told["other_rel_error"]])


@pytest.fixture
def patching(weighed_cell, tmp_path) -> list[str]:
    """Words that write a copy of the model; and what bare motions say of friction, as it is."""
    shutil.copy(MODEL, tmp_path / "arm.xml")
    gains = read_gains(weighed_cell / "gains.toml").gains
    drives = tomllib.loads((Path(MODEL).parent / "robot.toml").read_text())["drives"]

    def friction(name: str, key: str, j: int) -> dict[str, object]:
        return {"parameter": name, "estimate": drives[key]["value"][j] / (gains[j].estimate or 1.0), "std": 0.01}

    both = {"Fv": "viscous_friction", "Fc": "coulomb_friction"}
    joints = [
        {"joint": j + 1, "name": each.name, "friction": [friction(name, key, j) for name, key in both.items()]}
        for j, each in enumerate(gains)
    ]
    (tmp_path / "bare.json").write_text(json.dumps({"reference": 1, "joints": joints, "base_parameters": []}))
    files = ["--gains", str(weighed_cell / "gains.toml"), "--out", str(tmp_path / "patched.xml")]
    return ["patch", str(tmp_path / "arm.xml"), *files, *light(weighed_cell), "--json"]


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


def test_a_model_is_held_against_the_copy_with_its_own_gains(patching, weighed_cell, capsys):
    off(weighed_cell, 2, 1.4, "nominal.json")
    main(patching)
    same = printed(capsys, "patch")["unseen"]["joints"]
    main([*patching, "--nominal", str(weighed_cell / "nominal.json")])
    other = printed(capsys, "patch")["unseen"]["joints"]
    assert other[1]["other_rel_error"] != pytest.approx(same[1]["other_rel_error"], rel=0.02)
    assert [each["rel_error"] for each in other] == [each["rel_error"] for each in same]
    assert other[2]["other_rel_error"] == same[2]["other_rel_error"]


def test_a_motion_that_a_fit_has_seen_or_whose_load_is_not_known_is_refused(weighed_cell, tmp_path, capsys):
    run = weighed_cell / "run"
    words = [*identified(weighed_cell), *PLAIN]
    (tmp_path / "mass.toml").write_text("mass = 4.275\nknown = 'mass'\n")
    recording = ident.read(run / "light.parquet").recording
    write_recording(replace(recording, v=1000.0 * recording.v), tmp_path / "scaled.parquet")
    cases = {
        ("--unseen", str(run / "unloaded.parquet")): "hold the same motion",
        ("--unseen", str(tmp_path / "scaled.parquet")): "if it carries a payload, state it",
        (*light(weighed_cell)[:3], str(tmp_path / "mass.toml")): "state mass and centre of mass",
        ("--unseen-payload", str(tmp_path / "mass.toml")): "add --unseen LOG",
        ("--unseen", "absent.parquet"): "absent.parquet: no such file",
    }
    for more, message in cases.items():
        assert main([*words, *more]) == 2
        assert message in only_line(capsys)
    patched = ["patch", MODEL, "--gains", str(weighed_cell / "gains.toml"), "--out", str(tmp_path / "new.xml")]
    assert main([*patched, "--unseen", str(run / "heavy.parquet")]) == 2
    assert "the gains were identified from this recording" in only_line(capsys)
    assert main([*words[:5], "--unseen", str(run / "light.parquet")]) == 2
    assert "--unseen: bare recordings give no gains to predict with" in only_line(capsys)
    assert main(["verify", *words[1:], "--compare-with", "1,1,1,1,1,1"]) == 2
    assert "--compare-with: no motion is given to predict with both" in only_line(capsys)


def test_a_file_of_kinematics_alone_predicts_nothing(tmp_path):
    links = nominal_links(rx90_mjcf.MJCF, None)
    assert not is_placeholder(links)
    assert is_placeholder(replace(links, own=np.tile(PLACEHOLDER, (6, 1))))
    text = '<body pos="0 0 {0}"><joint axis="0 1 0"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
    path = tmp_path / "bare.xml"
    path.write_text(f"<mujoco><worldbody>{text.format(0.3)}{text.format(0.7)}</body></body></worldbody></mujoco>")
    with pytest.raises(ModelFileError, match=r"bare\.xml: the model file has the kinematics only"):
        model_base(path, None, structure_of(load_arm(path)).base)
