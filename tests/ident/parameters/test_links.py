"""Links that bodies can have: what data determine, what the model decides, what no body can be."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from scipy import linalg

from ident.model.arm import Arm
from ident.model.parameters import PSEUDO_INERTIAS, pseudo_inertia
from ident.model.structure import Structure, structure_of
from ident.parameters.arm import Quantity
from ident.parameters.links import FoundLinks, ModelLinks, nearest_links, nearest_possible
from ident.payload.payload import standard_parameters
from ident.support.errors import RobotModelError

PER_JOINT = ("joint_names", "rotation", "translation", "axis", "revolute")
OWN_FRICTION = ("Fv", "Fc", "off", "Fvm", "Fcm")


def body(rng, mass: float) -> np.ndarray:
    """Parameters of a cloud of points."""
    return sum(standard_parameters(mass / 6.0, at, (0.0,) * 6) for at in rng.normal(0.05, 0.1, (6, 3)))


@pytest.fixture(scope="module")
def short(arm) -> Arm:
    """The first four joints."""
    own = {name: getattr(arm, name)[:4] for name in (*PER_JOINT, "lower", "upper")}
    return replace(arm, **own)


@pytest.fixture(scope="module")
def structure(short) -> Structure:
    return structure_of(short)


@pytest.fixture(scope="module")
def drawn() -> ModelLinks:
    rng = np.random.default_rng(12)
    return ModelLinks(
        own=np.array([body(rng, mass) for mass in (11.0, 7.3, 5.2, 3.1)]),
        carried=np.array([body(rng, mass) for mass in (0.3, 0.2, 0.4, 0.1)]),
        motor=np.array([0.0, 0.0, 0.21, 0.13]),
        offset=np.zeros((4, 3)),
    )


def base_values(structure, drawn: ModelLinks) -> dict[str, float]:
    """Base parameters of links, by the regressor's own regrouping."""
    chi = np.zeros(len(structure.base.labels))
    for j in range(4):
        chi[14 * j : 14 * j + 10] = drawn.own[j] + drawn.carried[j]
        chi[14 * j + 10] = drawn.motor[j]
    values = dict(zip(structure.base.names, (structure.base.regrouping @ chi).tolist(), strict=True))
    return {name: value for name, value in values.items() if name.rstrip("0123456789") not in OWN_FRICTION}


def found(structure, drawn, values: dict[str, float], std: float, names=None) -> FoundLinks:
    parameters = [
        Quantity(name=k, unit="", value=v, residual_std=std) for k, v in values.items() if not names or k in names
    ]
    return nearest_links(structure.base, parameters, std**2 * np.eye(len(parameters)), drawn)


def other_links(drawn: ModelLinks, scale: float) -> ModelLinks:
    """Bodies of other masses, whose motors have what the model does not say."""
    factor = 1.0 + scale * np.array([0.11, -0.13, 0.17, -0.07])
    motor = drawn.motor + scale * np.array([0.4, 0.3, 0.11, 0.05])
    return replace(drawn, own=drawn.own * factor[:, None], motor=motor)


def test_what_data_determine_is_what_data_say(structure, drawn):
    true = other_links(drawn, 1.0)
    values = base_values(structure, true)
    near = found(structure, drawn, values, 1e-5)
    again = base_values(structure, replace(drawn, own=near.own, motor=near.motor))
    for name, value in values.items():
        # Deviations of 1e-5 against a prior of unit deviation: they give way by far less than one.
        np.testing.assert_allclose(again[name], value, rtol=0, atol=1e-6, err_msg=name)
    np.testing.assert_allclose(near.motor[2:], true.motor[2:], rtol=0, atol=1e-5)  # base parameters by themselves
    assert near.motor_found[2:].all()
    assert np.abs(near.own - true.own).max() > 0.01  # what data leave open is the model's
    unseen = drawn.own[0, :9]
    np.testing.assert_allclose(near.own[0, :5], unseen[:5], rtol=1e-6)  # of link 1 nothing but ZZ shows
    vague = found(structure, drawn, values, 7.0)
    # Against a prior of 0.21 and 0.13 data of a deviation of 7 weigh a thousandth.
    np.testing.assert_allclose(vague.motor[2:], drawn.motor[2:], rtol=1e-2)


def test_what_gives_way_is_told_with_its_sign_in_deviations(structure, drawn):
    values = base_values(structure, drawn)
    names = sorted(values)
    impossible = {**values, "Ia4": -0.3}
    near = found(structure, drawn, impossible, 0.05)
    assert near.motor[3] > 0.0
    at = near.names.index("Ia4")
    again = base_values(structure, replace(drawn, own=near.own, motor=near.motor))
    for name, moved in zip(near.names, near.moved, strict=True):
        np.testing.assert_allclose(moved, (again[name] - impossible[name]) / 0.05, rtol=1e-6, atol=1e-6, err_msg=name)
    assert near.moved[at] > 3.0
    assert sorted(near.names) == names


