"""Logs before an estimate: what is checked, repaired and left out, by how far they are trusted."""

from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import LOOSE, at, changed, logs_of, without
from known_logs import BRICK
from real_friction import Truth
from refusals import refused

from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Exclusion, Severity
from ident.diagnosis.hypothesis import as_logged, read_as
from ident.estimation.joint_by_joint import joint_by_joint_gains
from ident.observation.observation import ObserveOptions
from ident.preparation import DOUBTED, REPORTED, SIMULATED, Prepared, examined, joined, prepare
from ident.recordings.recording import Motion, Recording
from ident.support.errors import Contradiction, NotIdentifiable, RecordingError


@pytest.fixture
def logs() -> list[Recording]:
    return logs_of(Truth())


def prepared(axes, bare: Recording, loaded: Recording, policy=DOUBTED) -> Prepared:
    return prepare((Motion(bare), Motion(loaded, BRICK)), axes, gains=LOOSE, policy=policy)


def gains(found: Prepared) -> np.ndarray:
    return 1.0 / joint_by_joint_gains(found.problem).solution.inverse


def frozen(log: Recording) -> Recording:
    v = log.v.copy()
    v[700:1150, 1] = v[700, 1]
    return changed(log, v=v)


def test_logs_of_a_simulator_are_not_repaired(axes, logs):
    turned = changed(logs[1], q=logs[1].q + np.outer(np.arange(2500) >= 900, [0.0, 2.0 * np.pi, 0.0]))
    found = prepared(axes, logs[0], turned)
    (done,) = found.diagnoses
    assert (done.name, done.severity, done.logs) == ("wrapped", Severity.WEAK, ("loaded",))
    np.testing.assert_allclose(found.motions[1].recording.q, logs[1].q, atol=1e-12)
    np.testing.assert_allclose(gains(found), gains(prepared(axes, *logs)), rtol=1e-9)
    raw = prepared(axes, logs[0], turned, policy=SIMULATED)
    assert raw.motions[1].recording is turned
    assert raw.diagnoses == ()


def test_a_log_with_a_gap_is_used_in_parts_of_one_mounting_and_looked_at_in_the_longest_one(axes, logs):
    found = prepared(axes, logs[0], without(logs[1], range(1100, 1300)))
    assert [each.recording.name for each in found.motions] == ["bare", "loaded, part 1", "loaded, part 2"]
    assert [each.payload for each in found.motions] == [None, BRICK, BRICK]
    assert found.problem.payloads == (BRICK,)
    assert len(found.diagnoses) == 1
    torn = without(logs[1], range(700, 900))
    found = examined(torn, axes, ObserveOptions())
    assert [len(each.t) for each in found.repaired] == [700, 1600]
    np.testing.assert_array_equal(found.longest.t, torn.t[700:])
    assert found.longest.name == "loaded"


def test_what_is_repaired_is_said_once_though_another_repair_changes_what_is_said_of_it(axes, logs):
    # Two samples are lost unseen, and the log stops for 1.7 s while the arm does.
    kept = np.setdiff1d(np.arange(len(logs[1].t)), [303, 304])
    t = logs[1].t[: len(kept)] + np.where(kept >= 1100, 1.7, 0.0)
    found = examined(Recording(t, logs[1].q[kept], logs[1].v[kept], "loaded"), axes, ObserveOptions())
    assert [each.name for each in found.repairs] == ["lost samples", "missing samples"]
    assert found.repairs[1] not in found.diagnoses["clock"]  # stamps are later by two periods
    assert found.findings == found.repairs


