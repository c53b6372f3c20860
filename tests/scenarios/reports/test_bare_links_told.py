"""The table of links that bodies can have."""

import numpy as np
import pytest

from scenarios.reports.bare import links_parts
from scenarios.results.links import Links


@pytest.mark.parametrize(
    ("turns", "unit"), [((True, True), "kg m^2"), ((False, False), "kg"), ((True, False), "kg (m^2)")]
)
def test_the_motor_of_a_sliding_joint_has_a_mass(turns, unit):
    links = Links.model_construct(links=[], farthest_parameter="MX2", farthest_deviations=0.4)
    table = links_parts(links, None, np.array(turns))[0]
    assert {each.title: each.unit for each in table.columns}["Motor"] == unit
