from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from ident.model.regressor import regressor
from ident.model.structure import structure_of
from ident.numerics.signals import smooth_motion
from ident.observation.observation import ObserveOptions, _moving, following, observe
from ident.recordings.recording import Recording
from ident.support.errors import RecordingError

OPTIONS = ObserveOptions()


@pytest.fixture(scope="module")
def chi() -> np.ndarray:
    return np.random.default_rng(1).uniform(0.5, 2.0, 84)


def smooth_recording(arm, chi: np.ndarray, period: float = 1e-3, seed: int = 2) -> Recording:
    """A motion of three slow sines a joint, and the torques of parameters chi, exactly."""
    t = period * np.arange(round(12.0 / period))
    rng = np.random.default_rng(seed)
    rate = 2 * np.pi * np.array([0.21, 0.43, 0.77])
    A, phase = rng.uniform(0.2, 0.5, (6, 3)), rng.uniform(0, 2 * np.pi, (6, 3))
    angle = t[:, None, None] * rate + phase  # (N, n, 3)
    q, dq, ddq = (A * np.sin(angle)).sum(2), (A * rate * np.cos(angle)).sum(2), -(A * rate**2 * np.sin(angle)).sum(2)
    return Recording(t, q, regressor(arm, q, dq, ddq) @ chi, "synthetic")


@pytest.fixture(scope="module")
def recording(arm, chi) -> Recording:
    return smooth_recording(arm, chi)


def residuals(observation, chi: np.ndarray) -> list[float]:
    base = observation.structure.base.regrouping @ chi
    return [np.linalg.norm(j.V - j.W @ base[j.columns]) / np.linalg.norm(j.V) for j in observation.joints]


def test_rows_satisfy_the_model_that_made_the_recording(recording, structure, chi):
    # What is left is the derivative filter's edge transient and, on Coulomb friction, the reversals it displaces.
    assert max(residuals(observe(recording, structure, OPTIONS), chi)) < 2e-4


def test_a_jittered_clock_is_resampled_and_said_so_and_samples_that_are_missing_are_no_jitter(arm, structure, chi):
    recording = smooth_recording(arm, chi, period=2e-3)
    t = recording.t + np.where(np.arange(len(recording.t)) % 9 == 4, 3e-4, 0.0)  # 15 % of 2 ms
    for lost, said in (([], "; resampled at 500"), ([300, 301], ", and 2 samples are missing; resampled")):
        kept = np.delete(np.arange(len(t)), lost)
        observation = observe(Recording(t[kept], recording.q[kept], recording.v[kept], "log"), structure, OPTIONS)
        (note,) = observation.notes
        assert note.startswith(f"log: sampling intervals vary by 15 %{said}")


def test_rows_have_the_least_weight_that_is_asked_for(recording, structure):
    whole = observe(recording, structure, replace(OPTIONS, min_weight=-1.0)).joints
    for least in (0.3, 0.8):
        heavy = observe(recording, structure, replace(OPTIONS, min_weight=least)).joints
        for every, some in zip(whole, heavy, strict=True):
            np.testing.assert_array_equal(some.position, every.position[every.weight >= least])
            assert len(some.V) < len(every.V)


def test_what_cannot_be_observed_is_refused(recording, structure):
    for rows, joints, said in (
        (slice(1500), slice(6), r"1\.5 s give \d+ rows; at least 60 are needed"),
        (slice(None, None, 50), slice(6), "sampled at 20 Hz, too slow for a cut-off of 15 Hz"),
        (slice(None), slice(5), "5 joints, but robot rx90 has 6"),
    ):
        part = Recording(recording.t[rows], recording.q[rows, joints], recording.v[rows, joints], "log")
        refused(RecordingError, f"log: {said}", observe, part, structure, OPTIONS)


def test_reversals_of_a_coupled_sum_are_left_out_on_both_joints(arm):
    # Joints 5 and 6 at steady opposite speeds: neither reverses, their sum does all the time.
    coupled = structure_of(replace(arm, couplings=((4, 5),)))
    dq = np.ones((200, 6))
    dq[:, 4], dq[:, 5] = 2.0, np.where(np.arange(200) < 100, -2.0, 1.0)
    for reach in (0, 7):
        moving = _moving(coupled, dq, 0.2, reach)
        np.testing.assert_array_equal(moving[:, 4], np.arange(200) > 100 + reach)
        np.testing.assert_array_equal(moving[:, 5], moving[:, 4])
        assert moving[:, :4].all()


