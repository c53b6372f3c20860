"""A base that stands aslant is found by what gravity does to the currents, and named where that is sure."""

import re
from collections.abc import Sequence

import numpy as np
import pytest
from ident.checks.comparison import compared, prepared
from ident.explanation import Unknowns, unknowns_under_any
from ident.instants import Instants, instants
from ident.readings import as_it_is, readings
from ident.tilt import LEAST, degrees_between, tilt, under_best_gravity
from ident.wiring import check_wiring
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, arm_of, known_logs, ur_like

from ident.errors import Contradiction
from ident.observation import ObserveOptions
from ident.structure import Structure, structure_of

OBSERVING = ObserveOptions()
PULL = 9.81


def aslant(x: float, y: float) -> tuple[float, float, float]:
    """Gravity that points by x and y degrees beside the base's -z."""
    a, b = np.deg2rad((x, y))
    gravity = PULL * np.array([np.sin(a), np.cos(a) * np.sin(b), -np.cos(a) * np.cos(b)])
    return tuple(gravity.tolist())


def logs(x: float, y: float, seed: int = 21):
    """Motions of an arm that stands aslant."""
    return known_logs(ur_like(aslant(x, y)), BRICK, UR_GAIN, np.random.default_rng(seed), middle=UR_MIDDLE, noise=0.005)


@pytest.fixture(scope="module")
def ur() -> Structure:
    """As its model has it: upright."""
    return structure_of(arm_of(ur_like()))


@pytest.fixture(scope="module")
def unknown(ur) -> Unknowns:
    return unknowns_under_any(ur)


def seen(x: float, y: float, seed: int = 21) -> list[Instants]:
    return [instants(each, 150, OBSERVING) for each in logs(x, y, seed)]


@pytest.mark.parametrize(("x", "y"), [(7.0, -4.0), (0.0, 0.0), (-31.0, 22.0)])
def test_gravity_is_found_to_a_third_of_a_degree(ur, unknown, x, y):
    found = under_best_gravity(ur.arm, unknown, seen(x, y), ur.arm.gravity)
    # Noise of 0.5 % at 300 instants errs it by some 0.1 degrees, as much as the search leaves.
    assert degrees_between(found.gravity, np.array(aslant(x, y))) < 0.33
    np.testing.assert_allclose(np.linalg.norm(found.gravity), PULL, rtol=1e-12)  # turned, to rounding


def test_the_angle_between_vectors_is_told_in_degrees_however_long_they_are():
    # exact but for rounding
    np.testing.assert_allclose(
        degrees_between(np.array([0.0, 0.0, -3.0]), np.array([0.0, 5.0, -5.0])), 45.0, rtol=1e-12
    )


def test_a_tilt_is_told_from_three_degrees_on_and_below_where_something_else_is_suspected(ur, unknown):
    def told(motions: Sequence[Instants], *, suspected: bool) -> str | None:
        found = tilt(ur.arm, unknown, motions, [], suspected=suspected)
        return None if found is None else found.reading.words

    much, little = seen(LEAST + 2.0, 0.0), seen(LEAST - 1.5, 0.0)
    assert re.match(
        r"the base tilted by (4\.[7-9]|5|5\.[1-3]) degrees, gravity along \(0\.08", told(much, suspected=False) or ""
    )
    assert told(little, suspected=False) is None
    assert re.match(r"the base tilted by 1\.[2-8] degrees", told(little, suspected=True) or "")
    assert told(much[:1], suspected=True) is None  # one log alone bends it as it likes


def test_an_arm_without_weight_has_no_tilt(unknown):
    assert tilt(arm_of(ur_like((0.0, 0.0, 0.0))), unknown, seen(9.0, 0.0), [], suspected=True) is None


def test_a_base_that_a_reading_has_is_not_told_again_and_one_near_it_is(ur, unknown):
    (corner,) = (each for (each, *_) in readings(ur.arm) if each.words == "gravity along (1, 0, -1) of the base")
    assert tilt(ur.arm, unknown, seen(45.0, 0.0), [corner], suspected=True) is None
    near = tilt(ur.arm, unknown, seen(38.0, 0.0), [as_it_is(ur.arm), corner], suspected=True)
    assert near is not None
    assert near.reading.words.startswith("the base tilted by 38 degrees, gravity along (0.62, ")


def test_logs_of_a_tilted_base_are_refused_by_its_tilt(ur):
    with pytest.raises(Contradiction, match=r"this one: the base tilted by (9\.\d|10) degrees, gravity along \(0\.1"):
        check_wiring(ur, *logs(8.0, 6.0), OBSERVING)


def test_a_check_names_the_tilt(ur):
    found = compared(prepared(ur, logs(4.0, 0.0), OBSERVING))
    assert found.alternatives[0].readings[0].words.startswith("the base tilted by ")
