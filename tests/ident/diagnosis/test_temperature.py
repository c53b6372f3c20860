"""Temperatures: how much joints warmed, from when on that is too much, what is no temperature."""

import numpy as np
import pytest

from ident.diagnosis.diagnosis import Severity
from ident.diagnosis.motion_quality import Warmth, temperature
from ident.recordings.description import LogDescription
from ident.recordings.files import read_recording, read_temperatures, write_recording
from ident.recordings.recording import Recording


def warmth(log: str, start: list[float], rise: list[float], samples: int = 400) -> Warmth:
    """A log whose joints warm steadily."""
    return Warmth(log, np.array(start) + np.linspace(0.0, 1.0, samples)[:, None] * np.array(rise))


def test_without_temperatures_nothing_is_said():
    assert temperature([]) == []


def test_the_largest_rise_within_a_log_is_named_and_half_of_it_matters():
    (line,) = temperature([warmth("a", [31.0, 28.0, 33.0], [0.5, 4.2, -1.5])])
    # Medians of a twentieth at either end: 0.95 of a steady rise.
    assert line.sentence.startswith("joint 2 warms by 4.0 K: ")
    assert (line.joints, line.logs, line.severity, line.advice) == ((1,), ("a",), Severity.GOOD, None)
    assert line.sentence.endswith("gain may change by 0.2 %, friction by 6 %")  # 4.0 / 2 times 0.1 and 3 %/K


@pytest.mark.parametrize(("rise", "grade"), [(6.9, Severity.GOOD), (7.2, Severity.WEAK), (-7.2, Severity.WEAK)])
def test_a_tenth_of_the_friction_within_a_log_is_weak(rise, grade):
    (line,) = temperature([warmth("a", [31.0, 28.0], [0.2, rise])])  # 3 %/K times 0.95 times half of the rise
    assert line.severity is grade
    assert (line.advice is None) == (grade is Severity.GOOD)


@pytest.mark.parametrize(("rise", "grade"), [(3.2, Severity.GOOD), (3.5, Severity.WEAK), (-3.5, Severity.WEAK)])
def test_between_logs_the_whole_rise_matters(rise, grade):
    logs = [warmth("a", [31.0, 28.0], [0.0, 0.0]), warmth("b", [31.4, 28.0 + rise], [0.0, 0.0])]
    line = temperature(logs)[-1]
    assert f"joint 2 is warmer by {rise:.1f} K than in a: " in line.sentence
    assert (line.joints, line.logs, line.severity) == ((1,), ("b",), grade)


def test_a_third_log_is_held_against_the_first():
    logs = [warmth(name, [20.0 + k, 30.0], [0.0, 0.0]) for k, name in enumerate("abc")]
    lines = temperature(logs)
    assert [each.logs[0] for each in lines] == ["a", "b", "c", "b", "c"]
    assert "joint 1 is warmer by 2.0 K than in a: " in lines[-1].sentence


@pytest.mark.parametrize("value", [305.0, -41.0, np.nan])
def test_what_is_no_temperature_of_a_drive_is_not_looked_at(value):
    strange = warmth("a", [31.0, 28.0], [0.1, 0.2])
    strange.celsius[200:, 1] = value
    lines = temperature([strange, warmth("b", [31.0, 28.0], [0.1, 0.2]), warmth("c", [31.0, 28.0], [0.1, 0.2])])
    assert (lines[0].joints, lines[0].severity) == ((1,), Severity.WEAK)
    assert "is ignored" in lines[0].sentence
    assert [each.logs[0] for each in lines[1:]] == ["b", "c", "c"]
    assert "than in b: " in lines[-1].sentence


@pytest.mark.parametrize(("value", "taken"), [(151.0, False), (149.0, True), (-39.0, True), (-41.0, False)])
def test_a_temperature_that_no_drive_has_is_none_without_a_jump_too(value, taken):
    (line,) = temperature([warmth("a", [31.0, value], [0.1, 0.2])])
    assert ("is ignored" in line.sentence) is not taken


def test_a_column_that_jumps_is_no_temperature():
    torque = warmth("a", [31.0, 28.0], [0.1, 0.2])
    torque.celsius[::2, 0] += 5.1
    assert "the temperature of joint 1 jumps" in temperature([torque])[0].sentence


def log() -> Recording:
    t = np.arange(9) * 0.02
    q, v = np.random.default_rng(2).normal(size=(2, 9, 2))
    return Recording(t, q, v, "log")


@pytest.mark.parametrize("names", [("T1", "T2"), ("joint_temperatures_0", "joint_temperatures_1")])
def test_temperatures_are_read_by_their_columns_in_the_order_of_joints(tmp_path, names):
    path = tmp_path / "log.csv"
    write_recording(log(), path)
    lines = path.read_text().splitlines()
    cells = [f"{30.5 + k},{21.5 + 2 * k}" for k in range(9)]
    more = [f"{names[1]},{names[0]}", *cells]
    path.write_text("\n".join(f"{line},{cell}" for line, cell in zip(lines, more, strict=True)))
    found = read_temperatures(path, LogDescription(), 2)
    np.testing.assert_array_equal(found, [[21.5 + 2 * k, 30.5 + k] for k in range(9)])
    np.testing.assert_array_equal(read_recording(path).q, log().q)
    assert read_temperatures(path, LogDescription(), 3) is None  # not of every joint


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_a_log_without_temperatures_has_none(tmp_path, ending):
    path = tmp_path / f"log.{ending}"
    write_recording(log(), path)
    assert read_temperatures(path, LogDescription(), 2) is None