def test_samples_near_a_reversal_are_left_out_however_fast_the_joint_turns(recording, structure):
    # Within half a period of the positions' low-pass: 1 / 30 s at 15 Hz, 1 / 12 s at 6 Hz.
    for cutoff_hz in (15.0, 6.0):
        behind = observe(recording, structure, replace(OPTIONS, cutoff_hz=cutoff_hz, reversal_speed=1e-6)).recorded
        for j in range(6):
            turning = behind.t[1:][np.diff(np.sign(behind.dq[:, j])) != 0.0]
            assert len(turning)
            nearest = np.min(np.abs(behind.t[:, None] - turning), axis=1)
            np.testing.assert_allclose(nearest[behind.moving[:, j]].min(), 0.5 / cutoff_hz, atol=1.5 * behind.period)
            np.testing.assert_allclose(nearest[~behind.moving[:, j]].max(), 0.5 / cutoff_hz, atol=1.5 * behind.period)


@pytest.mark.parametrize(("period", "delay"), [(8e-3, 0.016), (4e-3, 0.02), (4e-3, -0.012)])
def test_a_current_delay_is_a_time_whatever_the_sampling_and_negative_for_late_currents(
    arm, structure, chi, period, delay
):
    # Currents stamped some ms before they act are those of a log whose currents come as much later.
    recording = smooth_recording(arm, chi, period)
    moved = replace(recording, v=np.roll(recording.v, -round(delay / period), axis=0))
    told = observe(moved, structure, ObserveOptions(current_delay=delay))
    for a, b in zip(observe(recording, structure, OPTIONS).joints, told.joints, strict=True):
        np.testing.assert_allclose(b.V[2:-2], a.V[2:-2], rtol=0, atol=1e-12 * np.abs(a.V).max())  # the ends are rolled


def test_weights_of_samples_are_those_of_rows_the_other_way_round(structure, rng):
    # <w, D x> = <D' w, x>: also where samples are grouped, left out at the edges and cleared of reversals.
    q = 0.4 * np.sin(np.outer(np.arange(4001) / 1000.0, np.arange(2.0, 8.0))) + 0.1
    recording = Recording(np.arange(4001) / 1000.0, q, rng.normal(size=q.shape))
    observation = observe(recording, structure, ObserveOptions(rows_per_second=21.0))
    behind = observation.recorded

    def rows_of(x: np.ndarray, joint: int) -> np.ndarray:
        return behind.decimator.applied(np.where(behind.moving, behind.sampled(x), 0.0))[:, joint]

    own = rows_of(recording.v, 3)[observation.joints[3].position]
    np.testing.assert_allclose(own, observation.joints[3].V, rtol=1e-9)  # seen as its samples are; rounding
    assert behind.group == 2
    assert behind.edge > 100
    x = rng.normal(size=(4001, 6))
    for joint in (0, 4):
        rows = rows_of(x, joint)
        w = rng.normal(size=len(rows))
        spread = behind.spread(w, joint, 4001)
        assert spread.shape == (4001,)
        np.testing.assert_allclose(spread @ x[:, joint], w @ rows, rtol=1e-10)  # rounding


def test_the_time_of_a_row_is_that_of_its_currents(recording, structure):
    # Filters without phase leave a ramp as it is.
    slope = np.arange(1.3, 7.0)
    ramp = replace(recording, v=recording.t[:, None] * slope)
    options = ObserveOptions(reversal_speed=0.0, rows_per_second=25.0)
    for joint, k in zip(observe(ramp, structure, options).joints, slope, strict=True):
        whole = np.abs(joint.weight - 1.0) < 1e-9
        assert whole.sum() > 50
        np.testing.assert_allclose(joint.V[whole], k * joint.t[whole], rtol=1e-7)
        np.testing.assert_allclose(np.diff(joint.t).min(), 0.04, rtol=1e-9)


def test_rows_use_nothing_of_samples_that_are_spoilt_nor_of_what_filters_make_of_them(recording, structure):
    spoilt = np.zeros(recording.q.shape, dtype=bool)
    spoilt[4003:4010] = True
    q, v = recording.q.copy(), recording.v.copy()
    q[4003:4010, 2] += 0.01
    v[4003:4010, 2] -= 900.0
    whole, sound = observe(recording, structure, OPTIONS).recorded, observe(recording, structure, OPTIONS, spoilt)
    found = observe(replace(recording, q=q, v=v), structure, OPTIONS, spoilt)
    for a, b in zip(found.joints, sound.joints, strict=True):
        np.testing.assert_array_equal(a.position, b.position)
        np.testing.assert_allclose(a.V, b.V, rtol=0, atol=1e-9 * np.abs(b.V).max())
        np.testing.assert_allclose(a.W, b.W, rtol=0, atol=1e-3 * np.abs(b.W).max())  # of the filter beyond its edge
    first = whole.edge + whole.group * np.arange(len(whole.q))  # of the samples that each here is the mean of
    near = (first + whole.group > 4003 - whole.edge) & (first <= 4009 + whole.edge)
    assert whole.group == 2
    np.testing.assert_array_equal(sound.recorded.moving, whole.moving & ~near[:, None])


