import json
import re
import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from quick import HALF_RATE
from undiagnosed import undiagnosed
from weighed_cell import MODEL, PLAIN, TWO_WEIGHTS

from ident.payload.payload import write_payload
from ident.recordings.files import read_recording, write_recording
from ident.recordings.recording import Recording
from scenarios.cli import main
from scenarios.experiments.run import simulate
from scenarios.experiments.scenario import load_scenario, setup_of, with_settings
from scenarios.rendering.content import Table, joints_named
from scenarios.results.fit import read_fit
from scenarios.results.pages import page_of

pytestmark = pytest.mark.usefixtures("_computed_once")
BARE, FAULTY, PAYLOAD, GAINS = "{}/bare.parquet", "{}/faulty.parquet", "{}/payload-light.toml", "{}/gains.toml"
PAIR = ("--unloaded", BARE, "--loaded", FAULTY, "--payload", PAYLOAD)
COMMANDS = {
    "identify": ("identify", "--model", MODEL, *PAIR, *PLAIN),
    "check": ("check", MODEL, BARE, "--loaded", FAULTY, "--payload", PAYLOAD),
    "verify": ("verify", "--model", MODEL, "--gains", GAINS, *PAIR),
    "payload-of": ("payload-of", FAULTY, "--model", MODEL, "--gains", GAINS, "--unloaded", BARE),
    "bare identify": ("identify", "--model", MODEL, "--unloaded", BARE, FAULTY),
}


@pytest.fixture(scope="module")
def cell(tmp_path_factory) -> Path:
    """Two bare motions, two weights, and the gains that the heavier one gives."""
    folder = tmp_path_factory.mktemp("cell")
    (folder / "cell.toml").write_text(
        'extends = "nominal"\n[experiment]\nprotocol = ["bare", "bare", "light", "heavy"]\n'
        + TWO_WEIGHTS
        + '[identification]\nmethod = "ls-2011"\n'
    )
    setup = setup_of(with_settings(load_scenario(str(folder / "cell.toml")), HALF_RATE))
    for name, log in zip(("bare", "again", "light", "heavy"), simulate(setup, 0).recordings, strict=True):
        part = slice(None, None, 2)  # at 250 Hz they are read otherwise in a fraction of the time
        write_recording(Recording(log.t[part], log.q[part], log.v[part]), folder / f"{name}.parquet")
    for name, payload in setup.payloads.items():
        write_payload(payload, folder / f"payload-{name}.toml")
    words = ["identify", "--model", MODEL, "--unloaded", BARE, "--loaded", "{}/heavy.parquet"]
    words += ["--payload", "{}/payload-heavy.toml", "--gains-out", GAINS, *PLAIN]
    with undiagnosed():
        assert main([word.format(folder) for word in words]) == 0
    return folder


@pytest.fixture(scope="module")
def sound_gains(cell) -> list[dict]:
    """What `identify` finds in the bare log and that of the light weight, which nothing is wrong with."""
    out = cell / "sound"
    shutil.copy(cell / "light.parquet", cell / "faulty.parquet")
    with undiagnosed():
        assert main([*(word.format(cell) for word in COMMANDS["identify"]), "--save", str(out)]) == 0
    return json.loads((out / "result.json").read_text())["gains"]


@pytest.mark.parametrize(
    "command",
    [pytest.param(name, marks=() if name == "payload-of" else pytest.mark.slow) for name in COMMANDS],
)
def test_every_command_names_the_same_fault_of_the_same_logs(cell, capsys, command):
    log = read_recording(cell / ("again.parquet" if command == "bare identify" else "light.parquet"))
    write_recording(replace(log, q=log.q * [1, -1, 1, 1, 1, 1]), cell / "faulty.parquet")
    capsys.readouterr()
    status = main([word.format(cell) for word in COMMANDS[command]])
    out, err = capsys.readouterr()
    said = "q2 is negated (and its zero .*)?in faulty.parquet alone"
    assert re.search(said, out if command == "check" or status == 0 else err), (out, err)
    if status == 2:
        assert out == ""
        assert err.count("\n") == 1


