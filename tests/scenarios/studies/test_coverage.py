"""How often intervals hold, and whether the ranks of z are uniform: from closed forms and fresh draws."""

import json
import runpy
import sys

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from places import ROOT
from quick import BRIEF, quick_scenario
from scipy import stats
from study_tables import gathered

from scenarios.experiments.files.loading import load_scenario
from scenarios.experiments.studies.calibration import GRID, Band, Calibration, calibration, simultaneous_band
from scenarios.experiments.studies.monte_carlo import monte_carlo
from scenarios.experiments.studies.statistics import Coverage, joint_statistics
from scenarios.experiments.trials import run_trials
from scenarios.rendering import Page, renderer
from scenarios.rendering.content import Paragraph

sys.path.append(str(ROOT / "docs"))  # where the page of coverage is made
from coverage_claims import Target, curves, joint_claims

LEVEL, DRAWS = 0.9, 4000
ALONE = np.eye(1)
SURE = 4.0 * np.sqrt(LEVEL * (1 - LEVEL) / DRAWS)
"""Four deviations of a level that is found from that many draws."""


def band(trials: int, correlation: np.ndarray = ALONE, *, level: float = LEVEL, seed: int = 5) -> Band:
    return simultaneous_band(correlation, trials, level=level, draws=DRAWS, rng=np.random.default_rng(seed))


def chance_of_staying(within: Band, trials: int) -> float:
    """That the counts of uniform ranks stay in a band at every point: a Markov chain of binomial steps, exact."""
    counts = np.arange(trials + 1)
    chance, before = np.where(counts == 0, 1.0, 0.0), 0.0
    for rank, low, high in zip(GRID, within.low, within.high, strict=True):
        step = (rank - before) / (1.0 - before)
        chance = stats.binom.pmf(counts[:, None] - counts, trials - counts, step) @ chance
        chance[(counts / trials - rank < low - 1e-12) | (counts / trials - rank > high + 1e-12)] = 0.0
        before = rank
    return float(chance.sum())


def test_the_band_holds_uniform_ranks_jointly_at_its_level():
    # At its k-th curve the simulated level is 0.9 or, by what one more k changes, a little above: less than 0.012 here.
    for trials in (60, 170):
        chance = chance_of_staying(band(trials), trials)
        assert LEVEL - SURE < chance < LEVEL + SURE + 0.012