def test_data_that_press_a_link_flat_leave_it_a_thousandth_of_what_is_drawn(structure, drawn):
    near = found(structure, drawn, {"ZZ4": -3.0}, 1e-3)
    pairs = zip(near.own, drawn.own, strict=True)
    share = [linalg.eigh(*map(pseudo_inertia, pair), eigvals_only=True)[0] for pair in pairs]
    # The barrier keeps a link a little above; of the others nothing is asked.
    np.testing.assert_allclose(share, [1.0, 1.0, 1.0, 1e-3], rtol=1e-3)
    assert share[3] > 1e-3


def test_what_no_data_show_stays_as_drawn(structure, drawn):
    values = base_values(structure, other_links(drawn, 1.0))
    near = found(structure, drawn, values, 1e-5, names=("XX4", "XY4", "ZZ4", "MX4"))
    assert not near.motor_found[2:].any()  # no row holds a motor beyond the first two
    np.testing.assert_array_equal(near.motor[~near.motor_found], drawn.motor[~near.motor_found])
    np.testing.assert_allclose(near.own[0], drawn.own[0], rtol=0, atol=1e-5)
    assert np.abs(near.own[3] - drawn.own[3]).max() > 1e-4


def test_a_link_without_mass_is_refused(structure, drawn):
    own = drawn.own.copy()
    own[3] = 0.0
    with pytest.raises(RobotModelError, match=r"link 4 of the model is not physically consistent \(its mass is 0 kg"):
        found(structure, replace(drawn, own=own), base_values(structure, drawn), 1e-3)
    own[3] = standard_parameters(2.0, np.zeros(3), (0.1, 0.1, 0.3, 0.0, 0.0, 0.0))  # 0.1 + 0.1 < 0.3
    refused(RobotModelError, "link 4", found, structure, replace(drawn, own=own), base_values(structure, drawn), 1e-3)


def test_a_coupled_motors_inertia_is_no_links(short, drawn):
    coupled_structure = structure_of(replace(short, couplings=((2, 3),)))
    values = base_values(coupled_structure, drawn)
    assert values["Iam4"] == 0.0
    values["Iam4"] = 0.4
    near = found(coupled_structure, drawn, values, 1e-4)
    assert np.abs(near.moved).max() < 0.5  # as found, and nothing else gives way for it
    np.testing.assert_allclose(near.own, drawn.own, rtol=0, atol=1e-3)
    loose = found(coupled_structure, drawn, values, 0.3)  # the model says nothing of it that data had to give way to
    assert np.abs(loose.moved).max() < 0.1


def test_data_and_model_that_are_as_sure_of_a_motor_meet_halfway(structure, drawn):
    # The model's inertia has a deviation of its own size.
    for j, size in ((2, 0.21), (3, 0.13)):
        near = found(structure, drawn, {f"Ia{j + 1}": size + 0.04}, size)
        assert near.motor[j] == pytest.approx(size + 0.02, rel=1e-6)


def test_data_and_model_that_are_as_sure_of_a_link_meet_halfway(structure, drawn):
    k = structure.base.regrouping[structure.base.names.index("MX4")]
    variance = 0.0
    for j, own in enumerate(drawn.own):  # of the model, by the definition of the distance
        relative = [np.linalg.inv(pseudo_inertia(own)) @ pseudo_inertia(unit) for unit in np.eye(10)]
        metric = np.array([[0.5 * np.trace(one @ other) for other in relative] for one in relative])
        variance += k[14 * j : 14 * j + 10] @ np.linalg.solve(metric, k[14 * j : 14 * j + 10])
    std = np.sqrt(variance)
    near = found(structure, drawn, {"MX4": base_values(structure, drawn)["MX4"] + 0.1 * std}, std)
    assert near.moved[0] == pytest.approx(-0.05, rel=1e-6)


def test_in_the_metric_of_the_pseudo_inertia_negative_eigenvalues_become_zero(rng):
    slopes = np.zeros((20, 2, 4, 4))
    slopes[:10, 0] = slopes[10:, 1] = PSEUDO_INERTIAS
    flat, wanted = slopes.reshape(20, -1), rng.normal(size=20)
    inside = np.tile(standard_parameters(1.3, np.zeros(3), (0.7, 0.7, 0.7, 0.0, 0.0, 0.0)), 2)
    near = nearest_possible(np.zeros((2, 4, 4)), slopes, wanted, flat @ flat.T, inside)
    for each, possible in zip(wanted.reshape(2, 10), near.reshape(2, 10), strict=True):
        size, axes = np.linalg.eigh(pseudo_inertia(each))
        assert size[0] < -0.1
        # Higham (1988). The barrier ends at a distance whose square is within 8e-11 of the least.
        expected = (axes * np.maximum(size, 0.0)) @ axes.T
        np.testing.assert_allclose(pseudo_inertia(possible), expected, rtol=0, atol=2e-5)
        assert np.linalg.eigvalsh(pseudo_inertia(possible))[0] > 0.0
