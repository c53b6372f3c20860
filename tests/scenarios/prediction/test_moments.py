"""The settings that a draw is represented by."""

import numpy as np
import pytest

from scenarios.experiments.schema import DrawTable
from scenarios.prediction.moments import points_of
from scenarios.support.errors import StudyError


def test_the_points_of_a_draw_are_at_its_mean_and_one_deviation_from_there(quick):
    table = quick.table

    def points(**draw):
        return points_of(DrawTable(**draw), table)

    even = points(target="plant.errors.stribeck", distribution="uniform", parameters={"loc": 0.1, "scale": 0.3})
    assert even.at[0] == {"plant.errors.stribeck": 0.25}
    np.testing.assert_allclose(even.at[1]["plant.errors.stribeck"], 0.25 + 0.3 / np.sqrt(12.0), rtol=1e-12)
    com = points(target="plant.payload.com", distribution="norm", parameters={"loc": 0.01, "scale": 0.002}, apply="add")
    z = 0.142776
    np.testing.assert_allclose(com.at[0]["plant.payload.com"], [0.01, 0.01, z + 0.01], rtol=1e-12)
    steps = np.array([each["plant.payload.com"] for each in com.at[1:]]) - com.at[0]["plant.payload.com"]
    np.testing.assert_allclose(steps, 0.002 * np.eye(3), atol=1e-15)
    both = points(
        target=["plant.payload.mass", "plant.gain"],
        distribution="norm",
        parameters={"loc": 1.1, "scale": 0.2},
        apply="multiply",
        shared=True,
    )
    (_, step) = both.at
    gain = np.array(table.plant.gain)
    np.testing.assert_allclose(both.at[0]["plant.payload.mass"], 1.1 * 7.025, rtol=1e-12)
    np.testing.assert_allclose(step["plant.payload.mass"], 1.3 * 7.025, rtol=1e-12)
    np.testing.assert_allclose(step["plant.gain"], 1.3 * gain, rtol=1e-12)
    each = points(target="plant.gain", distribution="norm", parameters={"loc": [1, 2, 3, 4, 5, 6], "scale": 0.5})
    np.testing.assert_allclose(each.at[0]["plant.gain"], [1, 2, 3, 4, 5, 6], rtol=1e-12)
    assert len(each.at) == 7
    with pytest.raises(StudyError, match="no finite mean or standard deviation"):
        points(target="plant.payload.mass", distribution="cauchy")
