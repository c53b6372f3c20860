from collections.abc import Sequence

import numpy as np
import pandas as pd
import pytest
from page_parts import drawn_intervals, plots, tables
from printed import fits
from scipy import stats
from study_tables import normal_rows

from scenarios.experiments.scenario import load_scenario
from scenarios.rendering.content import Mood
from scenarios.results.sensitivity import Budget, BudgetJoint, Interval, SourceCost, cost_plot, ranking
from scenarios.results.studies import StudyResult, error_plots, worst_trials


def trial_rows(z: np.ndarray, *, joint: int = 4, tolerance: float = 0.02) -> pd.DataFrame:
    """Rows of a joint with a gain of 2 in each trial with a z."""
    numbers = {"true": 2.0, "std": 0.024, "rel_error": -0.012 * z, "z": z, "tolerance": tolerance}
    rows = pd.DataFrame({"trial": np.arange(len(z)), "seed": 3, "joint": joint, **numbers, "failure": None})
    return rows.assign(identifiable=True, passed=True)


def test_coverage_is_drawn_with_the_interval_of_clopper_and_pearson():
    z = np.random.default_rng(9).normal(size=390)
    first, second = trial_rows(np.r_[z, [np.nan] * 21]), trial_rows(np.zeros(411), joint=6)
    first.loc[391:, "identifiable"] = second["identifiable"] = False
    (coverage,) = plots(StudyResult.of(load_scenario("nominal"), 0, pd.concat([first, second])))
    (axes,) = coverage.figure().axes
    (found,) = drawn_intervals(axes)
    assert (len(axes.get_xticks()), list(found)) == (2, [4])
    held = int((np.abs(z) < 2.0).sum())  # of 391: a gain without standard deviation is a miss
    ends = stats.beta.ppf([0.025, 0.975], [held, held + 1], [392 - held, 391 - held])
    assert found[4] == pytest.approx((100.0 * held / 391, *(100.0 * ends)), rel=1e-9)


def test_the_worst_trials_are_told_with_the_command_that_shows_the_first():
    z = [0.5, -4.0, np.nan, 1.5, 0.1, 0.2, 0.3, 0.4, 2.0, -2.5, 3.0]
    rows = pd.DataFrame({"seed": range(11, 22), "joint": [1, 2] * 5 + [1], "z": z, "rel_error": np.multiply(0.01, z)})
    _, table, said, command = worst_trials(rows, "my own")
    assert [[cell.text for cell in row] for row in table.rows] == [
        ["12", "2", "-4.000", "-4.00"],
        ["21", "1", "+3.000", "+3.00"],
        ["20", "2", "-2.500", "-2.50"],
        ["19", "1", "+2.000", "+2.00"],
        ["14", "2", "+1.500", "+1.50"],
    ]
    # As many are beyond it on average, on either side, as one.
    assert f"the largest of 10 normal errors is expected at about {stats.norm.isf(1 / 20):.1f}" in said.text
    assert command.text == "rx90 run 'my own' --seed 12 --save seed-12"
    assert worst_trials(rows[2:3], "my own") == []


def test_the_verdict_names_the_trials_of_the_worst_joint():
    nominal, table = load_scenario("nominal"), normal_rows(40)
    for missed, mood in ((3, Mood.GOOD), (19, Mood.BAD)):
        table["passed"] = (table["trial"] >= missed) | (table["joint"] == 1)
        result = StudyResult.of(nominal, 0, table)
        verdict = next(iter(result.parts()))
        assert (verdict.mood, verdict.strong, result.passed) == (mood, True, mood is Mood.GOOD)
        assert f"{missed} of 40 trials" in verdict.text
    for identifiable in (True, False):
        found = table.assign(identifiable=identifiable & (table["joint"] == 1))
        assert len(error_plots(found)) == identifiable


