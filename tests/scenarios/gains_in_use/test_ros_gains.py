import json
import runpy
from pathlib import Path

import numpy as np
import pytest
from places import ROOT
from weighed_cell import MODEL, PLAIN, identified

from ident.model.arm import load_arm
from ident.recordings.description import LogDescription
from ident.recordings.files import read_recording, write_recording
from ident.recordings.recording import Recording
from scenarios.cli import main

pytestmark = pytest.mark.usefixtures("_all_undiagnosed")


@pytest.fixture(scope="module")
def bags(weighed_cell, tmp_path_factory) -> Path:
    """Recordings at absolute time, as bags."""
    folder = tmp_path_factory.mktemp("bags")
    for name in ("unloaded", "heavy", "light"):
        log = read_recording(weighed_cell / "run" / f"{name}.parquet")
        write_recording(Recording(1.7e9 + log.t, log.q, log.v, name), folder / f"{name}.csv")
    words = [MODEL, *(str(folder / f"{name}.csv") for name in ("unloaded", "heavy", "light"))]
    runpy.run_path(str(ROOT / "examples" / "ur_bag.py"))["main"](words)
    return folder


@pytest.mark.slow
def test_bags_give_the_gains_of_the_recordings_that_they_hold(bags, weighed_cell, capsys):
    read = read_recording(bags / "heavy", LogDescription(signal="current", joints=load_arm(MODEL).joint_names))
    whole = read_recording(weighed_cell / "run" / "heavy.parquet")
    np.testing.assert_array_equal(read.v, whole.v)
    run = weighed_cell / "run"
    words = ["identify", "--model", MODEL, "--unloaded", str(bags / "unloaded"), "--loaded", str(bags / "heavy")]
    words += ["--payload", str(run / "payload-heavy.toml"), "--signal", "torque-after-drive", *PLAIN]
    words += ["--unseen", str(bags / "light"), "--unseen-payload", str(run / "payload-light.toml")]
    assert main([*words, "--json"]) == 0
    out, err = capsys.readouterr()
    for name in ("unloaded", "heavy", "light"):
        assert f"{bags / name}: v is measured after the drive: a gain is the scale of the torque sensor" in err
    by_bag = json.loads(out)
    assert main([*identified(weighed_cell), *PLAIN, "--json"]) == 0
    by_file = json.loads(capsys.readouterr().out)
    for one, other in zip(by_bag["gains"], by_file["gains"], strict=True):
        assert one["identifiable"] == other["identifiable"]
        if one["identifiable"]:  # stamps since 1970 are known to 0.24 microseconds
            np.testing.assert_allclose(one["estimate"], other["estimate"], rtol=1e-4)
    assert by_bag["unseen"]["log"].endswith("light")


def test_a_driver_that_has_another_order_of_joints_is_read_by_their_names(tmp_path):
    model = ROOT / "scenarios" / "catalog" / "robots" / "ur10e" / "arm.xml"
    names = load_arm(model).joint_names
    assert list(names) != sorted(names)
    t = 0.002 * np.arange(400)
    q = 0.1 * np.sin(3.0 * t[:, None] + np.arange(6)) * np.arange(1, 7)
    write_recording(Recording(t, q, 2.0 * np.cos(5.0 * q) + np.arange(6), "one"), tmp_path / "one.csv")
    runpy.run_path(str(ROOT / "examples" / "ur_bag.py"))["main"]([str(model), str(tmp_path / "one.csv")])
    read = read_recording(tmp_path / "one", LogDescription(signal="current", joints=names))
    np.testing.assert_array_equal(read.q, q)
    np.testing.assert_array_equal(read.v, 2.0 * np.cos(5.0 * q) + np.arange(6))
