from dataclasses import replace

import numpy as np
import pytest

from scenarios.design.excitation import Design
from scenarios.experiments.scenario import load_scenario, setup_of, setup_without_motion
from scenarios.experiments.schema import Scenario, SourceTable
from scenarios.prediction.budget import predicted_budget
from scenarios.prediction.sources_along import SourcesAlong
from scenarios.support.errors import StudyError

SOURCES = {
    "load": SourceTable(
        target="plant.errors.load_friction", distribution="uniform", parameters={"loc": 0.01, "scale": 0.02}
    ),
    "centre": SourceTable(target="plant.payload.com", distribution="norm", parameters={"scale": 0.002}, apply="add"),
    "either": SourceTable(target="plant.errors.coulomb_drift", choice=(-0.02, 0.05)),
    "tilt": SourceTable(target="plant.errors.base_tilt_x", distribution="norm", parameters={"scale": 1e-5}),
}


def with_sources(scenario: Scenario, **sources: SourceTable) -> Scenario:
    identification = scenario.table.identification.model_copy(update={"method": "ls-2011"})
    update = {"sources": sources, "identification": identification}
    return replace(scenario, table=scenario.table.model_copy(update=update))


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return with_sources(load_scenario("nominal"), **SOURCES)


@pytest.fixture(scope="module")
def sourced(scenario) -> SourcesAlong:
    return SourcesAlong(scenario, np.arange(5))


def motion_of(scenario):
    return setup_of(scenario).experiments[0].trajectory


def test_what_a_design_is_against_is_what_is_predicted_of_the_gains(scenario, sourced):
    # A second way to the same: rows filtered and decimated there, samples at 10 Hz here; some per cent of the whole.
    budget = predicted_budget(scenario)
    drawn = [[cost for cost in joint.costs if cost.source in SOURCES] for joint in budget.joints]
    assert {cost.source for cost in drawn[0]} == set(SOURCES)
    expected = np.array([np.hypot(sum(c.bias for c in k), np.sqrt(sum(c.std**2 for c in k))) for k in drawn])
    assert expected.min() > 2e-3
    np.testing.assert_allclose(sourced(motion_of(scenario), 10.0)[:5], expected, rtol=0.08, atol=3e-4)


def test_sources_that_cost_a_tenth_of_the_costliest_or_less_are_left_out(scenario, sourced):
    assert set(sourced.points) == set(SOURCES)
    assert set(sourced.reduced(motion_of(scenario), 10.0).points) == {"load", "centre", "either"}


def test_a_design_against_everything_adds_squares_of_noise_and_of_errors(scenario, sourced):
    motion, plain = motion_of(scenario), Design.of(setup_without_motion(scenario))
    with_all = replace(plain, added=sourced)
    noise = plain.deviations(motion, 10.0)[:5]
    total = np.hypot(noise, sourced(motion, 10.0)[:5])
    gap = with_all.cost(motion) - plain.cost(motion)
    expected = [np.log(np.linalg.norm(x, ord=8)) + 0.2 * np.log(x).mean() for x in (noise, total)]
    np.testing.assert_allclose(gap, expected[1] - expected[0], rtol=1e-9)  # rounding


def test_true_gains_that_differ_are_no_error_and_add_none_to_what_is(scenario):
    gains = SourceTable(
        target="plant.gain", distribution="norm", parameters={"loc": 1.1, "scale": 0.2}, apply="multiply"
    )
    motion = motion_of(scenario)
    lone = SourcesAlong(with_sources(scenario, gains=gains), np.arange(5))
    np.testing.assert_allclose(lone(motion, 10.0)[:5], 0.0, atol=1e-10)  # an estimate follows its currents: rounding
    with pytest.raises(StudyError, match="nominal: gains: no effect on any gain to identify"):
        lone.reduced(motion, 10.0)
    both, load = (
        SourcesAlong(with_sources(scenario, **sources), np.arange(5))(motion, 10.0)[:5]
        for sources in ({"gains": gains, "load": SOURCES["load"]}, {"load": SOURCES["load"]})
    )
    np.testing.assert_allclose(both, load, rtol=1e-9)  # rounding


def test_noise_alone_and_a_payload_of_another_name_are_refused(scenario):
    white = SourceTable(target="experiment.sensors.current_white", stream="white", off=0.0)
    with pytest.raises(StudyError, match="nominal: no error source changes the plant"):
        SourcesAlong(with_sources(scenario, white=white), np.arange(5))
    with pytest.raises(StudyError, match="--against all needs a bare and a loaded motion"):
        SourcesAlong(load_scenario("field-two-weights"), np.arange(5))
