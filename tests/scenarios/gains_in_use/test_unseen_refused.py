"""What is refused as a motion that no fit has used: one of a fit, even changed; one of unknown load; a faulty log."""

import re
from dataclasses import replace

import numpy as np
import pytest
from bad_files import refused
from weighed_cell import MODEL, PLAIN, identified, light, with_other

import ident
from ident.recordings.files import write_recording

pytestmark = pytest.mark.usefixtures("_computed_once")


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
        assert message in refused(capsys, [*words, *more])
    patched = ["patch", MODEL, "--gains", str(weighed_cell / "gains.toml"), "--out", str(tmp_path / "new.xml")]
    for given, message in (
        ([*patched, "--unseen", str(run / "heavy.parquet")], "the gains were identified from this recording"),
        ([*words[:5], "--unseen", str(run / "light.parquet")], "--unseen: bare recordings give no gains to predict"),
        (["verify", *words[1:], "--compare-with", "1,1,1,1,1,1"], "--compare-with: no motion is given to predict"),
    ):
        assert message in refused(capsys, given)


def test_a_part_of_a_motion_that_a_fit_has_seen_is_refused(weighed_cell, tmp_path, capsys):
    run, part = weighed_cell / "run", tmp_path / "part.parquet"
    heavy = ident.read(run / "heavy.parquet").recording
    kept = slice(1500, 5000, 4)
    write_recording(replace(heavy, t=heavy.t[kept] - 1.5, q=heavy.q[kept], v=heavy.v[kept]), part)
    unseen = ["--unseen", str(part), "--unseen-payload", str(run / "payload-heavy.toml")]
    line = refused(capsys, [*identified(weighed_cell), *PLAIN, *unseen])
    assert "part.parquet contain the same motion, fully or partly" in line


def test_a_fault_of_an_unseen_log_names_it_whatever_it_is_predicted_with(weighed_cell, patching, tmp_path, capsys):
    log = ident.read(weighed_cell / "run" / "light.parquet").recording
    write_recording(replace(log, q=np.rad2deg(log.q)), tmp_path / "degrees.parquet")
    unseen = ["--unseen", str(tmp_path / "degrees.parquet"), *light(weighed_cell)[2:]]
    for words in ([*identified(weighed_cell), *PLAIN, *unseen], with_other(patching, *unseen[:2])):
        assert re.search(r"degrees\.parquet(, the motion to predict)?: .*degrees", refused(capsys, words))
    write_recording(replace(log, v=log.v[:, [0, 2, 1, 3, 4, 5]]), tmp_path / "order.parquet")
    line = refused(capsys, with_other(patching, "--unseen", str(tmp_path / "order.parquet")))  # by itself
    assert "order.parquet, the motion to predict: columns v2 and v3 are exchanged" in line