def test_the_band_is_the_narrowest_that_leaves_as_many_simulated_curves_inside_as_its_level_says():
    draws, trials = 300, 40
    within = simultaneous_band(ALONE, trials, level=LEVEL, draws=draws, rng=np.random.default_rng(7))
    z = np.random.default_rng(7).multivariate_normal([0.0], ALONE, (draws, trials), method="eigh")[..., 0]
    curves = (stats.norm.cdf(z)[:, None, :] <= GRID[:, None]).mean(axis=2) - GRID

    def inside(low: np.ndarray, high: np.ndarray) -> float:
        return float(((low - 1e-12 <= curves) & (curves <= high + 1e-12)).all(axis=1).mean())

    step = np.sort(curves, axis=0)
    k = max(k for k in range(1, draws // 2) if inside(step[k - 1], step[-k]) >= LEVEL)
    np.testing.assert_allclose(within.low, step[k - 1], atol=1e-12)  # rounding alone
    np.testing.assert_allclose(within.high, step[-k], atol=1e-12)


@pytest.mark.parametrize("at_once", [1, 999])
def test_the_band_does_not_depend_on_how_many_numbers_are_drawn_at_once(monkeypatch, at_once):
    whole = simultaneous_band(np.eye(2), 31, level=LEVEL, draws=100, rng=np.random.default_rng(3))
    monkeypatch.setattr("scenarios.experiments.studies.calibration.AT_ONCE", at_once)
    parts = simultaneous_band(np.eye(2), 31, level=LEVEL, draws=100, rng=np.random.default_rng(3))
    np.testing.assert_array_equal(parts.low, whole.low)
    np.testing.assert_array_equal(parts.high, whole.high)


def test_a_band_of_a_higher_level_is_wider():
    for narrow, wide in ((0.5, 0.9), (0.9, 0.99)):
        inner, outer = band(80, level=narrow), band(80, level=wide)
        assert (outer.low <= inner.low).all()
        assert (outer.high >= inner.high).all()
        assert (outer.high - outer.low).sum() > 1.1 * (inner.high - inner.low).sum()


def test_every_side_of_the_band_leaves_out_as_much():
    # An honest curve turned round, from both ends and upside down, is an honest curve; four counts of sixty of noise.
    found = band(60)
    np.testing.assert_allclose(found.low, -found.high[::-1], atol=4.0 / 60)
    assert (found.low < 0.0).all()
    assert (found.high > 0.0).all()


@pytest.mark.parametrize("shared", [0.0, 0.6, -0.3])
def test_the_band_of_joints_that_err_together_holds_them_jointly_at_its_level(shared):
    correlation = np.eye(3) + shared * (1.0 - np.eye(3))
    within, rng, T, tries = band(30, correlation), np.random.default_rng(19), 30, 1000
    ranks = stats.norm.cdf(rng.multivariate_normal(np.zeros(3), correlation, (tries, T)).reshape(tries, -1))
    curves = [stats.ecdf(each).cdf.evaluate(GRID) - GRID for each in ranks]
    held = np.mean([((within.low - 1e-12 <= c) & (c <= within.high + 1e-12)).all() for c in curves])
    # The level is known to 0.005 from 4000 draws, the share to 0.010 from 1000; four deviations of both, and one k.
    assert abs(held - LEVEL) < 0.042 + 0.012


def test_joints_that_err_alike_are_worth_one_and_not_two():
    alike, one, apart = band(60, np.ones((2, 2))), band(60), band(60, np.eye(2))
    width = {name: float((each.high - each.low).mean()) for name, each in locals().items() if name != "width"}
    # A mean of 99 widths of single counts, each within one of 60.
    np.testing.assert_allclose(width["alike"], width["one"], rtol=0.05)
    np.testing.assert_allclose(width["apart"], width["one"] / np.sqrt(2.0), rtol=0.06)


def quantiles(trials: int) -> np.ndarray:
    """A sample as normal as can be."""
    return stats.norm.ppf((np.arange(trials) + 0.5) / trials)


def held(z: np.ndarray) -> Calibration:
    return calibration(z, level=LEVEL, draws=1000, rng=np.random.default_rng(2))


def test_a_normal_sample_lies_on_the_middle_of_its_band():
    found = held(quantiles(230)[:, None])
    assert not found.outside.any()
    assert np.abs(found.difference).max() <= 0.5 / 230 + 1e-12  # ranks are half a step off at most
    assert found.trials == 230


def test_a_curve_on_the_edge_of_its_band_is_inside_and_one_beyond_is_not():
    edges = Band(low=np.linspace(-0.3, -0.2, len(GRID)), high=np.linspace(0.1, 0.4, len(GRID)))
    for edge, beyond in ((edges.low, -1e-9), (edges.high, 1e-9)):
        for shift, outside in ((0.0, False), (beyond, True)):
            found = Calibration(trials=7, difference=edge + shift, band=edges)
            assert (found.outside == outside).all()


def test_curves_of_wide_narrow_and_shifted_claims_leave_the_band_where_they_should():
    z = quantiles(300)[:, None]
    low, high = GRID < 0.4, GRID > 0.6
    for scale, side in ((0.6, -1.0), (1.7, 1.0)):  # claims too wide: no z far out; too narrow: too many
        found = held(scale * z)
        expected = stats.norm.cdf(stats.norm.ppf(GRID) / scale) - GRID
        np.testing.assert_allclose(found.difference, expected, atol=0.5 / 300 + 1e-12)
        assert found.outside.any()
        assert (side * found.difference[found.outside & low] > 0.0).all()
        assert (side * found.difference[found.outside & high] < 0.0).all()
    for shift in (0.5, -0.5):
        found = held(z + shift)
        assert (np.sign(found.difference[found.outside]) == -np.sign(shift)).all()
        assert found.outside[45:55].all()


def test_several_joints_make_one_curve_of_all_their_ranks():
    z = np.column_stack([quantiles(90) - 0.7, np.random.default_rng(4).permutation(quantiles(90)) + 1.1])
    expected = (stats.norm.cdf(z).reshape(-1, 1) <= GRID).mean(axis=0) - GRID
    np.testing.assert_allclose(held(z).difference, expected, atol=1e-12)


def test_joints_that_err_together_in_the_sample_are_given_the_wider_band():
    z, rng = quantiles(120), np.random.default_rng(8)
    samples = (z[:, None], np.column_stack([z, z]), np.column_stack([z, rng.permutation(z)]))
    one, together, apart = (float(np.mean(each.band.high - each.band.low)) for each in map(held, samples))
    # A correlation of 120 trials is known to 0.09, half of which is the width's; 1000 curves know it to a few percent.
    np.testing.assert_allclose(together, one, rtol=0.07)
    np.testing.assert_allclose(apart, one / np.sqrt(2.0), rtol=0.15)


def study(error: list[float], std: list[float]) -> pd.DataFrame:
    """Joint 4 with a gain of -2.5 and such errors, joint 5 refused, a trial of both that failed."""
    n = len(error)
    e, s = np.array(error), np.array(std)
    found = {"true": -2.5, "std": 2.5 * s, "rel_error": e, "z": -e / s, "identifiable": True, "failure": None}
    gone = {key: np.nan for key in ("true", "std", "rel_error", "z")} | {"identifiable": False}
    table = pd.concat(
        [
            pd.DataFrame({"trial": np.arange(n), "joint": 4, **found, "passed": True}),
            pd.DataFrame({"trial": np.arange(n), "joint": 5, **gone, "failure": None, "passed": True}),
            pd.DataFrame({"trial": n, "joint": [4, 5], **gone, "failure": "Saturated", "passed": False}),
        ],
        ignore_index=True,
    )
    return table.assign(tolerance=0.1).astype({"identifiable": bool, "passed": bool})


def test_what_a_joint_claims_is_held_against_what_it_errs():
    rows = gathered(study([0.039, -0.01, 0.041, -0.07], [0.02, 0.02, 0.02, 0.08])).joints
    statistics = joint_statistics(rows, wanted=0.5, false_alarm=0.01)
    four, five = (joint_claims(*each) for each in zip(rows, statistics, strict=True))
    assert (four.statistics.joint, four.statistics.failed, four.statistics.refused) == (4, 1, 0)
    assert (five.statistics.failed, five.statistics.refused) == (1, 4)
    assert (four.cover_1.share, four.cover_2.share) == (0.5, 0.75)  # z of 1.95, 0.5, 2.05 and 0.875
    assert (four.cover_1.share, four.cover_2.share) == (four.statistics.cover_1, four.statistics.cover_2)
    np.testing.assert_allclose(four.largest, 0.07, rtol=1e-12)
    # Errors have a mean of 0: squares of 15.21, 1, 16.81 and 49 over three; the median claim is 0.02; rounding alone.
    np.testing.assert_allclose(four.width, 0.02 / np.sqrt(82.02e-4 / 3.0), rtol=1e-12)
    assert (four.gains, five.gains) == (4, 0)
    assert (five.largest, five.cover_1, five.cover_2, five.width) == (None, None, None, None)


def test_one_gain_has_no_spread_to_hold_its_claim_against():
    rows = gathered(study([0.03], [0.02])).joints
    four = joint_claims(rows[0], joint_statistics(rows, wanted=0.5, false_alarm=0.01)[0])
    assert (four.width, four.cover_1.share, four.cover_2.share) == (None, 0.0, 1.0)


@pytest.mark.parametrize(
    ("share", "low", "high", "side", "reached"),
    [
        (0.93, 0.90, 0.96, "inside", True),
        (0.975, 0.95, 0.99, "inside", True),
        (0.929, 0.90, 0.95, "below", True),
        (0.92, 0.88, 0.93, "below", True),
        (0.92, 0.88, 0.929, "below", False),
        (0.976, 0.96, 0.99, "above", True),
        (0.99, 0.975, 0.998, "above", True),
        (0.99, 0.976, 0.998, "above", False),
    ],
)
def test_a_coverage_is_wanted_between_both_ends_included(share, low, high, side, reached):
    found, target = Coverage(share=share, low=low, high=high), Target(low=0.93, high=0.975)
    assert (target.side(found), target.reached_by(found)) == (side, reached)


def test_the_picture_has_a_panel_a_calibration_with_curve_band_and_what_is_outside():
    honest, wide = held(quantiles(40)[:, None]), held(0.4 * quantiles(200)[:, None])
    figure = curves({"joint 2": honest, "joint 5": wide}, "series")
    assert [axis.get_title() for axis in figure.axes] == ["joint 2, 40 trials", "joint 5, 200 trials"]
    for axis, each in zip(figure.axes, (honest, wide), strict=True):
        curve, marks = axis.lines[1], axis.lines[2]
        np.testing.assert_array_equal(curve.get_xydata(), np.column_stack([GRID, each.difference]))
        np.testing.assert_array_equal(marks.get_ydata(), each.difference[each.outside])
        edges = axis.collections[0].get_paths()[0].vertices[:, 1]
        assert (edges.min(), edges.max()) == (each.band.low.min(), each.band.high.max())
    assert wide.outside.any()


# The page


@pytest.fixture(scope="module")
def write_page():
    """The functions of docs/coverage.py."""
    return runpy.run_path(str(ROOT / "docs" / "coverage.py"))


def folder(path, rows: pd.DataFrame, asked: int, seed: int = 40):
    """A folder as `rx90 monte-carlo` leaves it, with what the page reads; joints 4 and 5 are called 1 and 2."""
    (path / "trials").mkdir(parents=True)
    last = int(rows["trial"].max())
    rows = rows.assign(joint=rows["joint"] - 3).sort_values(["trial", "joint"])
    rows.to_parquet(path / "trials" / f"00000000-{last:08d}.parquet", index=False)
    tolerance = {"gain": [0.1, 0.2], "identifiable": [True, False], "pass_rate": 0.8}
    identification = {"method": "ls-2011", "gains": {"uncertainty": "jackknife"}}
    table = {"tolerance": tolerance, "identification": identification}
    record = {"study": "monte-carlo", "scenario": {"name": "fleet", "table": table}, "trials": asked, "seed": seed}
    record |= {"command": "rx90 monte-carlo fleet -n 9", "versions": {"numpy": "7.8.9", "code": "0123abcd"}}
    (path / "study.json").write_text(json.dumps(record))
    return path


def test_the_page_says_what_the_rows_say_and_where_they_are_from(tmp_path, write_page):
    errors, stds = [0.03, -0.01, 0.05, -0.07], [0.02, 0.02, 0.02, 0.08]
    study_of = write_page["covered"](folder(tmp_path / "a", study(errors, stds), 5))
    report = write_page["page"]([study_of], Paragraph("As ever."))
    text = renderer("markdown")(report, Page())
    # Spread: the square root of 84e-4 over three; intervals of 2 and 3 of 4 are from a table.
    assert "| 1 | 4 | 0 | 1 | +0.000 ± 2.646 | 5.292 |" in text
    assert "| 50.0 (6.8..93.2) | 75.0 (19.4..99.4) | below, not significantly | 0.38 |" in text
    assert "| 2 | 0 | 4 | 1 | - | - | - | - | - | - | - | - |" in text
    assert "| fleet | ls-2011, jackknife | 5 | 4 | 0 | 1 | 0 | 0 |" in text
    assert "1 of 5 trials failed: Saturated." in text
    assert "    rx90 monte-carlo fleet -n 9" in text
    assert "Versions behind fleet: numpy 7.8.9, code 0123abcd." in text
    assert text.endswith("As ever.\n")
    assert "seeds, hence" not in text
    assert "![Ranks of z with the band of correct intervals](coverage.png)" in text


def test_joints_outside_the_target_are_named_with_what_their_interval_says(tmp_path, write_page):
    rng = np.random.default_rng(6)
    wide = write_page["covered"](folder(tmp_path / "a", study(list(0.01 * rng.normal(size=300)), [0.02] * 300), 301))
    (first, second) = write_page["misses"](wide)
    assert first.startswith("Joint 1: 2 sigma contain 100.0 (98.8..100.0) %, above.")
    assert second.startswith("Joint 1: sigma is 2.")
    assert second.endswith(" times the standard deviation of the errors, more than 1.35.")
    honest = write_page["covered"](folder(tmp_path / "b", study(list(0.01 * quantiles(300)), [0.01] * 300), 301))
    assert write_page["misses"](honest) == []
    rows = [[cell.text for cell in row[2:]] for row in write_page["summary"]([wide, honest]).rows]
    assert rows == [["301", "300", "0", "0", "1", "1"], ["301", "300", "1", "0", "0", "0"]]


def test_studies_with_the_same_seeds_are_said_to_share_their_noise(tmp_path, write_page):
    rows = study([0.03, -0.01, 0.05, -0.07], [0.02, 0.02, 0.02, 0.08])  # five trials
    first, before, after = (
        write_page["covered"](folder(tmp_path / str(seed), rows, 5, seed=seed)) for seed in (40, 36, 45)
    )
    assert write_page["overlaps"]([first, before]) == ["fleet and fleet share seeds of 1 trials, hence their noise."]
    assert write_page["overlaps"]([first, first]) == [
        "All studies have the same 5 seeds, hence the same noise in its own size."
    ]
    assert write_page["overlaps"]([before, first, before]) == [
        "fleet, fleet: the same 5 seeds, hence the same noise in its own size.",
        "fleet, fleet and fleet share seeds of 1 trials, hence their noise.",
    ]
    assert write_page["overlaps"]([first]) == []
    assert write_page["overlaps"]([first, after]) == write_page["overlaps"]([before, after]) == []


def test_trials_that_the_present_code_repeats_are_held_against_those_of_the_study(tmp_path, write_page, monkeypatch):
    scenario = quick_scenario(tmp_path, lasts=BRIEF)
    again = monte_carlo(load_scenario(str(scenario)), 4, 8)
    rows = run_trials(again.scenario, [again.trial(k) for k in range(4)], again.schema, threads=1).to_pandas()
    table = {"tolerance": {"gain": [1.0] * len(set(rows["joint"])), "pass_rate": 0.5}}
    record = {"scenario": {"name": str(scenario), "table": table}, "trials": 4, "seed": 8}

    def departure(changed: pd.DataFrame) -> float:
        return write_page["departure"](
            write_page["Covered"](record=record, rows=changed, joints=(), failures={}, ended=None)
        )

    repeated = list[pa.Table]()

    def once(*words: object, **named: object) -> pa.Table:
        repeated[:] = repeated or [run_trials(*words, **named)]
        return repeated[0]

    monkeypatch.setitem(write_page["departure"].__globals__, "run_trials", once)
    assert departure(rows) == 0.0
    one = (rows["trial"] == 1) & (rows["joint"] == 1)
    shift = 0.25 * rows["std"] / rows["true"]
    # A quarter of a deviation, whichever of both moves by it; rounding alone.
    np.testing.assert_allclose(
        departure(rows.assign(rel_error=rows["rel_error"] + shift.where(one, 0.0))), 0.25, rtol=1e-9
    )
    np.testing.assert_allclose(departure(rows.assign(std=rows["std"].where(~one, 0.8 * rows["std"]))), 0.25, rtol=1e-9)
    assert departure(rows.assign(identifiable=rows["identifiable"] & ~one)) == np.inf


def test_a_study_that_is_not_finished_makes_no_page(tmp_path, write_page):
    with pytest.raises(SystemExit, match="no finished study of rx90 monte-carlo; go on with: rx90 monte-carlo fleet"):
        write_page["covered"](folder(tmp_path / "a", study([0.03, 0.04], [0.02, 0.03]), 4))


def test_honest_shares_leave_the_target_as_often_as_the_binomial_says(write_page):
    held = np.random.default_rng(12).binomial(300, 0.9545, 200_000) / 300
    seen = np.mean((held < 0.93) | (held > 0.975))
    np.testing.assert_allclose(write_page["by_chance"](300), seen, atol=4.0 * np.sqrt(seen / 200_000))
