import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from estimates import gain_estimate
from printed import fits

import rx90_mjcf
from ident.estimation.estimators.nls import AllJointsOptions
from ident.estimation.known_gains import estimated_gains
from ident.estimation.problem import GainOptions
from ident.observation.observation import ObserveOptions
from ident.payload.payload import Payload
from ident.recordings.files import read_recording, write_recording
from ident.recordings.recording import Motion, Recording
from scenarios.results.gains_file import SLIDING, TURNING, gains_file, gains_text, read_gains, recording_digest
from scenarios.results.problem_folder import GivenProblem
from scenarios.support.errors import ScenarioError

REASON = 'no load: "0.1" N m \\ ünï'
Q = np.sin(np.outer(np.arange(40) / 9.0, [1.0, 1.3, 0.7, 1.1, 0.9, 1.7]))
LOG = Recording(0.02 * np.arange(40) + 7.3, Q, 2.0 * Q + 0.3, "somewhere/bare.csv")
HEAVY = Recording(0.02 * np.arange(40) + 9.1, 1.1 * Q, 2.5 * Q + 0.7, "somewhere/heavy.csv")
MINIMAL = "[[gains]]\njoint = 1\nestimate = 2\nstd = 0.1\n[[gains]]\njoint = 2\nestimate = -3.5\nstd = 0.2\n"


@pytest.fixture
def file(arm):
    estimate = gain_estimate(2.0, -3.5, None, 0.7, 11.0, 5.0, std=0.1, reason=REASON)
    std, exact = float(np.sqrt(0.0012)), {"payload_rel_std": 0.0, "model_rel_std": 0.0}
    named = (
        replace(each, joint=name, **({"residual_std": std * each.value**2} | exact if hasattr(each, "std") else {}))
        for each, name in zip(estimate.joints, arm.joint_names, strict=True)
    )
    estimate = replace(estimate, covariance=0.001 * (np.eye(5) + 0.2), joints=tuple(named))
    weight = Payload(mass=3.3, mass_std=0.02, known="mass")
    return estimate, gains_file(
        estimate,
        GivenProblem(
            model=rx90_mjcf.MJCF,
            arm=replace(arm, revolute=np.array([True, True, True, False, True, True])),
            motions=[Motion(LOG), Motion(HEAVY, weight), Motion(replace(HEAVY, name="again"), weight)],
            options=AllJointsOptions(friction="cbrt", gain_joint=2, gain_value=-3.5),
            observing=ObserveOptions(cutoff_hz=12.0),
            gains=GainOptions(),
        ),
    )


@pytest.mark.parametrize("ending", [".json", ".toml", ".JSON"])
def test_what_is_written_is_read_back_to_the_last_digit(file, tmp_path: Path, ending):
    estimate, written = file
    path = tmp_path / f"gains{ending}"
    path.write_text(gains_text(written, ending), encoding="utf-8")
    read = read_gains(path)
    assert read == written
    known = estimated_gains(estimate)
    np.testing.assert_array_equal(read.known.value, known.value)
    np.testing.assert_array_equal(read.known.covariance, known.covariance)
    assert read.known.names == known.names
    assert read.known.joints.tolist() == [0, 1, 3, 4, 5]
    table = tomllib.loads(path.read_text()) if ending == ".toml" else json.loads(path.read_text())
    fits(table, "gains")
    assert set(table["gains"][2]) == {"joint", "name", "unit", "identifiable", "reason"}  # no number of a refused joint
    assert "://" not in path.read_text()  # no path of the machine


@pytest.mark.parametrize("ending", [".json", ".toml"])
def test_a_digit_that_changed_is_refused_and_without_the_digest_read(file, tmp_path: Path, ending):
    path, text = tmp_path / f"gains{ending}", gains_text(file[1], ending)
    number = repr(file[1].recordings[0].largest[2])  # of which nothing else is known
    changed = text.replace(number, number.translate(str.maketrans("3579", "1357")))
    path.write_text(changed)
    with pytest.raises(ScenarioError, match=r"gains\.\w+: changed or damaged since it was written"):
        read_gains(path)
    path.write_text(re.sub(r',?\s*"?digest"?\s*[=:]\s*"[0-9a-f]{64}"', "", changed))
    assert read_gains(path).recordings[0].largest[2] != file[1].recordings[0].largest[2]


