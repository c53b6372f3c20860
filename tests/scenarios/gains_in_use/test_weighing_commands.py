"""`rx90 verify`, `payload-of`: from recordings and a gains file to what is told."""

from pathlib import Path

import numpy as np
import pytest
from printed import printed
from weighed_cell import MODEL, PLAIN, elsewhere, heavier, identified, light, off, with_other

from scenarios.cli import main
from scenarios.experiments.gains_file import read_gains
from scenarios.gains_in_use.known_gains_problem import model_options, observe_options

pytestmark = pytest.mark.usefixtures("_computed_once")


def verified(cell: Path, *more: str, which: str = "light", gains: str = "gains.toml") -> list[str]:
    run = cell / "run"
    loaded = ["--loaded", str(run / f"{which}.parquet"), "--payload", str(run / f"payload-{which}.toml")]
    return ["verify", "--model", MODEL, "--gains", str(cell / gains), "--unloaded", str(run / "unloaded.parquet"),
            *loaded, *more]  # fmt: skip


def test_a_weight_that_identification_has_not_seen_verifies_its_gains(weighed_cell, capsys):
    assert main(verified(weighed_cell, "--json")) == 0
    found = printed(capsys, "verify")
    assert found["passed"]
    assert found["together"]["verdict"] == "agrees"
    assert found["mass"] == 4.275
    assert abs(found["together"]["mass"] - 4.275) < 4.0 * found["together"]["std"]
    assert [each["joint"] for each in found["joints"]] == [1, 2, 3, 4, 5, 6]
    assert {each["quantity"] for each in found["payload"]} >= {"mass", "x", "y", "z"}


def test_a_gain_that_is_off_is_named_by_its_joint(weighed_cell, capsys):
    off(weighed_cell, 3, 1.2, "off.json")
    assert main(verified(weighed_cell, "--json", gains="off.json")) == 1
    found = printed(capsys, "verify")
    assert not found["passed"]
    assert [each["joint"] for each in found["joints"] if each["verdict"] == "differs"] == [3]
    third = found["joints"][2]
    assert abs(third["rel_error"] - 0.2) < 4.0 * third["rel_std"]
    assert main(verified(weighed_cell, gains="off.json")) == 1
    assert "FAILED: gains are off: joint 3 by +" in capsys.readouterr().out


def test_a_weight_stated_wrong_is_suspected_and_no_joint_is_blamed(weighed_cell, tmp_path, capsys):
    wrong = heavier(weighed_cell, 1.2, tmp_path)
    assert main([*with_other(verified(weighed_cell), "--payload", wrong), "--json"]) == 1
    common = printed(capsys, "verify")["common"]
    # 1 / 1.2 - 1, and what the gains of joints leave.
    assert abs(common["rel_error"] + 1.0 / 6.0) < 4.0 * common["rel_std"] < 0.1
    assert common["apart"] == []


def test_verify_predicts_with_the_gains_of_a_file_and_with_those_it_finds(weighed_cell, sheet, capsys):
    good = str(weighed_cell / "gains.toml")
    words = verified(weighed_cell, *light(weighed_cell), "--json")
    assert main([*words, "--compare-with", sheet]) == 0
    by_file = printed(capsys, "verify")
    assert (by_file["passed"], by_file["unseen"]["verdict"]) == (True, "better")
    assert main([*words, "--compare-with", good]) == 1
    same = printed(capsys, "verify")
    assert (same["passed"], same["together"]["verdict"]) == (False, "agrees")
    assert same["unseen"]["verdict"] == "no different"
    assert main([*with_other(words, "--gains", sheet), "--compare-with", good]) == 1
    assert printed(capsys, "verify")["unseen"]["verdict"] == "worse"
    words = ["verify", *identified(weighed_cell)[1:], *PLAIN, *light(weighed_cell), "--json"]
    assert main([*words, "--compare-with", sheet]) == 0
    found = printed(capsys, "verify-motions")["unseen"]
    np.testing.assert_allclose(found["rel_error"], by_file["unseen"]["rel_error"], rtol=1e-3)
    assert main([*words, "--compare-with", good]) == 1


def test_gains_are_not_verified_by_what_they_were_found_from(weighed_cell, capsys):
    assert main(verified(weighed_cell, which="heavy")) == 2
    assert "heavy.parquet: the gains were identified from this recording" in capsys.readouterr().err


