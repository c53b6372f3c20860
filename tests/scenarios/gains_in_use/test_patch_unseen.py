import json
import tomllib
from collections.abc import Callable
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
from ident.parameters.arm import Quantity
from ident.parameters.links import nearest_links
from ident.recordings.files import write_recording
from scenarios.cli import main
from scenarios.experiments.robots import PLACEHOLDER, is_placeholder, model_base, nominal_links
from scenarios.results.bare import Links
from scenarios.results.gains_file import read_gains
from sim.errors import PlantError

pytestmark = pytest.mark.usefixtures("_computed_once", "_all_undiagnosed")
Patch = Callable[..., dict]


@pytest.fixture
def patch(patching, tmp_path, capsys) -> Patch:
    """Run the command, with --arm unless words are given; give what it prints, whether it passed and wrote."""

    def run(*more: str, words: list[str] | None = None, passes: bool) -> dict:
        copy = tmp_path / "patched.xml"
        copy.unlink(missing_ok=True)
        words = [*patching, "--arm", str(tmp_path / "bare.json")] if words is None else words
        assert main([*words, *more]) == (0 if passes else 1)
        told = printed(capsys, "patch")
        assert told["written"] is copy.exists() is (passes or "--force" in more)
        return told["unseen"]

    return run


def test_a_copy_that_predicts_better_is_written_another_by_force_alone(patch, patching):
    unseen = patch(passes=True)
    assert unseen["verdict"] == "better"
    assert unseen["rel_error"] < 0.5 * unseen["other_rel_error"]
    assert patch(words=patching, passes=False)["verdict"] == "no different"
    patch("--force", words=patching, passes=False)


def test_a_right_copy_is_written_though_its_model_has_neither_rotor_inertia_nor_offsets(
    patch, patching, weighed_cell, tmp_path
):
    drives = tomllib.loads((Path(MODEL).parent / "robot.toml").read_text())["drives"]
    base, gains = structure_of(load_arm(MODEL)).base, read_gains(weighed_cell / "gains.toml").gains
    inertia = base.standard(np.zeros((6, 10)), {"Ia": np.array(drives["rotor_inertia"]["value"])})
    whole = (model_base(Path(MODEL), None, base) + base.regrouping @ inertia) / gains[0].estimate
    bare = json.loads((tmp_path / "bare.json").read_text())
    bare["base_parameters"] = [
        {"parameter": name, "unit": "", "estimate": value, "std": 0.03 * value}
        for name, value in zip(base.names, whole.tolist(), strict=True)
        if name in ("ZZ1", "ZZ2", "Ia3", "Ia5")
    ]
    (tmp_path / "bare.json").write_text(json.dumps(bare))
    off(weighed_cell, 2, 1.3, "off.json")
    good, wrong = str(weighed_cell / "gains.toml"), str(weighed_cell / "off.json")
    for more, verdict in (([], "better"), (["--nominal", wrong], "better"), (["--nominal", good], "no different")):
        unseen = patch(*more, passes=True)
        assert unseen["verdict"] == verdict
    joints = {each["joint"]: each for each in unseen["joints"]}
    assert min(joints[j]["unstated_rel"] for j in (1, 2)) > 0.02  # Ia1 and Ia2 are regrouped, so the copy has none
    assert max(joints[j]["rel_error"] for j in (1, 2, 3)) < 0.05
    assert [joints[j]["unstated_rel"] for j in (3, 5)] == [0.0, 0.0]  # these are written
    words = [*with_other(patching, "--gains", wrong), "--arm", str(tmp_path / "bare.json")]
    assert patch("--nominal", good, words=words, passes=False)["verdict"] == "worse"


