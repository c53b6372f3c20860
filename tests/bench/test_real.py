"""The page of real recordings: from simulated ones in their place, and from real ones where they are."""

import numpy as np
import pandas as pd
import pytest
from weighed_cell import MODEL, make_cell

from bench import real as bench
from scenarios.cli import main


@pytest.fixture
def cells(tmp_path):
    """Two simulated days in the folder of a source, with published gains that are 1.1 times the true ones."""
    cell = make_cell(tmp_path)
    main(["run", str(cell / "quick.toml"), "--seed", "7", "--save", str(tmp_path / "b"), "--quiet"])
    (tmp_path / "a").symlink_to(cell / "run")
    true = pd.read_json(tmp_path / "b" / "result.json", typ="series")["gains"]
    sets = [
        {
            "name": name,
            "bare": f"{name}/unloaded.parquet",
            "loaded": f"{name}/{p}.parquet",
            "payload": f"{name}/payload-{p}.toml",
        }
        for name, p in (("a", "heavy"), ("b", "light"))
    ]
    return {"name": "Cells", "model": str(MODEL), "published": [1.1 * g["true"] for g in true], "sets": sets}


def test_gains_of_two_days_agree_weigh_and_predict_beside_published_ones(cells, tmp_path):
    board = bench.Board(tmp_path, tmp_path, ["ls-2011"])
    assert board.missing(cells) == []
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


def test_ratios_from_bare_motions_stand_beside_those_of_published_gains(tmp_path, monkeypatch):
    ratios = [(0.7, 0.02), (1.0, 0.0), (None, 0.3)]
    joints = [{"joint": j, "ratio": ratio, "rel_std": std} for j, (ratio, std) in enumerate(ratios, 1)]
    board = bench.Board(tmp_path, tmp_path, [])
    source = {"name": "A", "model": "m.urdf", "published": [6.0, 8.0, 2.0]}
    for answer in ({"reference": 2, "joints": joints}, {"refused": "no two joints"}):
        monkeypatch.setattr(bench, "rx90", lambda *words, answer=answer: answer)
        board.compare_ratios(source, {"name": "s", "bare": "b.csv"})
    expected = [[1, 2, "0.7 ± 0.028", "0.75"], [3, 2, "-", "0.25"], ["-", "-", "no two joints", "-"]]
    assert board.rows["ratios"] == [["A", "s", *row] for row in expected]


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
