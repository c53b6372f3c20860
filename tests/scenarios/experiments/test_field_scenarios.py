"""What the scenarios of the field draw, believe and budget."""

import numpy as np
import pytest

from scenarios.experiments.draws import check_draws, drawn_settings
from scenarios.experiments.scenario import load_scenario, value_at
from scenarios.experiments.sensitivity import settings_with, sources_of
from scenarios.experiments.setup import setup_of


@pytest.mark.parametrize(
    ("name", "payloads"), [("field", ("payload",)), ("field-two-weights", ("payloads.light", "payloads.heavy"))]
)
def test_in_the_field_every_run_draws_every_error_and_every_payload(name, payloads):
    scenario = load_scenario(name)
    check_draws(scenario, setup_of)
    first, second = (drawn_settings(scenario, seed) for seed in (1, 2))
    errors = {"load_friction", "coulomb_drift", "viscous_drift", "coulomb_by_direction", "viscous_by_direction"}
    errors |= {"joint_compliance", "base_tilt_x", "base_tilt_y", "d3_error", "r4_error", "zero_error"}
    places = {f"plant.errors.{error}" for error in errors}
    for payload in payloads:
        places |= {f"plant.{payload}.{key}" for key in ("mass", "com", "inertia.ixx", "inertia.iyy", "inertia.izz")}
    assert set(first) == places
    signs = {"plant.errors.coulomb_by_direction": 0.3, "plant.errors.viscous_by_direction": 0.09}
    for place in places - set(signs):
        assert first[place] != second[place]
    for place, size in signs.items():
        assert {drawn_settings(scenario, seed)[place] for seed in range(12)} == {-size, size}
    loads = [drawn_settings(scenario, seed)["plant.errors.load_friction"] for seed in range(60)]
    # Sixty uniform numbers from 0 to 0.1 leave the outer twentieths empty once in twenty times; the seeds are fixed.
    assert 0.0 < min(loads) < 0.01
    assert 0.09 < max(loads) < 0.1


def test_where_friction_drifts_both_kinds_do_by_two_percent_of_their_own_and_nothing_else_is_drawn():
    scenario = load_scenario("drift")
    check_draws(scenario, setup_of)
    drawn = [drawn_settings(scenario, seed) for seed in range(200)]
    places = ("plant.errors.coulomb_drift", "plant.errors.viscous_drift")
    assert all(set(settings) == set(places) for settings in drawn)
    values = np.array([[settings[place] for place in places] for settings in drawn])
    # Two hundred draws know a deviation to 5 %, a correlation to 0.07, a mean to 0.0014; three of these.
    np.testing.assert_allclose(values.std(axis=0), 0.02, rtol=0.15)
    assert np.abs(values.mean(axis=0)).max() < 0.0042
    assert abs(np.corrcoef(values.T)[0, 1]) < 0.21
    assert [motion.loaded for motion in setup_of(scenario).experiments] == [False, True]


@pytest.mark.parametrize("name", ["field", "field-two-weights"])
def test_in_the_field_a_payload_is_believed_with_the_deviations_that_it_is_drawn_with(name):
    scenario = load_scenario(name)
    setup = setup_of(scenario)
    for mounting, believed in setup.payloads.items():
        place = "plant.payload" if mounting == "loaded" else f"plant.payloads.{mounting}"
        true = value_at(setup.scenario.table, f"{place}.mass")
        assert (believed.mass, believed.mass_std) == (true, scenario.table.random["payload mass"].parameters["scale"])
        assert believed.com == tuple(value_at(setup.scenario.table, f"{place}.com"))
        assert believed.com_std == (scenario.table.random["payload centre"].parameters["scale"],) * 3
        share = scenario.table.random["payload inertia"].parameters["scale"]
        inertia, std = np.array(believed.inertia[:3]), np.array(believed.inertia_std[:3])
        for key, value in zip(("ixx", "iyy", "izz"), inertia, strict=True):
            assert value == value_at(setup.scenario.table, f"{place}.inertia.{key}")
        np.testing.assert_allclose(std, share * inertia, rtol=0.02)  # two digits are stated


@pytest.mark.parametrize("name", ["field", "field-two-weights"])
def test_the_error_budget_in_the_field_switches_the_payloads_that_are_mounted(name):
    sources = sources_of(load_scenario(name))
    on = settings_with(sources, {"payload mass": np.full(sources.width["payload mass"], 0.9)}).settings
    masses = {place: value for place, value in on.items() if place.endswith(".mass")}
    expected = (
        {"plant.payload.mass": 7.025}
        if name == "field"
        else {"plant.payloads.light.mass": 4.275, "plant.payloads.heavy.mass": 7.025}
    )
    assert set(masses) == set(expected)
    for place, value in masses.items():
        # The 90th percentile of 25 g, from a table of the normal distribution.
        np.testing.assert_allclose(value - expected[place], 1.2816 * 0.025, rtol=1e-4)