def test_a_copy_that_beats_the_model_and_predicts_nothing_is_not_written(
    patch, patching, weighed_cell, tmp_path, capsys
):
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
        unseen = patch(words=other, passes=False)
        beyond = [each["joint"] for each in unseen["joints"] if (each["rel_error"] or 0.0) > 0.15]
        assert beyond
        assert joints in (None, beyond)
        assert "link masses" not in [each["name"] for each in unseen["diagnoses"]]  # it carries a payload
        assert {each["largest_rel_error"] for each in unseen["joints"]} <= {None, 0.15}
        assert unseen["verdict"] == "better"
    assert main([word for word in other if word != "--json"]) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert "light.parquet fails on joint 3 (" in out
    assert "NOT WRITTEN" in out


@pytest.mark.slow
def test_a_copy_with_links_of_bare_motions_must_predict_as_these_predict_each_other(patching, tmp_path, capsys):
    structure, nominal = structure_of(load_arm(MODEL)), nominal_links(Path(MODEL), None)
    b = model_base(Path(MODEL), None, structure.base).tolist()
    shown = [
        Quantity(name=k, unit="", value=v, residual_std=0.01) for k, v in zip(structure.base.names, b, strict=True)
    ]
    shown = [each for each in shown if each.name[0] not in "Fo"]  # friction and offsets are no links'
    bare = json.loads((tmp_path / "bare.json").read_text())
    bare["joints"][2] |= {"predicted_rel_error": 0.031, "fitted_rel_error": 0.022}
    words = [*patching, "--arm", str(tmp_path / "links.json")]

    def joints(factor: float, *more: str) -> list[dict]:
        values = [replace(each, value=factor * each.value) for each in shown]
        found = nearest_links(structure.base, values, 1e-4 * np.eye(len(shown)), nominal)
        bare["consistent"] = Links.of(found, nominal, structure.arm).model_dump(mode="json")
        (tmp_path / "links.json").write_text(json.dumps(bare))
        main([*words, *more])
        return printed(capsys, "patch")["unseen"]["joints"]

    assert {each["largest_rel_error"] for each in joints(1.0)} <= {None, 0.15}
    with_links = joints(1.0, "--links")
    assert [each["fitted_rel_error"] for each in with_links] == [None, None, 0.022, None, None, None]
    # The deviations of gain and payload add a little to three times 3.1 %.
    limits = [with_links[j]["largest_rel_error"] for j in (1, 2)]
    assert limits == [0.15, pytest.approx(0.093, rel=0.05)]
    same_gains = joints(1.3, "--links", "--nominal", words[words.index("--gains") + 1])  # the rival has the same links
    assert [each["rel_error"] for each in same_gains] == [each["other_rel_error"] for each in same_gains]


def test_a_copy_says_what_a_bare_motion_and_the_unchanged_model_do_not_test(patching, weighed_cell, tmp_path, capsys):
    words = patching[: patching.index("--unseen")]
    words += ["--unseen", str(weighed_cell / "run" / "unloaded.parquet")]
    large, sound = (elsewhere(weighed_cell, factor, tmp_path / f"{factor}.json") for factor in (1.45, 1.03))
    for gains, nominal, doubted in ((large, (), True), (sound, (), False), (sound, ("--nominal", large), False)):
        main([*with_other(words, "--gains", gains), *nominal])
        out = " ".join(capsys.readouterr().out.split())
        assert ("WARNING: with these gains the arm's masses are 1." in out) is doubted
        assert "the gains are tested against the link masses in that file" in out
        assert ("does not test the gains" in out) is (not nominal)


def test_a_file_of_kinematics_alone_predicts_nothing(tmp_path):
    links = nominal_links(rx90_mjcf.MJCF, None)
    assert not is_placeholder(links)
    assert is_placeholder(replace(links, own=np.tile(PLACEHOLDER, (6, 1))))
    text = '<body pos="0 0 {0}"><joint axis="0 1 0"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
    path = tmp_path / "bare.xml"
    path.write_text(f"<mujoco><worldbody>{text.format(0.3)}{text.format(0.7)}</body></body></worldbody></mujoco>")
    with pytest.raises(PlantError, match=r"bare\.xml"):
        model_base(path, None, structure_of(load_arm(path)).base)
