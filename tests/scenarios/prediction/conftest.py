"""A scenario to predict."""

import pytest
from quick import FULL_RATE, quick_scenario

from scenarios.experiments.scenario import load_scenario, with_settings
from scenarios.experiments.schema import Scenario


@pytest.fixture(scope="module")
def quick(tmp_path_factory) -> Scenario:
    return with_settings(load_scenario(str(quick_scenario(tmp_path_factory.mktemp("quick")))), FULL_RATE)
