"""Noise, resolution and temperatures of logs."""

import re
from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import at, named
from known_logs import fourier

from ident.diagnosis.diagnosis import Severity
from ident.diagnosis.motion_quality import Warmth, acceleration_noise, noise, noise_std, temperature
from ident.numerics.neighbours import median, quantum
from ident.numerics.signals import smooth_motion
from ident.observation.observation import ObserveOptions
from ident.recordings.description import LogDescription
from ident.recordings.files import read_recording, read_temperatures, write_recording
from ident.recordings.recording import Recording

OPTIONS = ObserveOptions()


def test_noise_is_that_which_was_added_whatever_moves_beneath(rng):
    t = np.arange(0.0, 20.0, 0.008)
    q = fourier(rng, np.array([0.3, -1.1]))(t)[0]
    sigma = np.array([3e-3, 7e-3])
    found = noise_std((q + sigma * rng.normal(size=q.shape)).T)
    # a median of 2500 correlated sizes: some 3 % of itself
    np.testing.assert_allclose(found, sigma, rtol=0.12)
    assert (noise_std(np.zeros((2, 4))) == 0.0).all()


def test_the_quantum_is_the_step_of_an_encoder_though_rounded_in_two_ways_and_none_where_noise_is_finer(rng):
    angle = np.cumsum(rng.normal(0.0, 0.01, 3000))
    np.testing.assert_allclose(quantum(np.round(angle / 0.0037) * 0.0037), 0.0037, rtol=1e-9)  # rounding
    np.testing.assert_allclose(quantum(np.round(angle, 3)), 0.001, rtol=1e-9)
    assert quantum(angle) is None
    assert quantum(rng.choice([0.0, 1.0, 1.37, 2.9], 1000)) is None  # few values, but of no step
    assert quantum(np.array([0.0, 1.0, 0.0])) is None
    counts = np.arange(3, 40)  # 37 values, 36 steps
    angle = np.concatenate([counts * 0.001, counts / 1000.0])
    assert len(np.unique(angle)) > len(counts)  # some differ by the last digit
    np.testing.assert_allclose(quantum(angle[1:]), 0.001, rtol=1e-9)  # 73 samples, two of all values but one
    assert quantum(angle[2:]) is None
    assert quantum(angle[[0, 1, 37, 38]]) is None  # two values


def test_noise_of_an_acceleration_is_that_of_the_filtered_noise(ur_log):
    white = np.random.default_rng(3).normal(0.0, 3e-4, ur_log.q.shape)
    loud = Recording(ur_log.t, ur_log.q + white, ur_log.v)
    inner = slice(20, -20)
    ddq, alone = (smooth_motion(x, ur_log.period, OPTIONS.cutoff_hz)[2][inner] for x in (loud.q, white))
    share = np.sqrt(np.mean(alone**2, axis=0) / np.mean(ddq**2, axis=0))
    np.testing.assert_allclose(acceleration_noise(loud, OPTIONS), share, rtol=0.15)  # 20 s at 15 Hz: 600 values
    assert named(noise(ur_log, OPTIONS), "noise of q").severity is Severity.GOOD


def test_the_coarsest_encoder_is_named(ur_log):
    step, coarse = np.array([1.0, 0.0037, 1.0, 1.0, 0.0011, 1.0]), [1, 4]
    q = ur_log.q.copy()
    q[:, coarse] = np.round(q / step)[:, coarse] * step[coarse]
    found = named(noise(Recording(ur_log.t, q, ur_log.v), OPTIONS), "encoder resolution")
    assert found.sentence == "the coarsest encoder has steps of 0.0037 rad or m (q2)"
    assert named(noise(ur_log, OPTIONS), "encoder resolution").sentence == "encoder steps are finer than the noise"


def test_noise_that_counts_is_weak_and_names_the_joint(ur_log):
    white = np.random.default_rng(5).normal(size=ur_log.q.shape)
    found = named(noise(replace(ur_log, q=ur_log.q + at(4, 2e-3, 0.0) * white), OPTIONS), "noise of q")
    assert (found.severity, found.joints) == (Severity.WEAK, (4,))
    assert found.sentence.startswith("q5 has noise of 0.00")
    slow = np.column_stack([0.7 * np.sin(3.0 * ur_log.t + j) for j in range(6)])
    log = replace(ur_log, q=slow + at(4, 1e-3, 0.0) * white)
    lower = replace(
        OPTIONS,
        cutoff_hz=float(re.match(r"use --cutoff-hz ([\d.]+), or", named(noise(log, OPTIONS), "noise of q").advice)[1]),
    )
    np.testing.assert_allclose(acceleration_noise(log, lower)[4], 0.1, rtol=0.25)  # of 20 s at some Hz
    v = ur_log.v + at(1, 0.6, 0.0) * ur_log.v.std(axis=0) * white
    for standing in (0.0, 50.0):  # a current that holds a weight is not the less noisy
        found = named(noise(replace(ur_log, v=v + standing), OPTIONS), "noise of v")
        assert (found.severity, found.joints) == (Severity.WEAK, (1,))
        assert re.fullmatch(r"v2 has noise of 5[01] % of its standard deviation", found.sentence)  # 0.6 / hypot(1, 0.6)


