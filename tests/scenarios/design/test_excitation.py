from dataclasses import replace

import numpy as np
import pytest
from plants import CYLINDER, RX90, nominal_plant

from ident.model.structure import Structure
from ident.payload.payload import Payload
from scenarios.design.excitation import EXCESS, FITTED_HZ, Design, Limits
from scenarios.prediction.deviations import Carried
from sim.errors import TrajectoryError
from sim.plant import Plant
from sim.trajectory import FourierTrajectory, at_rest

WANTED = np.arange(3)


@pytest.fixture(scope="module")
def plant():
    body = replace(CYLINDER, com=(0.05, -0.03, 0.14), inertia=(0.0125, 0.0118, 0.009, 0.0006, -0.0004, 0.0003))
    return nominal_plant(body, gain=np.array([-0.9, 1.2, 1.1, 0.8, -1.3, 1.4]))


def designed(plant: Plant, structure: Structure, limits: Limits) -> Design:
    body = plant.payload
    carried = Carried.nominal(Payload(mass=body.mass, com=body.com, inertia=body.inertia))
    known = {"plant": plant, "structure": structure, "limits": limits, "carried": carried}
    return Design(**known, joints=WANTED, method="ls-2011")


def motion() -> FourierTrajectory:
    return at_rest(RX90.home, *(0.11 * np.random.default_rng(2).normal(size=(2, 6, 3))), 6.0)


def test_limits_are_the_robot_s_and_torques_those_of_its_true_gains_whatever_their_sign(plant):
    limits = Limits.of(plant)
    np.testing.assert_array_equal(limits.torque, np.abs(plant.drives.gain) * plant.drives.current_limit)
    assert (limits.torque > 0).all()
    np.testing.assert_array_equal(limits.velocity, RX90.drives.max_velocity)
    np.testing.assert_array_equal(limits.acceleration, RX90.drives.max_acceleration)
    np.testing.assert_allclose(np.rad2deg(limits.lower), [-160, -137.5, -142.5, -270, -105, -270], rtol=1e-12)
    np.testing.assert_allclose(np.rad2deg(limits.upper), [160, 137.5, 142.5, 270, 120, 270], rtol=1e-12)


def test_a_motion_inside_its_limits_has_no_excess_and_each_limit_that_is_broken_counts_by_its_share(plant, structure):
    limits = Limits.of(plant)
    design = designed(plant, structure, limits)
    rows = design.rows(motion(), 50.0)
    assert not design.excess(rows).any()
    (q, dq, ddq), torque = rows.motion, rows.torques(design.carried.chi)
    cases = [  # a limit that the motion meets at its full size is used to 100 %, and these shares are allowed
        ("speed", "velocity", np.abs(dq).max(axis=0), 0.95),
        ("acceleration", "acceleration", np.abs(ddq).max(axis=0), 0.95),
        ("torque", "torque", np.abs(torque).max(axis=(0, 1)), 0.8),
    ]
    for kind, (word, name, used, share) in enumerate(cases, 1):
        for factor, expected in ((1.02 / share, 0.0), (1.0, 1.0 - share), (0.5, 2.0 - share)):
            over = designed(plant, structure, replace(limits, **{name: factor * used})).excess(rows)
            np.testing.assert_allclose(over.max(), expected, rtol=0, atol=1e-12)  # rounding of a ratio
            assert set(over.any(axis=1).nonzero()[0] // 6) <= {kind}
        weak = factor * used * np.where(np.arange(6) == kind, 0.5, 1e3)
        broken = designed(plant, structure, replace(limits, **{name: weak})).broken(rows)
        assert broken == f"takes 400 % of the {word} of joint joint{kind + 1}, where {100 * share:g} % may be used"
    center = 0.5 * (limits.upper + limits.lower)
    reach = np.abs(q - center).max(axis=0)
    over = designed(plant, structure, replace(limits, lower=center - reach, upper=center + reach)).excess(rows)
    np.testing.assert_allclose(over[:6].max(), 0.1, rtol=0, atol=1e-12)
    assert not over[6:].any()


def test_the_cost_is_the_log_of_the_wanted_deviations_mostly_of_the_worst_and_thirty_times_the_excess(plant, structure):
    limits, path = Limits.of(plant), motion()
    free = designed(plant, structure, limits)
    rel = free.deviations(path, 10.0)[WANTED]
    expected = np.log((rel**8).sum() ** 0.125) + 0.2 * np.mean(np.log(rel))
    np.testing.assert_allclose(free.cost(path), expected, rtol=1e-12)  # rounding
    slow = designed(plant, structure, replace(limits, velocity=0.1 * limits.velocity))
    over = slow.excess(slow.rows(path, 10.0))
    assert over.any()
    assert not over[-1].any()
    np.testing.assert_allclose(slow.cost(path) - free.cost(path), 30.0 * (over**2).sum() / 10.0, rtol=1e-9)


def test_a_motion_too_fast_is_shrunk_about_its_centre_as_far_as_needed_and_one_far_too_fast_is_refused(
    plant, structure
):
    path, limits = motion(), Limits.of(plant)
    fastest = np.abs(path(np.arange(0.0, path.duration, 1.0 / FITTED_HZ))[1]).max(axis=0)
    for size in (0.96, 0.62, 0.12):
        design = designed(plant, structure, replace(limits, velocity=1.001 * size * fastest / (0.95 + EXCESS)))
        fitted = design.fitted(path)
        np.testing.assert_allclose(fitted.sine, size * path.sine, rtol=1e-9)  # rounding of the size
        np.testing.assert_allclose(fitted.cosine, size * path.cosine, rtol=1e-9)
        np.testing.assert_array_equal(fitted.center, path.center)
        assert design.keeps_limits(fitted)
    said = r"even scaled to 10 %, the motion takes 200 % of the speed of joint joint\d, where 95 % may"  # 0.1 / 0.05
    with pytest.raises(TrajectoryError, match=said):
        designed(plant, structure, replace(limits, velocity=0.05 * fastest)).fitted(path)
