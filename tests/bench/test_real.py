from importlib.metadata import version

import numpy as np
import pandas as pd
import pytest

from bench import real as bench
from bench.latest import failures, newer


def test_a_torque_sensor_is_the_motor_times_its_slope_beside_friction(tmp_path):
    rng = np.random.default_rng(6)
    motor, dq = 20.0 * rng.standard_normal((2, 400))
    torque = 0.3 * motor - 0.3 * dq - 2.0 * np.sign(dq) + 0.5
    noisy = torque + 300.0 * rng.standard_normal(400)
    pd.DataFrame({"m1": motor, "d1": dq, "a1": torque + 0.01 * rng.standard_normal(400), "b1": noisy}).to_parquet(
        tmp_path / "s.parquet"
    )
    board = bench.Board(tmp_path, tmp_path, [])
    board.sense({"file": "s.parquet", "joints": 1, "motor": "m{j}", "velocity": "d{j}", "columns": ["a{j}", "b{j}"]})
    (_, _, slope, left), (*_, refused, _) = board.rows["sensors"]
    assert (slope.split(" ± ")[0], left, refused) == ("0.3", "0", "-")


@pytest.mark.real
@pytest.mark.slow
def test_real_recordings_give_what_the_page_says(real, tmp_path):
    bench.main([str(real), "--method", "nls", "--out", str(tmp_path / "real-robots.md")])
    found = (tmp_path / "real-robots.md").read_text(encoding="utf-8").splitlines()
    written = bench.PAGE.read_text(encoding="utf-8").splitlines()

    def of_nls(page):
        return [line for line in page if "| nls |" in line and "Published" not in line]

    assert len(of_nls(written)) == 4
    assert of_nls(found) == of_nls(written)


def test_packages_of_another_version_are_told_with_both():
    lock = f"numpy==0.7.3 \\\n    --hash=sha256:ab\nscipy=={version('scipy')} ; python_version > '3'\nno-such==1.0\n"
    assert newer(lock) == {"numpy": ("0.7.3", version("numpy"))}


def test_tests_that_fail_are_named_with_the_first_line_of_why(tmp_path):
    cases = (
        '<testcase classname="a.b" name="one"/><testcase classname="a.b" name="two"><failure message="gone&#10;more"/>'
        '</testcase><testcase classname="c" name="three"><error message="no module"/></testcase>'
    )
    (tmp_path / "report.xml").write_text(f"<testsuites><testsuite>{cases}</testsuite></testsuites>")
    assert failures(tmp_path / "report.xml") == ["a.b.two: gone", "c.three: no module"]