def test_a_verification_of_swapped_files_says_so(weighed_cell, tmp_path, capsys):
    run = weighed_cell / "run"
    words = with_other(verified(weighed_cell, which="unloaded"), "--unloaded", str(run / "light.parquet"))
    words = with_other(words, "--payload", str(run / "payload-light.toml"))
    assert main(with_other(words, "--gains", elsewhere(weighed_cell, 1.0, tmp_path / "gains.json"))) == 2
    assert "the estimated mass is negative: -4." in (said := capsys.readouterr().err)
    assert "bare and loaded recordings are probably swapped" in said


def test_without_gains_the_motions_predict_each_other(weighed_cell, capsys):
    assert main(["verify", *identified(weighed_cell)[1:], "--json"]) == 0
    found = printed(capsys, "verify-motions")
    assert [each["joint"] for each in found["joints"]] == [1, 2, 3, 4, 5, 6]
    assert all(each["fitted_rel_error"] < each["predicted_rel_error"] < 1.0 for each in found["joints"])


def test_a_verification_weighs_one_payload(weighed_cell, capsys):
    light = weighed_cell / "run" / "light.parquet"
    more = ["--loaded", str(light), "--payload", str(weighed_cell / "run" / "payload-light.toml")]
    assert main(verified(weighed_cell, *more)) == 2
    assert "2 payloads are given" in capsys.readouterr().err
    words = verified(weighed_cell)
    words = [*words[:5], *words[7:]]  # no bare motion
    assert main(words) == 2
    assert "no motion is bare" in capsys.readouterr().err


def test_an_unknown_payload_is_found_with_the_gains(weighed_cell, capsys):
    run = weighed_cell / "run"
    words = ["payload-of", str(run / "light.parquet"), "--gains", str(weighed_cell / "gains.toml"), "--model", MODEL,
             "--unloaded", str(run / "unloaded.parquet")]  # fmt: skip
    assert main([*words, "--json"]) == 0
    found = printed(capsys, "payload-of")
    body = {each["quantity"]: each for each in found["body"]}
    for name, true in {"mass": 4.275, "x": 0.0, "y": 0.0, "z": 0.12016}.items():
        assert abs(body[name]["estimate"] - true) < 4.0 * body[name]["std"], name
        parts = [body[name][f"{share}_std"] for share in ("residual", "gain", "model")]
        np.testing.assert_allclose(body[name]["std"], np.linalg.norm(parts), rtol=1e-9)
    assert len(found["parameters"]) == len(found["covariance"]) == 10
    for k, each in enumerate(found["parameters"]):
        parts = [each[f"{share}_std"] for share in ("residual", "gain", "model")]
        np.testing.assert_allclose(np.linalg.norm(parts), each["std"], rtol=1e-9)
        np.testing.assert_allclose(found["covariance"][k][k], each["std"] ** 2, rtol=1e-9)
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
        ("heavy", "unloaded", "the gains were identified from this recording"),
        ("light", "heavy", "given as bare, but it was loaded when the gains were identified"),
    ],
)
def test_a_payload_is_not_found_from_what_cannot_show_it(weighed_cell, tmp_path, capsys, loaded, unloaded, words):
    given = weighed(weighed_cell, loaded=loaded, unloaded=unloaded)
    if words == "probably swapped":  # which the gains file would tell, did it know the recordings
        given = with_other(given, "--gains", elsewhere(weighed_cell, 1.0, tmp_path / "gains.json"))
    assert main(given) == 2
    assert words in capsys.readouterr().err


def test_joints_that_disagree_on_the_mass_are_named(weighed_cell, capsys):
    off(weighed_cell, 2, 2.0, "doubled.json")
    assert main(weighed(weighed_cell, gains="doubled.json")) == 0
    assert "WARNING: the joints disagree on the mass: " in (words := capsys.readouterr().out)
    assert "joint 2 alone" in words


def test_options_that_the_gains_were_found_with_hold_until_others_are_given(weighed_cell, capsys):
    file = read_gains(weighed_cell / "gains.toml")
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
    assert main(verified(weighed_cell, "--observe", "cutof_hz=3")) == 2
    assert "unknown option 'cutof_hz'" in capsys.readouterr().err
