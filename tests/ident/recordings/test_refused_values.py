"""Rows that are there twice, a joint that never moves, an inertia that no body has: the cause, and what mends it."""

import numpy as np
import pytest

from ident.payload.payload import payload_from_table
from ident.recordings.recording import Recording
from ident.support.errors import PayloadError, RecordingError

T = 0.004 * np.arange(60)
Q = np.sin(9.0 * T[:, None] + np.array([0.3, 0.7]))
V = np.cos(5.0 * T[:, None] + np.array([0.2, 0.9]))


def test_a_last_column_that_never_changes_may_be_a_gripper():
    for joint, hinted in ((0, False), (1, True)):
        still = Q.copy()
        still[:, joint] = 0.04
        with pytest.raises(RecordingError, match=f"q{joint + 1} never changes") as caught:
            Recording(T, still, V)
        assert ("to leave out a gripper" in str(caught.value)) == hinted


@pytest.mark.parametrize(
    ("mass", "moment", "fits"), [(8.0, 32.5, False), (7.0, 8.7, False), (7.0, 0.6, True), (300.0, 2000.0, True)]
)
def test_an_inertia_that_no_body_of_that_mass_has_is_refused(mass, moment, fits):
    # sqrt(I / m) of 2.0, 1.11, 0.29 and 2.6 m beside 0.35 + 0.15 sqrt(m) = 0.77, 0.75, 0.75 and 2.95 m
    table = {"mass": mass, "known": "mass", "inertia": {"ixx": 0.9 * moment, "iyy": moment, "izz": 0.8 * moment}}
    if fits:
        assert payload_from_table(table).mass == mass
        return
    with pytest.raises(PayloadError, match=r"inertia\.iyy = .* a radius of gyration of .* kg m\^2"):
        payload_from_table(table)