def test_the_noisiest_joint_decides_how_sharply_reversals_are_located(recording, structure):
    # White noise of density N below f gives speeds a variance of (2 pi)^2 N f^3 / 3: here a tenth of joint 3's speed.
    behind = observe(recording, structure, OPTIONS).recorded
    f, share = 47.0, np.array([0.0, 0.11, 1.0, 0.0, 0.26, 0.0])
    noise = 3.0 * share * 0.01 * np.mean(behind.dq**2, axis=0) / ((2.0 * np.pi) ** 2 * f**3)
    for loud, cutoff_hz in ((1.0, f), (50.0, 15.0), (1e-3, 150.0)):  # from the positions' cut-off to ten times that
        found = replace(behind, noise=loud * noise).dating
        expected = smooth_motion(behind.recording.q, behind.recording.period, cutoff_hz)[1]
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


def log(rate: float, motion_hz: float = 0.8, name: str = "slow") -> Recording:
    t = np.arange(0.0, 20.0, 1.0 / rate)
    q = np.column_stack([0.7 * np.sin(2.0 * np.pi * f * t + 0.3) for f in (0.3, motion_hz)])
    return Recording(t, q, np.cos(q), name)


def test_a_cut_off_that_was_not_chosen_is_a_quarter_of_the_rate_at_most():
    found, note = following(ObserveOptions(), [log(250.0, name="fast"), log(30.0)])
    assert (found.cutoff_hz, found.decimation_cutoff_hz) == pytest.approx((7.5, 7.5), rel=1e-3)
    assert found.rows_per_second == pytest.approx(15.0, rel=1e-3)
    assert note == "slow: logged at 30 Hz, so positions are low-passed at 7.5 Hz and currents at 7.5 Hz"
    found, _ = following(ObserveOptions(), [log(50.0)])  # only what the rate asks for is lowered
    assert (found.cutoff_hz, found.decimation_cutoff_hz) == pytest.approx((12.5, 10.0), rel=1e-3)
    assert found.rows_per_second == 20.0


def test_fast_logs_and_chosen_cut_offs_stay_as_they_are():
    for options, logs in (
        (ObserveOptions(), [log(60.0), log(1000.0)]),
        (ObserveOptions(cutoff_hz=9.0, decimation_cutoff_hz=8.0, rows_per_second=18.0), [log(30.0)]),
    ):
        found, note = following(options, logs)
        assert found is options
        assert note is None


@pytest.mark.parametrize("rate", [30.0, 20.0])
def test_a_motion_that_a_lowered_filter_bends_is_refused_by_joint(rate):
    following(ObserveOptions(), [log(rate, motion_hz=0.1 * rate)])
    # 1 - 1 / (1 + (0.22 / 0.25)^8)
    said = rf"^slow: joint 2 moves too fast for a log at {rate:g} Hz: a low-pass at {0.25 * rate:g} Hz removes 26 % of"
    with pytest.raises(RecordingError, match=said):
        following(ObserveOptions(), [replace(log(200.0), name="fast"), log(rate, motion_hz=0.22 * rate)])


def test_noise_of_encoders_is_no_motion():
    quiet, rng = log(30.0), np.random.default_rng(3)
    noisy = replace(quiet, q=quiet.q + 2e-3 * rng.standard_normal(quiet.q.shape))
    assert following(ObserveOptions(), [noisy])[1] == following(ObserveOptions(), [quiet])[1]


def test_steps_of_a_coarse_encoder_under_a_slow_joint_are_no_motion():
    # A ramp of 2 mrad/s and rests: its steps have lines of their own, far above the white noise of as many steps.
    t = np.arange(0.0, 40.0, 1.0 / 30.0)
    way = np.column_stack(
        [0.7 * np.sin(0.3 * t), np.where((t > 10.0) & (t < 30.0), 0.002 * (t - 10.0), 0.04 * (t >= 30.0))]
    )
    stepped = Recording(t, 1.5e-3 * np.rint(way / 1.5e-3), np.cos(way), "stepped")
    found, _ = following(ObserveOptions(), [stepped])
    assert found.cutoff_hz == pytest.approx(7.5)
    fast = way + np.column_stack([0.0 * t, 0.05 * np.sin(2.0 * np.pi * 6.6 * t)])
    with pytest.raises(RecordingError, match="joint 2 moves too fast"):
        following(ObserveOptions(), [replace(stepped, q=1.5e-3 * np.rint(fast / 1.5e-3))])
