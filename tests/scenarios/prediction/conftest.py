"""A scenario to predict."""

import pytest
from quick import quick_scenario

from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.schema import Scenario


@pytest.fixture(scope="module")
def quick(tmp_path_factory) -> Scenario:
    return load_scenario(str(quick_scenario(tmp_path_factory.mktemp("quick"))))
