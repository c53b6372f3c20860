"""What the scenarios of the field draw, believe and budget."""

import numpy as np
import pytest

from scenarios.experiments.scenario import load_scenario, setup_of, value_at


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
