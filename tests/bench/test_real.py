from importlib.metadata import version

import numpy as np
import pandas as pd
import pytest
from undiagnosed import undiagnosed
from weighed_cell import MODEL

from bench import real as bench
from bench.latest import failures, newer
from scenarios.cli import main


@pytest.fixture
def cells(weighed_cell, tmp_path):
    """Two simulated days in the folder of a source, with published gains that are 1.1 times the true ones."""
    with undiagnosed():
        main(["run", str(weighed_cell / "quick.toml"), "--seed", "7", "--save", str(tmp_path / "b"), "--quiet"])
    (tmp_path / "a").symlink_to(weighed_cell / "run")
    true = pd.read_json(tmp_path / "b" / "result.json", typ="series")["gains"]
    sets = [
        {"name": name, "bare": f"{name}/unloaded.parquet"}
        | {"loaded": f"{name}/{p}.parquet", "payload": f"{name}/payload-{p}.toml"}
        for name, p in (("a", "heavy"), ("b", "light"))
    ]
    return {"name": "Cells", "model": str(MODEL), "published": [1.1 * g["true"] for g in true], "sets": sets}


def test_gains_of_two_days_agree_weigh_and_predict_beside_published_ones(cells, tmp_path):
    board = bench.Board(tmp_path, tmp_path, ["ls-2011"])
    assert board.missing(cells) == []
    with undiagnosed():
        board.run(cells)
    (agree,) = board.agreeing.values()
    assert len(agree) >= 3
    assert sum(agree) >= len(agree) - 1
    ratio, spread = board.drawn["a"].T
    known = np.isfinite(ratio)
    assert (np.abs(ratio - 1.0 / 1.1) < 2.0 * spread)[known].all()  # four deviations
    weighed = {(row[0], row[1]): (row[3], *map(float, row[4].split(" ± "))) for row in board.rows["weights"]}
    assert set(weighed) == {(day, gains) for day in "ab" for gains in ("published", "ls-2011")}
    for (day, gains), (mass, found, spread) in weighed.items():
        assert mass == {"a": 7.025, "b": 4.275}[day]
        assert abs(found / mass - (1.1 if gains == "published" else 1.0)) < 2.0 * spread / mass
    assert [row[1:3] for row in board.rows["predictions"]] == [["a", "b"], ["b", "a"]]
    assert max(float(row[4]) for row in board.rows["predictions"]) < 15.0
    page = bench.page(board, [cells, {"name": "Elsewhere", "model": "none.urdf"}])
    assert f"{sum(agree)} of {len(agree)} with `ls-2011`" in page
    assert "| Elsewhere | - | - | - | - | no |" in page


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
