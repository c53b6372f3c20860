"""What the plots of a study's page show, against closed forms."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pytest
from scipy import stats

import scenarios.experiments.budget as study_budget_module
from scenarios.experiments.budget import NEEDED, Budget, BudgetJoint, Interval, SourceCost, ranking
from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.statistics import JointRows, joint_statistics
from scenarios.experiments.study_folder import StoredStudy
from scenarios.rendering.content import Paragraph, Table
from scenarios.rendering.plot import Plot
from scenarios.reports.error_density import MOST as MOST_CLAIMS
from scenarios.reports.error_density import panels, promised, reach, varies
from scenarios.reports.pages import sensitivity
from scenarios.reports.pages.monte_carlo import _refused, _worst, coverage_plot, error_plot, pass_plot
from scenarios.reports.pages.sensitivity import cost_plot
from scenarios.reports.pages.sensitivity import share_plot as source_shares
from scenarios.reports.sensitivity import sensitivity_report
from scenarios.support.errors import StudyError


def trial_rows(z: np.ndarray, *, joint: int = 4, tolerance: float = 0.02) -> JointRows:
    return JointRows(
        joint=joint,
        trials=len(z),
        failed=0,
        passed=len(z),
        tolerance=tolerance,
        rel_error=-0.012 * z,
        claimed=np.full(len(z), 0.012),
        z=z,
        step=1,
        true=np.full(len(z), -2.5),
    )


def test_errors_of_a_study_are_a_density_beside_the_one_that_is_claimed():
    z = np.random.default_rng(9).normal(size=400)
    plot = error_plot(4, trial_rows(z))
    errors, claimed = plot.series
    x, y = np.array(errors.x), np.array(errors.y)
    np.testing.assert_allclose(np.sum(np.diff(x) * 0.5 * (y[1:] + y[:-1])), 1.0, rtol=1e-3)  # five digits
    np.testing.assert_allclose(max(claimed.y), stats.norm.pdf(0.0, scale=1.2), rtol=1e-4)  # five digits
    assert [each.at for each in plot.references] == [-2.0, 2.0]
    assert plot.caption == "400 errors."
    assert plot.y.zero
    sure = replace(trial_rows(np.array([1.0, -1.0, -0.5, 0.2])), claimed=np.full(4, 1e-4))
    x, y = (np.array(each) for each in (error_plot(4, sure).series[0].x, error_plot(4, sure).series[0].y))
    np.testing.assert_allclose(
        y[:3], [0.0, 0.25 / (x[2] - x[1]), 0.25 / (x[2] - x[1])], rtol=1e-4
    )  # closed at its ends
    assert y[-1] == 0.0
    few = np.array([1.0, -0.5, 0.2])  # three deviations of 1.2 % and a tenth: 3.96 %
    assert len(error_plot(4, trial_rows(few, tolerance=0.039)).references) == 2
    assert error_plot(4, trial_rows(few, tolerance=0.041)).references == ()
    assert len(error_plot(4, trial_rows(few)).series[0].x) == 2 * (8 + 1)  # bins at least
    far = error_plot(4, trial_rows(z, tolerance=0.5))
    assert far.references == ()
    assert far.caption == "400 errors. The tolerance, 50 %, is outside the plot."


def test_a_study_is_drawn_as_far_as_its_errors_or_three_claimed_deviations_reach():
    wide = replace(trial_rows(np.array([0.3, 1.0, -0.7])), claimed=np.array([0.001, 0.003, 0.02]))
    np.testing.assert_allclose(reach(wide), 1.1 * 1.2, rtol=1e-12)  # -1.2 %, and a tenth more
    sure = replace(wide, claimed=np.array([0.009, 0.005, 0.5]))
    np.testing.assert_allclose(reach(sure), 1.1 * 3.0 * 0.9, rtol=1e-12)  # the middle one of the claims
    assert not any(varies(np.array(values)) for values in ((), (0.3,), (0.3, 0.3 * (1.0 + 1e-12))))
    assert varies(np.array([0.3, 0.3001]))
    assert list(panels((trial_rows(np.array([0.3]), joint=2), wide))) == [4]


@pytest.mark.parametrize("many", [2, MOST_CLAIMS, MOST_CLAIMS + 499, 3 * MOST_CLAIMS])
def test_a_promised_density_is_the_mean_of_five_hundred_claims_or_of_all_that_there_are(many):
    claimed = np.random.default_rng(3).uniform(0.01, 0.03, many)
    rows = replace(trial_rows(np.zeros(many)), claimed=claimed)
    x = np.array([-1.7, 0.0, 2.9])
    wanted = stats.norm.pdf(x, scale=100.0 * claimed[:: 3 if many == 3 * MOST_CLAIMS else 1, None]).mean(axis=0)
    np.testing.assert_allclose(promised(rows, x), wanted, rtol=1e-12)  # sums in another order


def test_coverage_is_that_of_two_deviations():
    z = np.random.default_rng(9).normal(size=390)
    plot = coverage_plot((trial_rows(np.r_[z, np.nan]), trial_rows(np.empty(0), joint=6)))
    (series,) = plot.series
    assert plot.x.categories == ("4", "6")
    assert series.x == ("4",)
    held = int((np.abs(z) < 2.0).sum())  # the gain that claims no deviation is not held by two of them
    assert series.y[0] == pytest.approx(100 * held / 391, rel=6e-5)  # five digits
    interval = stats.binomtest(held, 391).proportion_ci(0.95)
    assert (series.low[0], series.high[0]) == pytest.approx((100 * interval.low, 100 * interval.high), rel=6e-5)


def test_joints_pass_gain_and_fail_as_often_as_is_told():
    joints = [
        replace(trial_rows(np.array([0.3, -1.0, 0.7, 0.2, 0.1])), trials=11, failed=2, passed=5),
        replace(trial_rows(np.array([0.3, -1.0])), joint=5, trials=11, failed=2, passed=1),
    ]
    statistics = joint_statistics(joints, wanted=0.9, false_alarm=0.01)
    plot = pass_plot(statistics)
    (bars,) = plot.series
    assert (plot.x.categories, bars.x, [each.at for each in plot.references]) == (("4", "5"), ("4", "5"), [90.0])
    for k, passed in enumerate((5, 1)):  # Clopper and Pearson by the beta distribution
        ends = stats.beta.ppf([0.025, 0.975], [passed, passed + 1], [11 - passed + 1, 11 - passed])
        assert (bars.low[k], bars.high[k]) == pytest.approx(tuple(100 * ends), rel=6e-5)  # five digits
        assert bars.y[k] == pytest.approx(100 * passed / 11, rel=6e-5)
    _, table = _refused(statistics)
    said = [[cell.text for cell in row] for row in table.rows]
    assert said == [["4", "5", "4", "2"], ["5", "2", "7", "2"]]  # gains, refused, failed


def test_the_worst_trials_of_all_parts_are_told_with_the_command_that_shows_the_first():
    parts = (
        {"seed": [11, 12, 13, 14], "joint": [1, 2, 1, 2], "z": [0.5, -4.0, None, 1.5]},
        {"seed": [*range(15, 22)], "joint": [1, 2, 1, 2, 1, 2, 1], "z": [0.1, 0.2, 0.3, 0.4, 2.0, -2.5, 3.0]},
    )
    tables = [pa.table({**part, "rel_error": [0.01 * (z or 0.0) for z in part["z"]]}) for part in parts]
    rows = SimpleNamespace(parts=lambda: range(2), rows=lambda part, columns: tables[part].select(columns))
    _, table, said, command = _worst(SimpleNamespace(rows=rows, named="my own"))
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


def cost(source: str, share: float, rms: float) -> SourceCost:
    size = Interval(value=rms, low=0.9 * rms, high=1.2 * rms)
    return SourceCost(joint=3, source=source, trials=4, bias=0.0, rms=size, share=share, first=None, total=None)


def budget_of(joint: int, costs: Sequence[SourceCost]) -> BudgetJoint:
    return BudgetJoint(
        joint=joint, costs=list(costs), floor=0.0, together=0.02, samples=4, lost=0, summed=0.02, silent=[]
    )


def test_sources_are_ranked_by_their_shares_over_all_joints_and_the_rest_is_told():
    shares = {"a": 0.1, "b": 0.5, "c": 0.05, "d": 0.2, "e": 0.12, "f": 0.03}
    costs = tuple(cost(source, share, 0.01 * share) for source, share in shares.items())
    budget = budget_of(3, costs)
    two_halves = budget_of(3, [cost(source, share, 0.01) for source, share in (("d", 0.35), ("e", 0.3))])
    assert ranking([budget, two_halves])[:3] == ["d", "b", "e"]  # 0.55, 0.5, 0.42 in sum, 0.5 the largest
    order = ranking([budget, budget])
    assert order == ["b", "d", "e", "a", "c", "f"]
    found = {series.label: series.y for series in source_shares([budget], order).series}
    assert found == {"b": (50.0,), "d": (20.0,), "e": (12.0,), "a": (10.0,), "All others": (8.0,)}
    plot = cost_plot(budget, order[:3], 0.7)
    (bars,) = plot.series
    assert (bars.y, bars.x) == (("b", "d", "e"), (0.5, 0.2, 0.12))
    assert (bars.low, bars.high) == ((0.45, 0.18, 0.108), (0.6, 0.24, 0.144))
    assert plot.caption.startswith("The 3 largest of 6 sources")
    assert [each.at for each in plot.references] == [0.7]
    assert cost_plot(budget, order, 1.1).references == ()


def test_every_joint_s_largest_source_is_drawn_and_the_stack_reaches_the_whole():
    joints = [
        budget_of(j, [cost(f"own {j}", 0.4, 0.01), *(cost(f"shared {k}", 0.11, 0.01) for k in range(5))])
        for j in range(1, 7)
    ]
    plot = source_shares(joints, ranking(joints))
    labels = [series.label for series in plot.series]
    assert sorted(labels[:-1]) == [f"own {j}" for j in range(1, 7)]  # more than there are tones for methods
    assert len({series.tone for series in plot.series}) == 7
    for below, above in pairwise(plot.series):
        assert below.high == above.low
    assert (plot.series[0].low, plot.series[-1].high) == ((0.0,) * 6, (100.0,) * 6)
    assert plot.series[-1].y == (60.0,) * 6


def test_an_index_whose_interval_is_half_of_what_it_can_be_is_withheld():
    narrow, wide = (Interval(value=0.3, low=0.1, high=0.1 + width) for width in (0.49, 0.5))
    found = replace(cost("a", 1.0, 0.01), first=narrow, total=wide)
    report = sensitivity_report(
        Budget(scenario="s", trials=9, joints=[budget_of(1, [found])]), load_scenario("nominal")
    )
    (table,) = (part for part in report.parts if isinstance(part, Table))
    assert [cell.text for cell in table.rows[0][-2:]] == ["0.30 (0.10..0.59)", "-"]
    assert [each.title for each in table.columns if each.words] == ["Source"]


def test_the_page_of_a_budget_begins_with_its_verdict_and_has_ten_sources_a_joint_at_most(tmp_path, monkeypatch):
    scenario = load_scenario("nominal")
    tolerance = scenario.table.tolerance.model_copy(update={"gain": (0.011, 0.012, 0.013, 0.014, 0.015, 0.016)})
    scenario = replace(scenario, table=scenario.table.model_copy(update={"tolerance": tolerance}))
    study = StoredStudy(
        folder=tmp_path, scenario=scenario, named="nominal", kind="sensitivity", seed=3, trials=40,
        command="rx90 sensitivity nominal", versions={},
        rows=SimpleNamespace(table=lambda columns: columns, path=tmp_path),
    )  # fmt: skip
    costs = tuple(cost(f"source {k}", share, 0.02) for k, share in enumerate(np.linspace(0.02, 0.14, 12)))

    def found(rows, sources, joints, seed) -> tuple[BudgetJoint, ...]:
        assert (rows, sources, seed) == (NEEDED, list(scenario.table.sources), 3)
        return tuple(budget_of(j, costs) for j in joints)

    monkeypatch.setattr(sensitivity, "read_study", lambda folder: study)
    monkeypatch.setattr(study_budget_module, "budgets", found)
    report = sensitivity.page(tmp_path)
    said = [part.text for part in report.parts if isinstance(part, Paragraph) and part.strong]
    assert report.parts[0].text == said[0]
    assert said.count(said[0]) == 1
    plots = [part for part in report.parts if isinstance(part, Plot)]
    assert [plot.title for plot in plots[1:]] == [f"Joint {j}" for j in range(1, 6)]  # of joint 6 no gain is wanted
    assert [plot.references[0].at for plot in plots[1:]] == pytest.approx([1.1, 1.2, 1.3, 1.4, 1.5], rel=1e-12)
    assert {plot.series[0].y for plot in plots[1:]} == {tuple(f"source {k}" for k in range(11, 1, -1))}
    silent = [budget_of(joint, []) for joint in range(1, 6)]
    monkeypatch.setattr(study_budget_module, "budgets", lambda *_: silent)
    with pytest.raises(StudyError, match="no trial gave a gain of joint 1, 2, 3, 4, 5;"):
        sensitivity.page(tmp_path)
