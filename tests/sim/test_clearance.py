import numpy as np
from plants import nominal_plant

from sim.clearance import Clearance

MARGIN = 0.2


def test_an_arm_that_stands_up_is_clear_and_one_that_bows_touches_the_floor():
    clearance = Clearance(nominal_plant(), MARGIN)
    upright, bowed = clearance(np.array([[0, 0, 0, 0, 0, 0], [0, 2.2, 0, 0, 0, 0]], dtype=float))
    assert upright > 0.04
    assert bowed < 0.0


def test_the_tip_of_the_payload_reaches_the_floor_where_its_length_says():
    # Shoulder at 0.42 m, straight arm of 0.45 + 0.45 + 0.085 m, payload of 0.1156 m and radius 0.0497 m, tilted by q2:
    # the lowest point is the rim of its far face, 0.42 + 1.1006 cos(q2) - 0.0497 sin(q2). The fork is at 0.045 m.
    clearance = Clearance(nominal_plant(), MARGIN)
    q2 = np.array([1.88, 1.89, 1.90])
    poses = np.zeros((3, 6))
    poses[:, 1] = q2
    expected = 0.42 + 1.1006 * np.cos(q2) - 0.0497 * np.sin(q2)
    np.testing.assert_allclose(clearance(poses), expected, atol=1e-3)  # digits of the payload's moments


def test_a_folded_wrist_brings_the_payload_to_the_forearm():
    clearance = Clearance(nominal_plant(), MARGIN)
    straight, folded = clearance(np.array([[0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 2.09, 0]], dtype=float))
    assert folded < straight
