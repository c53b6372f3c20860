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
from ident.arm_parameters.links import nearest_links
from ident.arm_parameters.parameter_values import Parameter
from ident.model.arm import load_arm
from ident.model.structure import structure_of
from ident.numerics.signals import low_passed
from ident.recordings.files import write_recording
from scenarios.cli import main
from scenarios.experiments.files.gains import read_gains
from scenarios.experiments.nominal_links import PLACEHOLDER, is_placeholder, model_base, nominal_links
from scenarios.reports.unseen import unseen_verdict
from scenarios.results.models.links import links_document
from scenarios.results.models.run import Result
from scenarios.results.models.unseen import ResultUnseen, UnseenJoint
from scenarios.results.record import read_result
from sim.errors import ModelFileError

pytestmark = pytest.mark.usefixtures("_computed_once")
PLAIN = ["--option", "friction=viscous-coulomb"]


def light(cell: Path) -> list[str]:
    run = cell / "run"
    return ["--unseen", str(run / "light.parquet"), "--unseen-payload", str(run / "payload-light.toml")]


def heavier(cell: Path, factor: float, folder: Path) -> str:
    """A copy of the light payload's file that states more mass than it has."""
    text = (cell / "run" / "payload-light.toml").read_text()
    mass = tomllib.loads(text)["mass"]
    path = folder / "heavier.toml"
    path.write_text(text.replace(f"mass = {mass}", f"mass = {factor * mass}"))
    return str(path)


def with_other(words: list[str], option: str, value: str) -> list[str]:
    at = words.index(option) + 1
    return [*words[:at], value, *words[at + 1 :]]


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
    assert "A motion that was not used in any fit" in page.read_text(encoding="utf-8")
    capsys.readouterr()
    assert main(words) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert re.search(
        r"PASSED: prediction error [\d.]+ % with the identified gains, [\d.]+ % with the others, of the currents of",
        out,
    )


def test_a_payload_that_is_not_as_stated_fails_however_bad_the_data_sheet_is(weighed_cell, tmp_path, capsys):
    words = [*identified(weighed_cell), *PLAIN, *light(weighed_cell)[:2], "--json"]
    wrong = ["--unseen-payload", heavier(weighed_cell, 1.8, tmp_path)]
    assert main([*words, *wrong, "--compare-with", "0.5,0.5,0.5,0.5,0.5,0.5"]) == 1
    unseen = printed(capsys, "result")["unseen"]
    assert unseen["verdict"] == "better"
    beyond = [each for each in unseen["joints"] if (each["rel_error"] or 0.0) > (each["largest_rel_error"] or 0.0)]
    assert beyond
    assert all(each["largest_rel_error"] > 3.0 * each["fitted_rel_error"] for each in beyond)
    assert main([*words[:-1], *wrong]) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert re.search(r"FAILED: prediction error [\d.]+ % of the currents of light.parquet, not used in any fit", out)
    assert f"The prediction of light.parquet fails on joint {beyond[0]['joint']} (" in out


def test_a_payload_a_little_off_is_a_warning_and_one_that_no_friction_explains_fails(weighed_cell, tmp_path, capsys):
    words = [*identified(weighed_cell), *PLAIN, *light(weighed_cell)[:2], "--unseen-payload"]
    for factor, status, said in (
        (1.12, 0, "WARNING: according to the payload on this motion, gains are off by -1"),
        (1.25, 1, "By its payload the gains are off by -2"),
    ):
        assert main([*words, heavier(weighed_cell, factor, tmp_path)]) == status
        out = " ".join(capsys.readouterr().out.split())
        assert said in out
        assert "rx90 verify" in out
    assert main([*words, light(weighed_cell)[3]]) == 0
    assert "according to the payload" not in " ".join(capsys.readouterr().out.split())


def test_gains_as_good_as_those_found_fail_the_gate(weighed_cell, capsys):
    words = [*identified(weighed_cell), *PLAIN, *light(weighed_cell)]
    assert main([*words, "--compare-with", str(weighed_cell / "gains.toml")]) == 1
    assert "the difference is not significant" in " ".join(capsys.readouterr().out.split())
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


def elsewhere(cell: Path, factor: float, path: Path) -> str:
    """A copy of the gains, all of them a factor too large, as if they were found from other motions."""
    file = read_gains(cell / "gains.toml").model_dump(mode="json", exclude_none=True)
    for each in file["gains"]:
        each |= {key: factor * each[key] for key in ("estimate", "std") if key in each}
    file["covariance"] = (factor**2 * np.array(file["covariance"])).tolist()
    path.write_text(json.dumps(file | {"recordings": []}))
    return str(path)


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