def warmth(log: str, start: list[float], rise: list[float], samples: int = 400) -> Warmth:
    """A log whose joints warm steadily."""
    return Warmth(log, np.array(start) + np.linspace(0.0, 1.0, samples)[:, None] * np.array(rise))


def test_the_largest_rise_within_a_log_is_named_and_half_of_it_matters():
    (line,) = temperature([warmth("a", [31.0, 28.0, 33.0], [0.5, 4.2, -1.5])])
    # Medians of a twentieth at either end: 0.95 of a steady rise.
    assert line.sentence.startswith("joint 2 warms by 4.0 K: ")
    assert (line.joints, line.logs, line.severity, line.advice) == ((1,), ("a",), Severity.GOOD, None)
    assert line.sentence.endswith("gain may change by 0.2 %, friction by 6 %")  # 4.0 / 2 times 0.1 and 3 %/K


@pytest.mark.parametrize(
    ("within", "between", "grade"), [(6.9, 3.2, Severity.GOOD), (7.2, 3.5, Severity.WEAK), (-7.2, -3.5, Severity.WEAK)]
)
def test_a_tenth_of_the_friction_is_weak_by_half_the_rise_within_a_log_and_the_whole_between(within, between, grade):
    (line,) = temperature([warmth("a", [31.0, 28.0], [0.2, within])])  # 3 %/K times 0.95 times half of the rise
    assert line.severity is grade
    assert (line.advice is None) == (grade is Severity.GOOD)
    logs = [warmth(name, [31.0 + k, 28.0 + k * between], [0.0, 0.0]) for name, k in (("a", 0.0), ("b", 1.0))]
    third = warmth("c", [33.0, 28.0], [0.0, 0.0])  # is held against the first
    lines = temperature([*logs, third])
    assert [each.logs[0] for each in lines] == ["a", "b", "c", "b", "c"]
    assert f"joint 2 is warmer by {between:.1f} K than in a: " in lines[3].sentence
    assert (lines[3].joints, lines[3].severity) == ((1,), grade)
    assert "joint 1 is warmer by 2.0 K than in a: " in lines[4].sentence


@pytest.mark.parametrize("value", [305.0, np.nan])
def test_what_is_no_temperature_of_a_drive_is_not_looked_at(value):
    strange = warmth("a", [31.0, 28.0], [0.1, 0.2])
    strange.celsius[200:, 1] = value
    lines = temperature([strange, warmth("b", [31.0, 28.0], [0.1, 0.2]), warmth("c", [31.0, 28.0], [0.1, 0.2])])
    assert (lines[0].joints, lines[0].severity, "is ignored" in lines[0].sentence) == ((1,), Severity.WEAK, True)
    assert [each.logs[0] for each in lines[1:]] == ["b", "c", "c"]
    assert "than in b: " in lines[-1].sentence


def test_a_column_that_jumps_or_that_no_drive_has_is_no_temperature():
    torque = warmth("a", [31.0, 28.0], [0.1, 0.2])
    torque.celsius[::2, 0] += 5.1
    assert "the temperature of joint 1 jumps" in temperature([torque])[0].sentence
    for value, taken in ((151.0, False), (149.0, True), (-39.0, True), (-41.0, False)):
        (line,) = temperature([warmth("a", [31.0, value], [0.1, 0.2])])
        assert ("is ignored" in line.sentence) is not taken


@pytest.mark.parametrize("names", [("T1", "T2"), ("joint_temperatures_0", "joint_temperatures_1")])
def test_temperatures_are_read_by_their_columns_in_the_order_of_joints(tmp_path, rng, names):
    path, log = tmp_path / "log.csv", Recording(np.arange(9) * 0.02, *rng.normal(size=(2, 9, 2)), "log")
    write_recording(log, path)
    lines = path.read_text().splitlines()
    more = [f"{names[1]},{names[0]}", *(f"{30.5 + k},{21.5 + 2 * k}" for k in range(9))]
    path.write_text("\n".join(f"{line},{cell}" for line, cell in zip(lines, more, strict=True)))
    found = read_temperatures(path, LogDescription(), 2)
    np.testing.assert_array_equal(found, [[21.5 + 2 * k, 30.5 + k] for k in range(9)])
    np.testing.assert_array_equal(read_recording(path).q, log.q)
    assert read_temperatures(path, LogDescription(), 3) is None  # not of every joint
    for ending in ("csv", "parquet"):
        write_recording(log, plain := tmp_path / f"plain.{ending}")
        assert read_temperatures(plain, LogDescription(), 2) is None


@pytest.mark.parametrize("samples", [1, 7, 12])
def test_the_median_of_each_row_is_that_of_numpy(rng, samples):
    x = np.round(rng.normal(size=(3, samples)), 1)  # with ties
    np.testing.assert_array_equal(median(x), np.median(x, axis=1))
