import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bad_files import refused
from printed import printed
from weighed_cell import MODEL, elsewhere, heavier, off, with_other

import ident
from ident.observation.observation import ObserveOptions
from ident.recordings.files import write_recording
from ident.support.errors import NotIdentifiable
from scenarios.cli import main
from scenarios.gains_in_use.known_gains import model_options, options_of
from scenarios.results.gains_file import read_gains

pytestmark = pytest.mark.usefixtures("_computed_once", "_all_undiagnosed")


def verified(cell: Path, *more: str, which: str = "light", gains: str = "gains.toml") -> list[str]:
    run = cell / "run"
    loaded = ["--loaded", str(run / f"{which}.parquet"), "--payload", str(run / f"payload-{which}.toml")]
    return ["verify", "--model", MODEL, "--gains", str(cell / gains), "--unloaded", str(run / "unloaded.parquet"),
            *loaded, *more]  # fmt: skip


def weighed(cell: Path, loaded: str = "light", unloaded: str = "unloaded", gains: str = "gains.toml") -> list[str]:
    run = cell / "run"
    return ["payload-of", str(run / f"{loaded}.parquet"), "--gains", str(cell / gains), "--model", MODEL,
            "--unloaded", str(run / f"{unloaded}.parquet")]  # fmt: skip


def test_a_gain_that_is_off_is_named_by_its_joint_and_a_weight_stated_wrong_blames_none(weighed_cell, tmp_path, capsys):
    off(weighed_cell, 3, 1.2, "off.json")
    assert main(verified(weighed_cell, "--json", gains="off.json")) == 1
    found = printed(capsys, "verify")
    assert not found["passed"]
    assert [each["joint"] for each in found["joints"] if each["verdict"] == "differs"] == [3]
    third = found["joints"][2]
    assert abs(third["rel_error"] - 0.2) < 4.0 * third["rel_std"]
    wrong = heavier(weighed_cell, 1.2, tmp_path)
    common = printed(capsys, "verify", [*with_other(verified(weighed_cell), "--payload", wrong)], status=1)["common"]
    # 1 / 1.2 - 1, and what the gains of joints leave.
    assert abs(common["rel_error"] + 1.0 / 6.0) < 4.0 * common["rel_std"] < 0.1
    assert common["apart"] == []


def test_what_weighs_nothing_is_refused(weighed_cell, tmp_path, capsys):
    run, others = weighed_cell / "run", elsewhere(weighed_cell, 1.0, tmp_path / "gains.json")
    swapped = with_other(verified(weighed_cell, which="unloaded"), "--unloaded", str(run / "light.parquet"))
    swapped = with_other(with_other(swapped, "--payload", str(run / "payload-light.toml")), "--gains", others)
    heavy, part, kept = ident.read(run / "heavy.parquet").recording, tmp_path / "part.parquet", slice(1500, 5000, 4)
    write_recording(replace(heavy, t=heavy.t[kept], q=heavy.q[kept], v=heavy.v[kept]), part)
    words, two = verified(weighed_cell), ["--loaded", str(run / "light.parquet"), "--payload", swapped[-1]]
    for given, said in (
        (swapped, r"negative: -4\..*bare and loaded recordings are probably swapped"),
        (verified(weighed_cell, which="heavy"), r"heavy\.parquet: the gains were identified from this recording"),
        (with_other(words, "--loaded", str(part)), r"part\.parquet: .* a copy or part of it \(heavy\.parquet\)"),
        ([*words, *two], "2 payloads are given"),
        ([*words[:5], *words[7:]], "no motion is bare"),
        # The gains file would tell, did it know the recordings.
        (with_other(weighed(weighed_cell, "unloaded", "light"), "--gains", others), "probably swapped"),
        (weighed(weighed_cell, "unloaded", "light"), "the gains were identified from this recording"),
        (weighed(weighed_cell, "light", "heavy"), "given as bare, but it was loaded when the gains were identified"),
    ):
        assert re.search(said, refused(capsys, given))


def test_an_unknown_payload_is_found_with_the_gains_and_joints_that_disagree_are_named(weighed_cell, capsys):
    found = printed(capsys, "payload-of", [*weighed(weighed_cell)])
    body = {each["quantity"]: each for each in found["body"]}
    for name, true in {"mass": 4.275, "x": 0.0, "y": 0.0, "z": 0.12016}.items():
        assert abs(body[name]["estimate"] - true) < 4.0 * body[name]["std"], name
    assert len(found["parameters"]) == len(found["covariance"]) == 10
    for each in (*found["parameters"], *found["body"]):
        shares = [each[f"{share}_std"] for share in ("residual", "gain", "model")]
        np.testing.assert_allclose(np.linalg.norm(shares), each["std"], rtol=1e-9)
    std = [each["std"] for each in found["parameters"]]
    np.testing.assert_allclose(np.sqrt(np.diag(found["covariance"])), std, rtol=1e-9)
    assert {each["verdict"] for each in found["joints"]} <= {"agrees", "says nothing"}
    off(weighed_cell, 2, 2.0, "doubled.json")
    assert main(weighed(weighed_cell, gains="doubled.json")) == 0
    assert "WARNING: the joints disagree on the mass: " in (words := capsys.readouterr().out)
    assert "joint 2 alone" in words


def test_a_delay_that_is_given_replaces_that_of_the_gains_file(weighed_cell, monkeypatch, capsys):
    def prepared(*_, observing: ObserveOptions, **__) -> None:
        raise NotIdentifiable(f"delay of {1e3 * observing.current_delay:g} ms")

    monkeypatch.setattr("scenarios.gains_in_use.known_gains.prepare", prepared)
    for more, said in (([], "of 0 ms"), (["--current-delay", "0.0043"], "of 4.3 ms")):
        assert said in refused(capsys, [*weighed(weighed_cell), *more])


def test_options_that_the_gains_were_found_with_hold(weighed_cell):
    file = read_gains(weighed_cell / "gains.toml")
    stated = {"friction": "cbrt", "gain_joint": 2, "gain_value": 1.5, "gain_laws": True}
    options = file.options.model_copy(update={"method": stated, "observe": {"cutoff_hz": 9.0}})
    shorter = file.model_copy(update={"options": options})
    chosen = model_options(shorter)
    assert (chosen.friction, chosen.gain_joint, chosen.gain_laws) == ("cbrt", None, False)
    assert options_of(ObserveOptions, shorter.options.observe).cutoff_hz == 9.0
    others = shorter.model_copy(update={"method": "ls-2011"})
    assert model_options(others).friction == "viscous-coulomb"
