"""What Python gives to the public functions: other ways in, and one error of ours for what is none."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from consistency_logs import LOOSE, logs_of
from known_logs import BRICK, mounted
from real_friction import Truth

from ident.identification import identify
from ident.model.arm import arm_from_pinocchio, load_arm, load_pinocchio, minimal_model
from ident.preparation import REPORTED, prepare
from ident.recordings.files import read
from ident.recordings.recording import Motion, Recording
from ident.support.errors import OptionError, PayloadError, RecordingError, RobotModelError

T = 0.01 * np.arange(60)
Q = np.column_stack((np.sin(3.0 * T), np.cos(2.0 * T + 0.3)))
V = 1.7 * Q + 0.2


@pytest.mark.parametrize(
    ("field", "values", "reason"),
    [
        ("q", np.ma.masked_array(Q, mask=Q > 0.9), "q is not an array of numbers: it has masked values"),
        ("v", V + 0.2j, "v is not an array of numbers: it has values of type complex128"),
        ("t", "now", "t is not an array of numbers"),
        ("v", 1e-13 * V, "v1 is at most 1.9e-13; expected 1e-12 or more, check the unit"),
    ],
)
def test_what_is_no_array_of_plausible_numbers_is_no_recording(field, values, reason):
    with pytest.raises(RecordingError, match=reason) as caught:
        Recording(**{"t": T, "q": Q, "v": V, field: values})
    assert "\n" not in str(caught.value)


def test_logs_that_are_none_are_refused_before_anything_is_computed(axes):
    for reason, logs in {
        "there are no logs": [],
        "logs are NoneType": None,
        "logs are str": "bare.csv",
        "log 2 is str": [Recording(T, Q, V), "x.csv"],
    }.items():
        with pytest.raises(RecordingError, match=f"{reason}.*expected motions from ident.read"):
            identify(axes, logs)


def test_robots_options_and_payloads_of_other_types_are_refused(axes):
    log = Recording(T, Q, V)
    for error, call in (
        (RobotModelError, lambda: identify("ur10e.urdf", [log])),
        (RobotModelError, lambda: load_arm(None)),
        (OptionError, lambda: identify(axes, [log], observing=3)),
        (OptionError, lambda: identify(axes, [log], gains={"max_rel_std": 0.1})),
        (OptionError, lambda: identify(axes, [log], method=3)),
        (PayloadError, lambda: identify(axes, [Motion(log, 7.3)])),
        (RecordingError, lambda: read(None)),
    ):
        with pytest.raises(error, match=r"expected|unknown method 3"):
            call()


def test_generators_recordings_data_frames_and_pinocchio_models_are_ways_in(axes, tmp_path):
    bare, loaded = logs_of(Truth(), seed=7)
    plain = prepare(mounted(bare, loaded, BRICK), axes, gains=LOOSE)
    mixed = prepare((each for each in (bare, Motion(loaded, BRICK))), axes, gains=LOOSE)
    for one, other in zip(plain.problem.motions, mixed.problem.motions, strict=True):
        assert one.payload == other.payload
        np.testing.assert_array_equal(one.observation.joints[1].V, other.observation.joints[1].V)
    columns = {"t": bare.t} | {f"{kind}{j + 1}": getattr(bare, kind)[:, j] for kind in "qv" for j in range(bare.n)}
    found = read(pd.DataFrame(columns), payload=BRICK)
    for kind in "tqv":
        np.testing.assert_array_equal(getattr(found.recording, kind), getattr(bare, kind))
    assert found.payload is BRICK
    path = Path("examples/arm.urdf")
    model = load_pinocchio(minimal_model(path), path)
    structure = prepare([Recording(T, np.tile(Q, 2), np.tile(V, 2))], model, policy=REPORTED).problem.structure
    np.testing.assert_array_equal(structure.arm.translation, arm_from_pinocchio(model).translation)
