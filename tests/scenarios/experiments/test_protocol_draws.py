"""Draws and noise of motions with several payloads."""

import numpy as np
import pytest
from protocols import FOUR, scenario_of
from quick import quick_scenario

from scenarios.experiments.draws import check_draws, drawn_settings
from scenarios.experiments.run import run
from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.setup import setup_of
from scenarios.experiments.trials import Trial, run_trials, trial_schema
from scenarios.support.errors import WrongDraw

DRAW = """
[random."payload mass"]
target = ["plant.payloads.light.mass", "plant.payloads.heavy.mass"]
distribution = "norm"
parameters = { scale = 0.1 }
apply = "add"
"""


def test_draws_reach_every_payload_by_itself(tmp_path):
    scenario = load_scenario(scenario_of(tmp_path, FOUR, DRAW))
    drawn = np.array([list(drawn_settings(scenario, seed).values()) for seed in range(200)])
    # Means and correlation of 200 pairs: beyond 4 standard errors once in 5000 choices of seeds.
    np.testing.assert_allclose(drawn.mean(axis=0), [4.275, 6.5], rtol=0, atol=4 * 0.1 / np.sqrt(200))
    assert abs(np.corrcoef(drawn.T)[0, 1]) < 4 / np.sqrt(200)
    trials = [Trial(number=k, seed=k) for k in (3, 4)]
    places = ["plant.payloads.heavy.mass", "plant.payloads.light.mass"]
    rows = run_trials(scenario, trials, trial_schema(scenario, places, ()), threads=1).to_pandas()
    np.testing.assert_array_equal(rows[places[::-1]].to_numpy()[::6], drawn[3:5])
    assert rows["failure"].isna().all()
    single = run(setup_of(scenario), 4)
    again = rows[rows.trial == 4]["estimate"].to_numpy()[:3]
    np.testing.assert_array_equal([gain.estimate for gain in single.verdict.gains[:3]], again)


def test_a_trial_s_own_seed_of_a_noise_stream_changes_its_gains(tmp_path):
    scenario = load_scenario(str(quick_scenario(tmp_path)))
    trials = [Trial(number=k, seed=4, settings={}, streams=own) for k, own in enumerate(({}, {"white": 9}))]
    rows = run_trials(scenario, trials, trial_schema(scenario, (), ()), threads=1).to_pandas()
    plain, own = (rows[rows.trial == k]["estimate"].to_numpy()[:3] for k in (0, 1))
    assert np.isfinite(plain).all()
    assert (plain != own).all()


def test_a_draw_of_a_payload_that_no_motion_carries_is_refused(tmp_path):
    scenario = load_scenario(scenario_of(tmp_path, ("bare", "loaded"), DRAW))
    with pytest.raises(WrongDraw, match=r"random\.payload mass: no 'light' in plant\.payloads; known: nothing"):
        check_draws(scenario, setup_of)
    scenario = load_scenario(scenario_of(tmp_path, FOUR, DRAW.replace("payloads.light.mass", "payload.mass")))
    with pytest.raises(WrongDraw, match=r"plant\.payload: no motion of experiment\.protocol carries this payload"):
        check_draws(scenario, setup_of)
