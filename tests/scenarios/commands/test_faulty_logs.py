import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bad_files import refused
from quick import HALF_RATE
from weighed_cell import MODEL, PLAIN, TWO_WEIGHTS

from ident.payload.payload import write_payload
from ident.recordings.files import read_recording, write_recording
from ident.recordings.recording import Recording
from scenarios.cli import main
from scenarios.experiments.run import simulate
from scenarios.experiments.scenario import load_scenario, setup_of, with_settings
from scenarios.rendering.content import Table
from scenarios.results.fit import read_fit
from scenarios.results.pages import page_of

pytestmark = pytest.mark.usefixtures("_computed_once")


def identified(cell: Path) -> list[str]:
    pair = ["--unloaded", f"{cell}/bare.parquet", "--loaded", f"{cell}/faulty.parquet"]
    return ["identify", "--model", MODEL, *pair, "--payload", f"{cell}/payload-light.toml", *PLAIN]


@pytest.fixture(scope="module")
def cell(tmp_path_factory) -> Path:
    """A bare motion and a loaded one."""
    folder = tmp_path_factory.mktemp("cell")
    (folder / "cell.toml").write_text(
        'extends = "nominal"\n[experiment]\nprotocol = ["bare", "light", "heavy"]\n' + TWO_WEIGHTS
    )
    setup = setup_of(with_settings(load_scenario(str(folder / "cell.toml")), HALF_RATE))
    for name, log in zip(("bare", "light", "heavy"), simulate(setup, 0).recordings, strict=True):
        part = slice(None, None, 2)  # at 250 Hz they are read otherwise in a fraction of the time
        write_recording(Recording(log.t[part], log.q[part], log.v[part]), folder / f"{name}.parquet")
    write_payload(setup.payloads["light"], folder / "payload-light.toml")
    return folder


def test_logs_that_give_no_right_gain_are_refused_in_one_line_for_their_fault(cell, capsys):
    log = read_recording(cell / "light.parquet")
    write_recording(replace(log, q=log.q * [1, -1, 1, 1, 1, 1]), cell / "faulty.parquet")
    words = ["payload-of", f"{cell}/faulty.parquet", "--unloaded", f"{cell}/bare.parquet", "--model", MODEL]
    gains = "".join(f"[[gains]]\njoint = {j}\nestimate = 1.1\nstd = 0.02\n" for j in range(1, 7))
    (cell / "gains.toml").write_text(gains)
    line = refused(capsys, [*words, "--gains", f"{cell}/gains.toml"])
    assert re.search("q2 is negated (and its zero .*)?in faulty.parquet alone", line)


def test_the_page_of_faulty_logs_tells_their_faults_and_is_drawn_from_what_lies_between_gaps(cell, tmp_path):
    log = read_recording(cell / "light.parquet")
    gap = np.setdiff1d(np.arange(len(log.t)), range(2250, 2475))
    q = np.mod(log.q + np.pi, 2.0 * np.pi) - np.pi
    v = log.v * [1, 1.15, 1, 1, 1, 1]
    write_recording(Recording(log.t[gap], q[gap], v[gap]), cell / "faulty.parquet")
    assert main([*identified(cell), "--save", str(tmp_path / "saved")]) == 0
    report = page_of(tmp_path / "saved")
    checks = [part for part in report.parts if isinstance(part, Table) and part.columns[-1].title == "Found"]
    doubts = {row[0].text: each.title for each in checks for row in each.rows if row[1].text != "good"}
    assert doubts.keys() == {"current scale", "missing samples", "wrapped"}
    assert doubts["missing samples"] == doubts["wrapped"] == "faulty.parquet"
    fit = read_fit(tmp_path / "saved")
    parts = ["bare.parquet", *(f"faulty.parquet, part {k}" for k in (1, 2))]
    assert [Path(motion.log).name for motion in fit.motions] == parts
    assert set(fit.motion[fit.joint == 1].tolist()) == {1, 2, 3}


@pytest.mark.slow
def test_a_delay_that_is_undone_is_recorded_for_the_page_and_for_whoever_reads_the_folder(cell, tmp_path):
    (tmp_path / "payload-light.toml").write_text((cell / "payload-light.toml").read_text())
    for source, name in (("bare", "bare"), ("light", "faulty")):
        log = read_recording(cell / f"{source}.parquet")
        v = np.column_stack([np.interp(log.t - 7.3e-3, log.t, each) for each in log.v.T])
        write_recording(replace(log, v=v), tmp_path / f"{name}.parquet")
    saved = tmp_path / "saved"
    assert main([*identified(tmp_path), "--current-delay", "auto", "--save", str(saved)]) == 0
    delay = json.loads((saved / "record.json").read_text())["observe"]["current_delay"]
    assert abs(delay + 6.8e-3) < 1e-3  # of 7.3 ms, 0.5 ms are the controller's
    texts = (getattr(part, "text", "") for part in page_of(saved).parts)
    assert [float(found[1]) for text in texts if (found := re.search(r"delay=(-[\d.e-]+)", text))] == [delay]