def test_the_page_of_faulty_logs_tells_their_faults_and_is_drawn_from_what_lies_between_gaps(cell, tmp_path):
    log = read_recording(cell / "light.parquet")
    gap = np.setdiff1d(np.arange(len(log.t)), range(2250, 2475))
    q = np.mod(log.q + np.pi, 2.0 * np.pi) - np.pi
    v = log.v * [1, 1.15, 1, 1, 1, 1]
    write_recording(Recording(log.t[gap], q[gap], v[gap]), cell / "faulty.parquet")
    words = [*(word.format(cell) for word in COMMANDS["identify"]), "--save", str(tmp_path / "saved")]
    assert main(words) == 0
    report = page_of(tmp_path / "saved")
    checks = [part for part in report.parts if isinstance(part, Table) and part.columns[-1].title == "Found"]
    doubts = {row[0].text: each.title for each in checks for row in each.rows if row[1].text != "good"}
    assert doubts.keys() == {"current scale", "missing samples", "wrapped"}
    assert doubts["missing samples"] == doubts["wrapped"] == "faulty.parquet"
    fit = read_fit(tmp_path / "saved")
    assert [Path(motion.log).name for motion in fit.motions] == [
        "bare.parquet",
        "faulty.parquet, part 1",
        "faulty.parquet, part 2",
    ]
    assert set(fit.rows[0].motion.tolist()) == {0, 1, 2}


@pytest.mark.slow
def test_gains_that_a_fault_spoils_are_refused_for_it_and_those_that_are_kept_are_right(
    cell, sound_gains, tmp_path, capsys
):
    shutil.copy(cell / "payload-light.toml", tmp_path)
    shutil.copy(cell / "bare.parquet", tmp_path)
    log = read_recording(cell / "light.parquet")
    write_recording(replace(log, v=log.v * [1, 1, -1, 1, 1, 1]), tmp_path / "faulty.parquet")
    capsys.readouterr()
    saved = tmp_path / "saved"
    assert main([*(word.format(tmp_path) for word in COMMANDS["identify"]), "--save", str(saved)]) == 0
    out, found = capsys.readouterr().out, json.loads((saved / "result.json").read_text())["gains"]
    lost = list[int]()
    for right, mine in zip(sound_gains, found, strict=True):
        if mine["identifiable"]:  # 3 deviations refuse it; the size of the fault is found to a tenth
            assert abs(mine["estimate"] - right["estimate"]) < 3.3 * right["std"]
        elif right["identifiable"]:
            assert re.fullmatch(r"the gain is (off by .* %|invalid): v3 is negated in faulty.*", mine["reason"])
            lost.append(mine["joint"])
        else:
            assert mine["reason"].startswith("predicted standard deviation")
    assert lost
    assert "WRONG: " in out
    assert f"{joints_named(lost)} refused because of a fault of the logs." in out


@pytest.fixture(scope="module")
def late_cell(cell, tmp_path_factory) -> Path:
    """The same with currents that are logged 7.3 ms late in all logs."""
    folder = tmp_path_factory.mktemp("late")
    for name in ("gains.toml", "payload-light.toml"):
        shutil.copy(cell / name, folder)
    for source, name in (("bare", "bare"), ("light", "faulty")):
        log = read_recording(cell / f"{source}.parquet")
        v = np.column_stack([np.interp(log.t - 7.3e-3, log.t, each) for each in log.v.T])
        write_recording(replace(log, v=v), folder / f"{name}.parquet")
    return folder


@pytest.mark.slow
def test_gains_of_late_currents_are_those_of_sound_logs_once_the_delay_is_undone(
    sound_gains, late_cell, tmp_path, capsys
):
    def told(words: Sequence[str]) -> dict:
        capsys.readouterr()
        assert main([*words, "--json"]) == 0
        return json.loads(capsys.readouterr().out)

    def differences(found: list[dict]) -> list[float]:
        pairs = zip(found, sound_gains, strict=True)
        return [abs(a["estimate"] - b["estimate"]) / b["std"] for a, b in pairs if b["std"]]

    words = [word.format(late_cell) for word in COMMANDS["identify"]]
    late = told(words)["gains"]
    result = told([*words, "--current-delay", "auto", "--save", str(tmp_path / "saved")])
    (delay,) = [each for each in result["diagnoses"] if each["name"] == "delay"]
    assert abs(delay["value"] - 6.8) < 4.0 * delay["std"] < 2.0
    corrected = result["gains"]
    assert max(differences(corrected)) < 0.5
    assert max(differences(late)) > 1.5
    record = json.loads((tmp_path / "saved" / "record.json").read_text())
    assert abs(record["observe"]["current_delay"] + 6.8e-3) < 1e-3  # what is read again from the folder is corrected
    texts = (getattr(part, "text", "") for part in page_of(tmp_path / "saved").parts)
    (again,) = [found[1] for text in texts if (found := re.search(r"delay=(-[\d.e-]+)", text))]
    assert float(again) == record["observe"]["current_delay"]
