"""A check of several logs: what it says, in which order, of what it cannot filter."""

import numpy as np
import pytest
from consistency_logs import logs_of
from known_logs import BRICK, UR_GAIN
from pinocchio_arms import standard_parameters_of
from real_friction import Truth, three_axes

from ident.diagnosis.diagnosis import Severity
from ident.diagnosis.motion_quality import Warmth
from ident.diagnosis.samples import SPOILING
from ident.estimation.problem import GainOptions
from ident.identification import check
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording
from ident.support.errors import RecordingError

pytestmark = pytest.mark.usefixtures("_computed_once")
OPTIONS, LIMITS = ObserveOptions(), GainOptions()


def test_a_sound_log_has_motions_and_good_diagnoses(ur, ur_log):
    found = check([ur_log], ur, observing=OPTIONS, gains=LIMITS)
    assert [each.name for each in found.found.findings] == ["friction sign"]  # of a drive mounted the other way
    assert len(found.logs[0][1]) == 6
    assert {"rate", "clipping", "frozen", "noise of q", "range"} <= {each.name for each in found.found.diagnoses}


def test_what_was_repaired_is_said_once_and_motions_are_of_the_repaired_log(ur, ur_log):
    q = ur_log.q.copy()
    q[900:, 1] += 2.0 * np.pi
    found = check([Recording(ur_log.t, q, ur_log.v, "w")], ur, observing=OPTIONS, gains=LIMITS)
    assert [each.name for each in found.found.findings] == ["wrapped", "friction sign"]
    assert found.logs[0][1][1].speed < 3.0


def test_a_log_that_cannot_be_filtered_is_wrong_and_has_no_motions(ur, ur_log):
    short = Recording(ur_log.t[:200], ur_log.q[:200], ur_log.v[:200], "short")
    found = check([ur_log, short], ur, observing=OPTIONS, gains=LIMITS)
    assert (found.found.diagnoses[0].name, found.found.diagnoses[0].logs) == ("filters", ("short",))
    assert found.found.diagnoses[0].sentence.startswith("the log cannot be filtered: 1.59 s give")
    assert [motions == () for _, motions in found.logs] == [False, True]


def test_temperatures_are_judged_beside_the_logs(ur, ur_log):
    warm = Warmth("a/log.csv", np.linspace(21.0, 31.0, 400)[:, None] * np.ones(6))
    found = check([ur_log], ur, observing=OPTIONS, gains=LIMITS, warmths=[warm])
    assert [each.name for each in found.found.findings] == ["temperature", "friction sign"]


def test_a_log_of_another_arm_is_refused(ur, ur_log):
    with pytest.raises(RecordingError, match="5 joints, but robot"):
        check([Recording(ur_log.t, ur_log.q[:, :5], ur_log.v[:, :5])], ur, observing=OPTIONS, gains=LIMITS)


def test_spikes_spoil_their_own_current_and_clipping_its_own(ur_log):
    v = ur_log.v.copy()
    v[[433, 1200], 2] += 3e4
    v[:, 4] = np.maximum(v[:, 4], 0.6 * v[:, 4].min())
    log = Recording(ur_log.t, ur_log.q, v)
    spikes, clipped = SPOILING["values"](log), SPOILING["clipping"](log)
    np.testing.assert_array_equal(np.argwhere(spikes), [[433, 2], [1200, 2]])
    np.testing.assert_array_equal(clipped[:, 4], v[:, 4] == v[:, 4].min())
    assert not np.delete(clipped, 4, axis=1).any()


def test_a_payload_that_was_never_mounted_or_never_taken_off_is_wrong_and_masses_that_gains_contradict_are_said(axes):
    logs, other = (logs_of(Truth(), seed=k) for k in (5, 6))
    asked = {"observing": OPTIONS, "gains": LIMITS, "loaded": [False, True], "payload": BRICK}
    for carried in (0, 1):
        found = check([logs[carried], other[carried]], axes, **asked).found
        assert (found.diagnoses[0].name, found.diagnoses[0].severity) == ("load", Severity.WRONG)
    links = standard_parameters_of(three_axes())
    for share in (1.0, 1.0 / 2.2):  # of their weight, at which the links are drawn
        found = check(logs, axes, links=share * links, **asked).found
        weight = next(each for each in found.diagnoses if each.name == "link masses")
        assert (weight.severity is Severity.GOOD) == (share == 1.0)
        assert found.severity is not Severity.WRONG


def test_how_well_a_payload_will_show_is_predicted_of_a_first_log_that_is_bare(ur, ur_log):
    asked = {"observing": OPTIONS, "gains": LIMITS, "payload": BRICK, "about": np.abs(UR_GAIN)}
    for loaded, expected in (([False], 1), ([True], 0)):
        said = check([ur_log], ur, loaded=loaded, **asked).found.diagnoses
        assert [each.name for each in said].count("excitation") == expected
