import numpy as np
import pytest

from ident.recordings.motion import ABSOLUTE, Motion, in_order_of_time
from ident.recordings.recording import Recording


def motions(*starts: float) -> list[Motion]:
    t = np.arange(5.0)
    return [Motion(Recording(t + start, np.outer(t, [0.3]), np.outer(t, [k + 2.0]))) for k, start in enumerate(starts)]


def order(*starts: float) -> list[int]:
    return [round(float(motion.recording.v[1, 0])) - 2 for motion in in_order_of_time(motions(*starts))]


@pytest.mark.parametrize(
    ("starts", "expected"),
    [
        ((1.73e9, 1.70e9, 1.72e9), [1, 2, 0]),
        ((1.7e9, 1.7e9, 1.6e9), [2, 0, 1]),  # equal ones as they are given
        ((30.0, 0.0, 7.0), [0, 1, 2]),
        ((1.73e9, 4.0, 1.72e9), [0, 1, 2]),
        ((2.0 * ABSOLUTE, ABSOLUTE), [1, 0]),
        ((2.0 * ABSOLUTE, 0.99 * ABSOLUTE), [0, 1]),
        ((5.0,), [0]),
    ],
)
def test_motions_are_sorted_by_absolute_time_and_left_alone_without(starts, expected):
    assert order(*starts) == expected