def test_a_motion_that_a_fit_has_seen_or_whose_load_is_not_known_is_refused(weighed_cell, tmp_path, capsys):
    run = weighed_cell / "run"
    words = [*identified(weighed_cell), *PLAIN]
    (tmp_path / "mass.toml").write_text("mass = 4.275\nknown = 'mass'\n")
    recording = ident.read(run / "light.parquet").recording
    write_recording(replace(recording, v=1000.0 * recording.v), tmp_path / "scaled.parquet")
    cases = {
        ("--unseen", str(run / "unloaded.parquet")): "contain the same motion",
        ("--unseen", str(tmp_path / "scaled.parquet")): "if it carries a payload, state it",
        (*light(weighed_cell)[:3], str(tmp_path / "mass.toml")): "needs mass and centre of mass",
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


def test_a_part_of_a_motion_that_a_fit_has_seen_is_refused(weighed_cell, patching, tmp_path, capsys):
    run, part = weighed_cell / "run", tmp_path / "part.parquet"
    heavy = ident.read(run / "heavy.parquet").recording
    kept = slice(1500, 5000, 4)
    write_recording(replace(heavy, t=heavy.t[kept] - 1.5, q=heavy.q[kept], v=heavy.v[kept]), part)
    unseen = ["--unseen", str(part), "--unseen-payload", str(run / "payload-heavy.toml")]
    assert main([*identified(weighed_cell), *PLAIN, *unseen]) == 2
    assert "part.parquet contain the same motion, fully or partly" in only_line(capsys)
    assert main(with_other(with_other(patching, "--unseen", unseen[1]), "--unseen-payload", unseen[3])) == 2
    assert (
        "part.parquet: the gains were identified from this recording or a copy or part of it (heavy.parquet)"
        in only_line(capsys)
    )
    weighed = [
        "--model",
        MODEL,
        "--unloaded",
        str(run / "unloaded.parquet"),
        "--gains",
        str(weighed_cell / "gains.toml"),
    ]
    assert main(["verify", *weighed, "--loaded", str(part), "--payload", unseen[3]]) == 2
    assert "part.parquet: the gains were identified from this recording or a copy or part of it" in only_line(capsys)
    weighed[3] = str(part)
    light = ["--loaded", str(run / "light.parquet"), "--payload", str(run / "payload-light.toml")]
    assert main(["verify", *weighed, *light]) == 2
    assert "part.parquet: given as bare, but it was loaded" in only_line(capsys)


def test_a_resampled_and_smoothed_copy_of_a_motion_that_a_fit_has_seen_is_refused(
    weighed_cell, patching, tmp_path, capsys
):
    run, copy = weighed_cell / "run", tmp_path / "copy.parquet"
    heavy = ident.read(run / "heavy.parquet").recording
    t = np.arange(heavy.t[0] + 0.4, heavy.t[-1] - 0.3, 1 / 310)
    q, v = (low_passed(each, heavy.period, 25.0) for each in (heavy.q, heavy.v))
    q, v = (np.column_stack([np.interp(t, heavy.t, x) for x in each.T]) for each in (q, v))
    write_recording(replace(heavy, t=t + 12.3, q=q, v=v), copy)
    unseen = ["--unseen", str(copy), "--unseen-payload", str(run / "payload-heavy.toml")]
    for words in (identified(weighed_cell), ["verify", *identified(weighed_cell)[1:]]):
        assert main([*words, *PLAIN, *unseen]) == 2
        assert re.search(r"copy\.parquet has the current noise of .*heavy\.parquet, so", only_line(capsys))
    assert main(with_other(with_other(patching, "--unseen", unseen[1]), "--unseen-payload", unseen[3])) == 2
    assert "copy.parquet: the gains were identified from this recording or a copy" in only_line(capsys)


def test_a_fault_of_an_unseen_log_names_it_whatever_it_is_predicted_with(weighed_cell, patching, tmp_path, capsys):
    log = ident.read(weighed_cell / "run" / "light.parquet").recording
    write_recording(replace(log, q=np.rad2deg(log.q)), tmp_path / "degrees.parquet")
    unseen = ["--unseen", str(tmp_path / "degrees.parquet"), *light(weighed_cell)[2:]]
    for words in ([*identified(weighed_cell), *PLAIN, *unseen], with_other(patching, *unseen[:2])):
        assert main(words) == 2
        assert re.search(r"degrees\.parquet(, the motion to predict)?: .*degrees", only_line(capsys))
    write_recording(replace(log, v=log.v[:, [0, 2, 1, 3, 4, 5]]), tmp_path / "order.parquet")
    assert main(with_other(patching, "--unseen", str(tmp_path / "order.parquet"))) == 2  # by itself, without others
    assert "order.parquet, the motion to predict: columns v2 and v3 are exchanged" in only_line(capsys)


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


def test_a_result_fails_by_what_the_payload_says_of_a_gain_alone():
    def result(error: float, std: float) -> ResultUnseen:
        joint = UnseenJoint(
            joint=3,
            rel_error=0.06,
            explained=0.9964,
            other_rel_error=None,
            fitted_rel_error=0.05,
            largest_rel_error=0.15,
            gain_rel_error=error,
            gain_rel_std=std,
        )
        return ResultUnseen(
            log="new.csv", loaded=True, verdict=None, rel_error=0.06, other_rel_error=None, joints=[joint],
            diagnoses=[], excluded=[], untold=[],
        )  # fmt: skip

    for error, std, passed, said in (
        (-0.21, 0.03, False, "FAILED: prediction error 6 % of the currents of new.csv"),
        (-0.21, 0.08, True, "Prediction error 6 %"),  # within three deviations
        (0.14, 0.02, True, "on this motion, gains are off by +14 % (joint 3)"),
    ):
        found = result(error, std)
        assert found.passed is passed
        told = unseen_verdict(found)
        assert said in " ".join(each.text for each in told)
        assert len(told) == (2 if error > 0.0 else 1)