@pytest.mark.parametrize("fault", ["clipped", "frozen"])
def test_spoilt_samples_are_left_out_of_the_gains(axes, logs, fault):
    bare, loaded = logs
    most = at(1, 0.75, 1.0, 3) * [[loaded.v.min(axis=0)], [loaded.v.max(axis=0)]]
    wrong = frozen(loaded) if fault == "frozen" else changed(loaded, v=np.clip(loaded.v, *most))
    sound, raw = gains(prepared(axes, bare, loaded)), gains(prepared(axes, bare, wrong, policy=SIMULATED))
    mended = prepared(axes, bare, wrong)
    assert {each.name for each in mended.diagnoses} == {"clipping" if fault == "clipped" else "frozen"}
    assert all(each.severity is Severity.WEAK and each.joints == (1,) for each in mended.diagnoses)
    assert all(each.sentence.endswith("these samples are left out") for each in mended.diagnoses)
    error, left = abs(raw[1] / sound[1] - 1.0), abs(gains(mended)[1] / sound[1] - 1.0)
    assert error > 0.04
    assert left < 0.35 * error  # fewer rows are noisier, by a per cent or two
    np.testing.assert_allclose(gains(mended)[::2], sound[::2], rtol=1e-12)  # each joint has its own rows


def test_logs_read_otherwise_rest_on_the_same_samples(axes, logs):
    found = prepared(axes, logs[0], frozen(logs[1])).logs()
    hypothesis = as_logged(axes.arm, 2)
    same = read_as(found, hypothesis)
    assert [len(each.V) for each in same.rows] == [len(each.V) for each in found.rows]
    exchanged = read_as(found, hypothesis.changed([1], v_order=np.array([1, 0, 2])))
    lost = len(found.rows[0].V) - len(exchanged.rows[0].V)
    assert lost > 50  # the current that froze is that of joint 1 now, and its position is that of joint 2


def test_what_a_reading_leaves_as_it_is_is_not_observed_again(axes, logs):
    found, hypothesis = prepared(axes, *logs).logs(), as_logged(axes.arm, 2)
    exchanged = read_as(found, hypothesis.changed([1], v_order=np.array([1, 0, 2])))
    again = [one is other for one, other in zip(found.problem.motions, exchanged.problem.motions, strict=True)]
    assert again == [True, False]
    longer = read_as(found, replace(hypothesis, length_factors=1.1 * np.ones(3)))
    pairs = zip(found.problem.motions, longer.problem.motions, strict=True)
    assert not any(one.observation is other.observation for one, other in pairs)


def test_one_log_for_two_motions_is_refused_where_it_is_a_robots(axes, logs):
    again = replace(logs[0], name="again")
    motions = (Motion(logs[0]), Motion(again))
    refused(NotIdentifiable, "bare and again contain the same motion", prepare, motions, axes, policy=DOUBTED)
    assert [len(prepare(motions, axes, policy=each).motions) for each in (REPORTED, SIMULATED)] == [2, 2]


@pytest.mark.parametrize("policy", [DOUBTED, SIMULATED])
def test_a_log_that_cannot_be_of_the_arm_is_refused_whatever_the_policy(axes, logs, policy):
    bare, loaded = logs
    with pytest.raises(RecordingError, match="bare: 2 joints, but robot"):
        prepared(axes, changed(bare, q=bare.q[:, :2], v=bare.v[:, :2]), loaded, policy=policy)
    degrees = changed(bare, q=np.rad2deg(bare.q))
    doubted = (Contradiction, "all positions are in degrees in bare alone; ")  # found beside all other faults
    error, said = doubted if policy.checked else (RecordingError, "the log looks like degrees")
    refused(error, said, prepared, axes, degrees, loaded, policy=policy)


def test_what_several_places_say_is_joined_the_worst_first():
    one, two = (Diagnosis(name=name, severity=Severity.WRONG, sentence=name) for name in "ab")
    weak = Diagnosis(name="c", severity=Severity.WEAK, sentence="c")
    excluded = Exclusion(family="zero", sentence="zeros")
    found = joined(
        Diagnosed(diagnoses=(weak, one), undetectable=("x",)), Diagnosed(diagnoses=(two, one), excluded=(excluded,))
    )
    assert [each.name for each in found.diagnoses] == ["a", "b", "c"]
    assert (found.excluded, found.undetectable) == ((excluded,), ("x",))


def test_spikes_are_refused_by_the_row_they_are_in(axes, logs):
    v = logs[1].v.copy()
    v[300::170, 1] += 60.0 * np.std(v[:, 1])
    with pytest.raises(RecordingError, match=r"loaded: v2 = .* at row 301, .*; 13 such samples"):
        prepared(axes, logs[0], changed(logs[1], v=v))
