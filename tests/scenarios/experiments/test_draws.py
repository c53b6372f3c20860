from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from scenarios.experiments.draws import USUAL, drawn_settings, settings_from, spread_of
from scenarios.experiments.scenario import load_scenario, setup_of, value_at, with_settings
from scenarios.experiments.schema import DrawTable, Scenario


def scenario(folder: Path, text: str) -> Scenario:
    path = folder / "mine.toml"
    path.write_text(f'extends = "nominal"\n{text}\n')
    return load_scenario(str(path))


def drawing(folder: Path, target: str, rest: str) -> Scenario:
    return scenario(folder, f"[random.it]\ntarget = {target}\n{rest}")


def values(drawn: Scenario, place: str, count: int) -> np.ndarray:
    return np.array([drawn_settings(drawn, seed)[place] for seed in range(count)])


def test_numbers_have_the_distribution_that_is_named(tmp_path):
    tenth = 'distribution = "norm"\nparameters = { loc = 1.0, scale = 0.1 }\napply = "multiply"'
    mine = drawing(tmp_path, '"plant.gain"', tenth)
    nominal = value_at(mine.table, "plant.gain")
    factor = values(mine, "plant.gain", 400) / nominal
    # Kolmogorov and Smirnov on 2400 numbers; the seeds are fixed, and one choice of seeds in a thousand fails.
    assert stats.kstest(factor.ravel(), stats.norm(1.0, 0.1).cdf).pvalue > 1e-3
    assert np.abs(np.corrcoef(factor.T) - np.eye(6)).max() < 4 / np.sqrt(400)  # joints are drawn by themselves


@pytest.mark.parametrize("name", USUAL)
def test_quantiles_are_those_of_scipy(name):
    table, u, scale = (
        load_scenario("nominal").table,
        np.array([0.003, 0.17, 0.44, 0.61, 0.83, 0.998]),
        np.arange(2.0, 8.0),
    )
    draw = DrawTable(target="plant.gain", distribution=name, parameters={"loc": 0.3, "scale": tuple(scale)})
    expected = getattr(stats, name).ppf(u, loc=0.3, scale=scale)
    assert settings_from(draw, u, table)["plant.gain"] == expected.tolist()  # to the last digit: seeds keep their runs


def test_add_replace_shared_and_arrays_of_parameters(tmp_path):
    half = 'distribution = "uniform"\nparameters = { scale = 0.5 }\napply = "add"'
    masses = values(drawing(tmp_path, '"plant.payload.mass"', half), "plant.payload.mass", 50)
    assert ((masses > 7.025) & (masses < 7.525)).all()
    replaced = drawing(tmp_path, '"plant.gain"', 'distribution = "uniform"\nshared = true')
    gain = values(replaced, "plant.gain", 20)
    assert np.ptp(gain, axis=1).max() == 0.0
    assert gain.max() < 1.0
    six = 'distribution = "uniform"\nparameters = { loc = [1, 2, 3, 4, 5, 6], scale = 0.1 }'
    each = drawing(tmp_path, '["plant.gain", "plant.coulomb_friction"]', six)
    for place in ("plant.gain", "plant.coulomb_friction"):
        np.testing.assert_array_equal(np.floor(values(each, place, 5)), np.tile(np.arange(1, 7), (5, 1)))


@pytest.mark.parametrize("shared", ["true", "false"])
def test_an_array_of_parameters_may_have_a_number_for_each_of_all_targets(tmp_path, shared):
    targets = '["plant.payload.mass", "plant.gain", "plant.payload.com"]'
    ten = "parameters = { loc = [20, 1, 2, 3, 4, 5, 6, 30, 40, 50], scale = 0.1 }"
    mine = drawing(tmp_path, targets, f'distribution = "uniform"\n{ten}\nshared = {shared}')
    for place, expected in (("payload.mass", [20]), ("payload.com", [30, 40, 50]), ("gain", range(1, 7))):
        found = values(mine, f"plant.{place}", 5).reshape(5, -1)
        np.testing.assert_array_equal(np.floor(found), np.tile(expected, (5, 1)))


def test_each_of_a_set_is_chosen_in_its_turn_and_another_draw_does_not_move_the_first(tmp_path):
    mine = drawing(tmp_path, '"experiment.motion"', 'choice = ["drive-gains", "other.toml"]')
    assert {drawn_settings(mine, seed)["experiment.motion"] for seed in range(40)} == {"drive-gains", "other.toml"}
    also = '[random.also]\ntarget = "plant.payload.mass"\ndistribution = "norm"\napply = "add"'
    one, two = (drawing(tmp_path, '"plant.gain"', f'distribution = "norm"\n{more}') for more in ("", also))
    assert drawn_settings(one, 5)["plant.gain"] == drawn_settings(two, 5)["plant.gain"]
    assert drawn_settings(one, 5) != drawn_settings(one, 6)


def test_no_file_is_read_for_a_trial_of_a_resolved_scenario(monkeypatch):
    fleet = load_scenario("fleet")
    setup_of(fleet)  # motion and arm, once a process
    monkeypatch.setattr(Path, "open", None)
    monkeypatch.setattr("builtins.open", None)
    for seed in (3, 5):
        drawn = drawn_settings(fleet, seed)
        ready = setup_of(with_settings(fleet, drawn))
        assert ready.scenario.table.random == {}  # its values are drawn
        assert ready.true_gain.tolist() == drawn["plant.gain"]
        assert ready.experiments[1].plant.payload.mass == drawn["plant.payload.mass"]


def test_mean_and_deviation_of_a_draw_are_those_of_its_distribution():
    table, scale = load_scenario("nominal").table, np.array([0.7, 0.9, 1.3, 1.7, 2.0, 0.4])
    for name, mean, std in (("norm", 0.3, scale), ("uniform", 0.3 + 0.5 * scale, scale / np.sqrt(12.0))):
        draw = DrawTable(target="plant.gain", distribution=name, parameters={"loc": 0.3, "scale": tuple(scale)})
        for own, expected in zip(spread_of(draw, table), (np.broadcast_to(mean, 6), std), strict=True):
            np.testing.assert_allclose(own, expected, rtol=1e-15)  # a rounding
