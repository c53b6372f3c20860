"""A check of several logs: what it says, in which order, of what it cannot filter."""

import numpy as np
import pytest
from consistency_logs import changed, logs_of, named
from known_logs import BRICK
from pinocchio_arms import standard_parameters_of
from real_friction import GAIN, Truth, three_axes

from ident.diagnosis.diagnosis import Severity
from ident.diagnosis.motion_quality import Warmth
from ident.estimation.problem import GainOptions
from ident.identification import check
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording
from ident.support.errors import RecordingError

pytestmark = pytest.mark.usefixtures("_computed_once")
ASKED = {"observing": ObserveOptions(), "gains": GainOptions()}
PAIR = ASKED | {"loaded": [False, True], "payload": BRICK}


@pytest.fixture
def log() -> Recording:
    return logs_of(Truth())[0]


def test_a_sound_log_has_motions_and_good_diagnoses_and_temperatures_are_judged_beside_it(axes, log):
    found = check([log], axes, **ASKED)
    assert [each.name for each in found.found.findings] == ["friction sign"]  # of a drive mounted the other way
    assert len(found.logs[0][1]) == 3
    assert {"rate", "clipping", "frozen", "noise of q", "range"} <= {each.name for each in found.found.diagnoses}
    warm = Warmth("bare", np.linspace(21.0, 31.0, 400)[:, None] * np.ones(3))
    found = check([log], axes, **ASKED, warmths=[warm])
    assert [each.name for each in found.found.findings] == ["temperature", "friction sign"]


def test_what_was_repaired_is_said_once_and_motions_are_of_the_repaired_log(axes, log):
    found = check([changed(log, q=log.q + np.outer(log.t > 7.0, [0.0, 2.0 * np.pi, 0.0]))], axes, **ASKED)
    assert [each.name for each in found.found.findings] == ["wrapped", "friction sign"]
    assert found.logs[0][1][1].speed < 3.0


def test_a_log_that_cannot_be_filtered_is_wrong_and_has_no_motions_and_one_of_another_arm_is_refused(axes, log):
    found = check([log, Recording(log.t[:120], log.q[:120], log.v[:120], "short")], axes, **ASKED)
    assert (found.found.diagnoses[0].name, found.found.diagnoses[0].logs) == ("filters", ("short",))
    assert found.found.diagnoses[0].sentence.startswith("the log cannot be filtered: 0.952 s give")
    assert [motions == () for _, motions in found.logs] == [False, True]
    with pytest.raises(RecordingError, match="2 joints, but robot"):
        check([Recording(log.t, log.q[:, :2], log.v[:, :2])], axes, **ASKED)


def test_a_payload_that_was_never_mounted_or_never_taken_off_is_wrong_and_masses_that_gains_contradict_are_said(
    axes, monkeypatch
):
    monkeypatch.setattr("ident.identification.DEFAULT", "ls-2011")  # quick
    logs, other = (logs_of(Truth(), seed=k) for k in (5, 6))
    for carried in (0, 1):
        found = check([logs[carried], other[carried]], axes, **PAIR).found
        assert (found.diagnoses[0].name, found.diagnoses[0].severity) == ("load", Severity.WRONG)
    links = standard_parameters_of(three_axes())
    for share in (1.0, 1.0 / 2.2):  # of their weight, at which the links are drawn
        found = check(logs, axes, links=share * links, **PAIR).found
        assert (named(found.diagnoses, "link masses").severity is Severity.GOOD) == (share == 1.0)
        assert found.severity is not Severity.WRONG


def test_how_well_a_payload_will_show_is_predicted_of_a_first_log_that_is_bare(axes, log):
    for loaded, expected in (([False], 1), ([True], 0)):
        said = check([log], axes, **PAIR | {"loaded": loaded}, about=np.abs(GAIN)).found.diagnoses
        assert [each.name for each in said].count("excitation") == expected
