import numpy as np
import pytest
from scipy import ndimage

from ident.numerics.neighbours import running_median, widened


@pytest.mark.parametrize("reach", [0, 1, 3, 10])
@pytest.mark.parametrize("count", [1, 2, 7, 200])
def test_a_running_median_is_that_of_scipy(reach, count):
    x = np.random.default_rng(count).standard_normal(count)
    np.testing.assert_array_equal(
        running_median(x, reach), ndimage.median_filter(x, size=2 * reach + 1, mode="nearest")
    )


@pytest.mark.parametrize("reach", [1, 4, 300])
def test_a_widened_mask_is_that_of_scipy(reach):
    marked = np.random.default_rng(5).random((200, 3)) < (0.0, 0.02, 0.1)
    expected = ndimage.binary_dilation(marked, np.ones((2 * reach + 1, 1), dtype=np.bool_))
    np.testing.assert_array_equal(widened(marked, reach), expected)
    assert not widened(marked, reach)[:, 0].any()
