import runpy

import numpy as np
from places import ROOT

from ident.model.arm import load_arm
from ident.recordings.description import LogDescription
from ident.recordings.files import read_recording, write_recording
from ident.recordings.recording import Recording


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