def test_it_says_where_gains_come_from(file):
    _, written = file
    assert [each.reason for each in written.gains] == [None, None, REASON, None, None, None]
    assert [each.unit for each in written.gains] == [TURNING] * 3 + [SLIDING] + [TURNING] * 2
    assert [each.identifiable for each in written.gains] == [True, True, False, True, True, True]
    assert (written.method, written.robot) == ("ls-2011", "rx90")
    assert [each.name for each in written.recordings] == ["bare.csv", "heavy.csv", "again"]
    assert [each.payload for each in written.recordings] == [None, 1, 1]
    assert written.recordings[1].sha256 == written.recordings[2].sha256 != written.recordings[0].sha256
    assert [each["mass"] for each in written.payloads] == [3.3]
    assert written.options.method["friction"] == "cbrt"
    assert written.options.method["gain_joint"] == 2
    assert written.options.observe["cutoff_hz"] == 12.0
    assert "residual_std" in written.gains[0].model_dump(exclude_none=True)
    assert written.created is not None
    assert written.created.endswith("+00:00")
    assert "numpy" in written.versions


def test_a_recording_has_one_digest_in_whatever_file_it_is(tmp_path: Path):
    digests = {recording_digest(LOG)}
    for name in ("a.csv", "a.parquet"):
        write_recording(LOG, tmp_path / name)
        digests.add(recording_digest(read_recording(tmp_path / name)))
    assert len(digests) == 1
    for field, values in (("t", LOG.t + 1e-9), ("q", LOG.q * 1.0000001), ("v", LOG.v + 1e-9)):
        assert recording_digest(replace(LOG, **{field: values})) not in digests


def test_a_file_from_data_sheets_needs_gains_alone(tmp_path: Path):
    path = tmp_path / "sheet.toml"
    path.write_text(MINIMAL)
    known = read_gains(path).known
    assert known.names == ("1", "2")
    assert known.value.tolist() == [2.0, -3.5]
    np.testing.assert_allclose(known.covariance, np.diag([0.01, 0.04]), rtol=1e-15)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"{", "not JSON: Expecting property name"),
        (b"\xff\xfe{}", "not JSON: byte 0 is not UTF-8"),
        (b"[1, 2]", "no gains; expected a gains file"),
        (b'{"gains": [{"joint": 1, "estimate": NaN, "std": 0.1}]}', "gains.1.estimate"),
        ("[[gains]", "not TOML"),
        ("", "is empty"),
        ("metod = 'nls'\n" + MINIMAL, "unknown key metod; did you mean 'method'"),
        (MINIMAL.replace("joint = 2", "joint = 3"), r"gains of joints \[1, 3\]; expected 1 to n"),
        (MINIMAL.replace("std = 0.2", ""), "gains.2: std is missing; give it, or identifiable = false"),
        (
            MINIMAL.replace("estimate = -3.5", "estimate = 0.0"),
            "joint 2: a gain of 0 is invalid; refuse the joint instead",
        ),
        (MINIMAL + "identifiable = false", "gains.2: refused but has a number"),
        (MINIMAL.replace("std = 0.2", "identifiable = false"), "gains.2: refused but has a number"),
        ("covariance = [[0.01, 0.0], [0.0, 0.05]]\n" + MINIMAL, "gains.2.std = 0.2, but the covariance has 0.2236"),
        ("covariance = [[0.01, 0.03], [0.03, 0.04]]\n" + MINIMAL, "negative eigenvalue"),
    ],
)
def test_what_is_no_gains_file_is_refused_in_one_line(tmp_path: Path, text, words):
    path = tmp_path / ("g.json" if isinstance(text, bytes) else "g.toml")
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ScenarioError, match=words) as caught:
        read_gains(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)
    with pytest.raises(ScenarioError, match="no such file"):
        read_gains(tmp_path / f"none{path.suffix}")
