from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from bad_files import refused
from printed import printed
from weighed_cell import MODEL, PLAIN, heavier, identified, light

import ident
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Severity
from ident.estimation.estimators.nls import AllJointsOptions
from ident.recordings.files import write_recording
from scenarios.cli import main
from scenarios.results.gains import Result
from scenarios.results.gains_file import read_gains
from scenarios.results.pages import page_of
from scenarios.results.record import read_result

pytestmark = pytest.mark.usefixtures("_computed_once")


@pytest.mark.usefixtures("_undiagnosed")
def test_identify_and_python_predict_a_motion_better_than_a_data_sheet(weighed_cell, tmp_path, sheet, capsys):
    words = [*identified(weighed_cell), *PLAIN, *light(weighed_cell), "--compare-with", sheet]
    assert main([*words, "--json", "--save", str(tmp_path / "saved")]) == 0
    unseen = printed(capsys, "result")["unseen"]
    assert (unseen["verdict"], unseen["loaded"]) == ("better", True)
    third = unseen["joints"][2]
    assert third["joint"] == 3
    assert third["other_rel_error"] > 2.0 * third["rel_error"]
    # Noise of the same size on both motions: what was not fitted to is predicted about as well.
    np.testing.assert_allclose(third["rel_error"], third["fitted_rel_error"], rtol=0.5)
    assert read_result(tmp_path / "saved", Result).model_dump(mode="json")["unseen"] == unseen
    page = [getattr(part, "text", getattr(part, "title", "")) for part in page_of(tmp_path / "saved").parts]
    assert any("motion that was not used in any fit" in each for each in page)
    run = weighed_cell / "run"
    heavy = ident.read(run / "heavy.parquet", payload=run / "payload-heavy.toml")
    plain, logs = AllJointsOptions(friction="viscous-coulomb"), [ident.read(run / "unloaded.parquet"), heavy]
    found = ident.identify(ident.load_arm(MODEL), logs, options=plain)
    log = ident.read(run / "light.parquet", payload=run / "payload-light.toml")
    same = ident.predict_unseen(found, log, other=read_gains(Path(sheet)).known)
    np.testing.assert_allclose([same.rel_error, same.other_rel_error], [unseen["rel_error"], unseen["other_rel_error"]])


@pytest.mark.usefixtures("_undiagnosed")
def test_a_payload_that_is_off_fails(weighed_cell, tmp_path, capsys):
    words = [*identified(weighed_cell), *PLAIN, *light(weighed_cell)[:2], "--unseen-payload"]
    assert main([*words, heavier(weighed_cell, 1.25, tmp_path)]) == 1
    assert "By its payload the gains are off by -2" in " ".join(capsys.readouterr().out.split())
    bad = "0.5,0.5,0.5,0.5,0.5,0.5"  # worse than what is found, which does not make that good
    assert main([*words, heavier(weighed_cell, 1.8, tmp_path), "--compare-with", bad, "--json"]) == 1
    unseen = printed(capsys, "result")["unseen"]
    assert unseen["verdict"] == "better"


@pytest.mark.usefixtures("_undiagnosed")
def test_a_motion_that_a_fit_has_seen_or_whose_load_is_not_known_is_refused(
    weighed_cell, tmp_path, capsys, monkeypatch
):
    run = weighed_cell / "run"
    words = [*identified(weighed_cell), *PLAIN]
    (tmp_path / "mass.toml").write_text("mass = 4.275\nknown = 'mass'\n")
    heavy, kept = ident.read(run / "heavy.parquet").recording, slice(1500, 5000, 4)
    part = replace(heavy, t=heavy.t[kept] - 1.5, q=heavy.q[kept], v=heavy.v[kept])
    write_recording(part, tmp_path / "part.parquet")
    weight = ["--unseen-payload", str(run / "payload-heavy.toml")]
    cases = {
        ("--unseen", str(run / "unloaded.parquet")): "contain the same motion",
        ("--unseen", str(tmp_path / "part.parquet"), *weight): "part.parquet contain the same motion, fully or partly",
        (*light(weighed_cell)[:3], str(tmp_path / "mass.toml")): "needs mass and centre of mass",
        ("--unseen-payload", str(tmp_path / "mass.toml")): "add --unseen LOG",
        ("--unseen", "absent.parquet"): "absent.parquet: no such file",
    }
    for more, message in cases.items():
        assert message in refused(capsys, [*words, *more])
    patched = ["patch", MODEL, "--gains", str(weighed_cell / "gains.toml"), "--out", str(tmp_path / "new.xml")]
    for given, message in (
        ([*patched, "--unseen", str(run / "heavy.parquet")], "the gains were identified from this recording"),
        ([*words[:5], "--unseen", str(run / "light.parquet")], "--unseen: bare recordings give only ratios"),
        (["verify", *words[1:-2], *patched[2:4], "--compare-with", "1,1,1,1,1,1"], "no motion is given to predict"),
    ):
        assert message in refused(capsys, given)
    wrong = partial(Diagnosis, name="current scale", severity=Severity.WRONG, sentence="v is scaled")
    monkeypatch.setattr(
        "ident.identification.diagnose", lambda logs, *_: Diagnosed(diagnoses=(wrong(logs=tuple(logs.names)),))
    )
    line = refused(capsys, [*words, "--unseen", str(run / "light.parquet")])
    assert "light.parquet, the motion to predict: " in line
    assert "v is scaled; if it carries a payload, state it" in line
