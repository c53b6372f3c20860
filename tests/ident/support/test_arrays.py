"""Arrays that are stored."""

import numpy as np

from ident.support.arrays import readonly


def test_a_stored_array_keeps_its_values_whatever_is_written_to_the_given_one():
    given = np.array([3.0, -7.0, 0.5])
    view = given[1:]
    view.flags.writeable = False  # its memory is that of an array that can be written to
    stored, seen = readonly(given), readonly(view)
    given[:] = 11.0
    np.testing.assert_array_equal(stored, [3.0, -7.0, 0.5])
    np.testing.assert_array_equal(seen, [-7.0, 0.5])
    assert readonly(stored) is stored
