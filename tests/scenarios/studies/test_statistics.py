import itertools

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from quick import BRIEF, quick_scenario
from scipy import stats
from study_tables import normal_rows

from scenarios import assert_scenario, load
from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.statistics import COLUMNS, allowed_misses, by_joint, joint_statistics
from scenarios.experiments.study_folder import study_folder
from scenarios.experiments.trials import CONTRACT
from scenarios.results.studies import StudyResult
from scenarios.support.errors import ScenarioError

WANTED = 0.7
JOINTS = (5, 2, 3)
"""Out of order, as rows may be; joint 3 is refused always, joint 2 now and then."""


def lopsided() -> pd.DataFrame:
    """Thirty-seven trials of three joints: refused, failed for two reasons, passed and not, a z that is not there."""
    rng, trials = np.random.default_rng(23), np.arange(37)
    failed = {4: "Saturated", 11: "Saturated", 30: "WrongValue"}
    tables = []
    for joint in JOINTS:
        true = (-1.0) ** joint * rng.uniform(0.7, 2.9, len(trials))
        error, std = rng.normal(0.004, 0.013, len(trials)), np.abs(true) * rng.uniform(0.006, 0.019, len(trials))
        found = ~np.isin(trials, list(failed)) & (joint != 3) & ((joint != 2) | (trials % 7 != 6))
        numbers = {"true": true, "std": std, "rel_error": error, "z": error * true / std}
        numbers = {name: np.where(found, values, np.nan) for name, values in numbers.items()}
        table = pd.DataFrame({"trial": trials, "joint": joint, **numbers})
        table["true"] = true  # known of refused trials too
        table["identifiable"], table["passed"] = found, found & (np.abs(error) < 0.0125 + 0.001 * joint)
        table["failure"], table["tolerance"] = table["trial"].map(failed), 0.0125 + 0.001 * joint
        tables.append(table)
    rows = pd.concat(tables, ignore_index=True)
    rows.loc[(rows["trial"] == 8) & (rows["joint"] == 5), "z"] = np.nan  # a claimed deviation of nothing
    return rows.sample(frac=1.0, random_state=7)


def expected(rows: pd.DataFrame) -> dict[int, dict[str, object]]:
    """The same sums from one table of everything, as pandas makes them."""
    found = {}
    for joint, group in rows.groupby("joint"):
        gains = group[group["identifiable"]]
        error, n = gains["rel_error"], len(gains)
        k, trials = int(group["passed"].sum()), len(group)  # ends of Clopper and Pearson
        low, high = stats.beta.ppf([0.025, 0.975], [k, k + 1], [trials - k + 1, trials - k])
        found[joint] = {
            "trials": group["trial"].nunique(),
            "failed": int(group["failure"].notna().sum()),
            "refused": int((group["failure"].isna() & ~group["identifiable"]).sum()),
            "bias": error.mean() if n else None,
            "bias_std": error.sem() if n else None,
            "spread": error.std() if n else None,
            "p95": error.abs().quantile(0.95) if n else None,
            "claimed": ((gains["std"] / gains["true"]) ** 2).mean() ** 0.5 if n else None,
            "cover_1": gains["z"].between(-1.0, 1.0).mean() if n else None,
            "cover_2": gains["z"].between(-2.0, 2.0).mean() if n else None,
            "pass_rate": group["passed"].mean(),
            "pass_low": 0.0 if not group["passed"].any() else low,
            "pass_high": high,
        }
    return found


def test_a_study_in_several_parts_is_summed_up_as_one_table_of_everything(tmp_path):
    rows = lopsided()
    with study_folder(tmp_path, {}, count=37, command="", rows_per_trial=3) as folder:
        for first, last in ((20, 29), (0, 3), (4, 19), (31, 36), (30, 30)):
            part = rows[rows["trial"].between(first, last)].reindex(columns=CONTRACT.names)
            folder.keep(pa.Table.from_pandas(part, CONTRACT, preserve_index=False))
        found = folder.table(COLUMNS)
    sums = expected(rows)
    statistics = joint_statistics(found, wanted=WANTED, false_alarm=0.01)
    assert [each.joint for each in statistics] == sorted(sums)
    for each in statistics:
        for name, value in sums[each.joint].items():
            if value is None:
                assert getattr(each, name) is None
            else:
                # Sums in another order: rounding alone; the beta function's inverse is good to 1e-10.
                rtol = 1e-9 if name in ("pass_low", "pass_high") else 1e-12
                np.testing.assert_allclose(getattr(each, name), value, rtol=rtol, err_msg=f"{each.joint} {name}")
    assert all((gains["claimed"] > 0.0).all() for _, _, gains in by_joint(found))  # also of negative gains
    assert StudyResult.of(load_scenario("nominal"), 5, found).failures == {"Saturated": 2, "WrongValue": 1}


def test_as_many_misses_as_allowed_hold_and_one_more_or_a_rate_below_the_required_one_does_not():
    allowed = allowed_misses(40, 0.9, 0.01 / 2)
    for misses, held in ((allowed, True), (allowed + 1, False)):
        table = normal_rows(40)
        table["passed"] = (table["trial"] >= misses) | (table["joint"] == 2)
        one, two = joint_statistics(table, wanted=0.9, false_alarm=0.01)
        assert (one.passed, one.held, two.held) == (40 - misses, held, True)
    one, two = joint_statistics(normal_rows(2000, std=0.012), wanted=0.95, false_alarm=0.01)
    assert (one.held, two.held) == (False, True)  # 90 % pass
    for trials, wanted in itertools.product((5, 20, 200, 2000), (0.8, 0.95, 0.99)):
        allowed = allowed_misses(trials, wanted, 0.01)
        assert stats.binom.sf(allowed, trials, 1 - wanted) <= 0.01  # chance of more misses than allowed
        assert allowed == 0 or stats.binom.sf(allowed - 1, trials, 1 - wanted) > 0.01  # and not one more


@pytest.mark.usefixtures("_undiagnosed")
def test_a_missed_accuracy_names_joints_and_the_worst_seed(tmp_path):
    quick = quick_scenario(tmp_path, lasts=BRIEF)
    path = tmp_path / "strict.toml"
    path.write_text(quick.read_text().replace("gain = [0.2,", "pass_rate = 0.9\ngain = [1e-6,"))
    with pytest.raises(AssertionError) as caught:
        assert_scenario(str(path), seeds=[4, 7, 5])
    said = str(caught.value)
    assert "FAILED: joint 1 fails the tolerance (worst: joint 1, in 3 of 3 trials; " in said
    worst = max((4, 7, 5), key=lambda seed: abs(load(path).run(seed).verdict.gains[0].z))
    assert f"--seed {worst} " in said
    path.write_text(quick.read_text())
    assert assert_scenario(str(path), seeds=[4]).passed


def test_seeds_that_are_none_or_given_twice_are_refused():
    for seeds, said in (
        ([], "has no trial; give at least one seed"),
        ([0, 1.0], "seed = 1.0: expected a whole number from 0"),
        ([0, "a"], "seed = 'a': expected a whole number from 0"),
        ([0, -1], "seed = -1: expected a whole number from 0"),
        ([3, 4, 3], "a seed is given twice"),
    ):
        with pytest.raises(ScenarioError, match=said):
            assert_scenario("nominal", seeds=seeds)