def test_errors_are_a_density_beside_the_one_of_the_estimated_deviations():
    z = np.random.default_rng(4).normal(size=4000)
    (plot,) = error_plots(pd.concat([trial_rows(z, tolerance=0.03), trial_rows(np.zeros(5), joint=5)]))
    errors, estimated, *limits = plot.figure().axes[0].lines
    assert [errors.get_label(), estimated.get_label()] == ["Errors", "Estimated"]
    x, y = errors.get_data()
    assert np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(x)) == pytest.approx(1.0, rel=1e-9)
    np.testing.assert_allclose(estimated.get_ydata(), stats.norm.pdf(estimated.get_xdata(), scale=1.2), rtol=1e-9)
    assert [each.get_xdata()[0] for each in limits] == [-3.0, 3.0]
    (far,) = error_plots(trial_rows(z, tolerance=0.3))
    assert (len(far.figure().axes[0].lines), "tolerance, 30 %, is outside" in far.caption) == (2, True)
    (small,) = error_plots(trial_rows(0.1 * z))
    last = small.figure().axes[0].lines[1].get_xdata()[-1]
    assert last == pytest.approx(1.1 * 3.0 * 1.2, rel=1e-9)  # three deviations of the estimated ones


def cost(source: str, share: float, rms: float) -> SourceCost:
    size = Interval(value=rms, low=0.9 * rms, high=1.2 * rms)
    return SourceCost(source=source, trials=4, bias=0.0, rms=size, share=share, first=None, total=None)


def budget_of(joint: int, costs: Sequence[SourceCost], silent: Sequence[str] = ()) -> BudgetJoint:
    numbers = {"tolerance": 0.007, "floor": 0.0, "together": 0.02, "samples": 4, "lost": 0, "summed": 0.02}
    return BudgetJoint(joint=joint, costs=list(costs), silent=list(silent), **numbers)


def test_sources_are_ranked_by_their_shares_over_all_joints_and_the_rest_is_told():
    shares = {"a": 0.1, "b": 0.5, "c": 0.05, "d": 0.2, "e": 0.12, "f": 0.03}
    budget = budget_of(3, [cost(source, share, 0.01 * share) for source, share in shares.items()])
    two_halves = budget_of(3, [cost(source, share, 0.01) for source, share in (("d", 0.35), ("e", 0.3))])
    assert ranking([budget, two_halves])[:3] == ["d", "b", "e"]  # 0.55, 0.5, 0.42 in sum, 0.5 the largest
    order = ranking([budget, budget])
    assert order == ["b", "d", "e", "a", "c", "f"]
    plot = cost_plot(budget, order[:3])
    (axes,) = plot.figure().axes
    assert [each.get_text() for each in axes.get_yticklabels()] == ["b", "d", "e"]
    assert axes.get_ylim()[0] > axes.get_ylim()[1]  # the first at the top
    boxes = [bar.get_bbox() for bar in axes.patches]
    assert [(round(0.5 * (box.y0 + box.y1)), box.x1) for box in boxes] == [(0, 0.5), (1, 0.2), (2, 0.12)]
    rules = [each[:, 0] for each in axes.collections[0].get_segments()]
    np.testing.assert_allclose(rules, [[0.45, 0.6], [0.18, 0.24], [0.108, 0.144]], rtol=1e-12)
    assert plot.caption.startswith("The 3 largest of 6 sources")
    assert [line.get_xdata()[0] for line in axes.lines] == [pytest.approx(0.7)]
    assert not cost_plot(budget.model_copy(update={"tolerance": 0.011}), order).figure().axes[0].lines


def test_a_budget_is_shown_with_the_largest_sources():
    sources = [
        cost(name, share, 0.01 * share) for name, share in zip("abcdefgh", (0.4, *[0.1] * 4, *[0.05] * 3), strict=False)
    ]
    found = Budget(scenario="mine", trials=9, joints=[budget_of(3, sources, silent=["drift"])])
    fits(found.model_dump(mode="json"), "sensitivity")
    (table,) = tables(found)
    assert (len(table.rows), table.shown, table.rest) == (8, 6, "and 2 more with 10 % together")
    assert [cell.text for cell in table.rows[0]] == ["a", "0.400", "0.360..0.480", "+0.000", "40.0", "-", "-"]
    assert any("gave a gain: drift" in getattr(part, "text", "") for part in found.parts())
