"""Payloads from currents with the gains known."""

from dataclasses import replace

import numpy as np
import pytest
from exact import GAIN, TRUSTING, exact_problem
from scipy.stats import norm

from ident.all_joints.selection import Rival
from ident.errors import GainsError, NegativeMass, NotIdentifiable, PayloadError
from ident.estimators.nls import AllJointsOptions
from ident.held_gains import gain_sensitivity
from ident.known_gains import KnownGains
from ident.parameters import INERTIAL
from ident.payload import Payload, standard_parameters
from ident.problem import Problem
from ident.weighing.accord import _as_stated, accord, check_mass
from ident.weighing.alone import NoMass, _solved, masses_alone
from ident.weighing.body import FoundBody, Quantity, body_of, body_values
from ident.weighing.together import payload_of, separable
from ident.weighing.verification import AGREES, DIFFERS, SAYS_NOTHING, verified

UNKNOWN = Payload(mass=2.0, known="none")
PLAIN = AllJointsOptions()
NAMES = tuple(f"joint{j}" for j in range(1, 7))


@pytest.fixture
def problem(structure, heavy, rng) -> Problem:
    return weighed(structure, heavy, rng, noise=1e-9)


def weighed(structure, heavy: Payload, rng, *, noise: float, options=TRUSTING) -> Problem:
    chi = rng.uniform(0.5, 2.0, 84)
    motions = [(chi, None, None), (chi, heavy, UNKNOWN)]
    return exact_problem(structure, motions, GAIN, rng, noise=noise, options=options)


def known(value=GAIN, rel_std=(0.0,) * 6, joints=range(6)) -> KnownGains:
    at = np.array(list(joints))
    value, std = np.asarray(value)[at], np.asarray(rel_std)[at] * np.abs(np.asarray(value)[at])
    return KnownGains(names=NAMES, joints=at, value=value, covariance=np.diag(std**2))


def test_exact_currents_give_every_parameter_of_the_payload(problem, heavy):
    found = payload_of(problem, known(), PLAIN)
    assert found.names == INERTIAL
    # Noise of 1e-9 of each joint's rms current, some 100 times the smallest parameter's share, amplified by cond < 1e3.
    np.testing.assert_allclose(found.value, heavy.known_part().chi, rtol=0, atol=1e-5)
    body = body_of(found)
    values = {each.name: each.value for each in body.quantities}
    np.testing.assert_allclose(values["mass"], 7.025, rtol=1e-6)
    np.testing.assert_allclose([values[axis] for axis in "xyz"], heavy.com, atol=1e-6)
    np.testing.assert_allclose([values[key] for key in ("ixx", "izz", "iyz")], [0.012146, 0.008659, 0.0], atol=1e-4)
    assert body.possible
    assert not body.refused


def test_gains_scaled_by_k_scale_the_payload_by_k(problem):
    one, two = (payload_of(problem, known(k * GAIN), PLAIN) for k in (1.0, 1.3))
    np.testing.assert_allclose(two.value, 1.3 * one.value, rtol=0, atol=1e-7)  # the search ends at steps of 1e-11


def test_uncertainty_of_gains_is_the_change_they_cause(structure, heavy, rng):
    noisy = weighed(structure, heavy, rng, noise=1e-6)
    rel_std = np.array([0.0, 0.0, 0.0, 0.02, 0.0, 0.0])
    found = payload_of(noisy, known(rel_std=rel_std), PLAIN)
    step = 1e-4
    more = payload_of(noisy, known(GAIN * (1.0 + step * (rel_std > 0))), PLAIN)
    slope = (more.value - payload_of(noisy, known(), PLAIN).value) / step
    # A difference over a step of 1e-4 of what is linear but for the residual, which the linearisation leaves out.
    np.testing.assert_allclose(np.sqrt(np.diag(found.gains)), 0.02 * np.abs(slope), rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(found.gains, 0.02**2 * np.outer(slope, slope), rtol=3e-3, atol=1e-8)


def test_correlated_gains_move_the_payload_together(problem):
    # Of gains that are all off by the same unknown share, the payload is off by that share.
    together = KnownGains(names=NAMES, joints=np.arange(6), value=GAIN, covariance=0.03**2 * np.outer(GAIN, GAIN))
    found = payload_of(problem, together, PLAIN)
    np.testing.assert_allclose(np.sqrt(np.diag(found.gains)), 0.03 * np.abs(found.value), rtol=1e-4, atol=1e-6)


def test_a_payload_grows_with_all_gains_together(problem):
    found = payload_of(problem, known(), PLAIN)
    at = len(found.ready.shared.arm) + np.arange(10)
    by_each = gain_sensitivity(found.selected.final.fit.theta_belief[at], known())
    # d chi / d log g of each gain in sum is chi itself, as currents scale; gains are held to 1e-6 or so of themselves.
    np.testing.assert_allclose(by_each.sum(axis=1), found.value, rtol=1e-4, atol=1e-5)


def test_a_joint_whose_gain_is_not_known_changes_nothing_but_the_deviation(problem, heavy):
    found = payload_of(problem, known(joints=[0, 1, 2, 4, 5]), PLAIN)
    np.testing.assert_allclose(found.value, heavy.known_part().chi, rtol=0, atol=1e-5)
    assert isinstance(masses_alone(found, heavy, known(joints=[0, 1, 2, 4, 5]))[3], NoMass)


def test_deviations_of_payload_and_of_a_joint_alone_are_those_of_the_draws(structure, heavy):
    # 40 draws of noise and gains. Ten parameters: the rms of 400 z-scores has a deviation of at most 3.5 % where
    # parameters were independent, and more for those that are not; six joints: that of 240 has one of 4.6 %.
    rel_std, z, alone = np.full(6, 0.02), [], []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        noisy = weighed(structure, heavy, rng, noise=0.02)
        gains = known(GAIN * np.exp(rel_std * rng.standard_normal(6)), rel_std)
        found = payload_of(noisy, gains, PLAIN)
        z.append((found.value - heavy.known_part().chi) / np.sqrt(np.diag(found.covariance)))
        masses = masses_alone(found, heavy, gains)
        alone += [(each.value - 7.025) / each.std for each in masses if isinstance(each, Quantity)]
    assert 0.85 < np.sqrt(np.mean(np.square(z))) < 1.15
    assert 0.9 < np.mean(np.abs(z) < 2.0) < 0.99
    assert len(alone) > 200
    assert 0.85 < np.sqrt(np.mean(np.square(alone))) < 1.15


def test_each_joint_alone_gives_the_mass_off_by_as_much_as_its_gain(problem, heavy):
    wrong = GAIN * np.array([1.0, 1.03, 1.0, 0.96, 1.0, 1.0])
    found = payload_of(problem, known(wrong), PLAIN)
    alone = masses_alone(found, heavy, known(wrong, rel_std=np.array([0.01, 0.02, 0.03, 0.04, 0.05, 0.06])))
    masses = np.array([each.value for each in alone if isinstance(each, Quantity)])
    np.testing.assert_allclose(masses / 7.025, wrong / GAIN, rtol=1e-5)
    shares = [each.gain_std / each.value for each in alone if isinstance(each, Quantity)]
    np.testing.assert_allclose(shares, [0.01, 0.02, 0.03, 0.04, 0.05, 0.06], rtol=1e-9)


@pytest.mark.parametrize("part", ["all", "com", "mass"])
def test_of_the_shape_what_is_not_known_is_free(problem, heavy, part):
    # The stated centre and inertia are wrong where they must not be used, the mass always: it is what is found.
    stated = replace(heavy, mass=5.0, known=part)
    if part == "all":
        shape = standard_parameters(heavy.mass, heavy.com, heavy.inertia) * 5.0 / heavy.mass
        inertia = tuple(5.0 / heavy.mass * each for each in heavy.inertia)
        stated = replace(stated, inertia=inertia)
        np.testing.assert_allclose(stated.known_part().chi, shape, rtol=1e-12)
    elif part == "mass":
        stated = replace(stated, com=(0.3, 0.2, 0.1))
    alone = masses_alone(payload_of(problem, known(), PLAIN), stated, known())
    shown = [each.value for each in alone if isinstance(each, Quantity)]
    assert len(shown) >= 2
    np.testing.assert_allclose(shown, 7.025, rtol=1e-4)


def test_deviation_of_the_stated_shape_is_a_share_of_a_joint_alone(problem, heavy):
    found = payload_of(problem, known(), PLAIN)
    sure, unsure = (masses_alone(found, replace(heavy, com_std=(0.0, 0.0, std)), known())[1] for std in (0.0, 0.01))
    assert isinstance(sure, Quantity)
    assert isinstance(unsure, Quantity)
    shifted = masses_alone(found, replace(heavy, com=(0.1, -0.05, 0.14 + 1e-4)), known())[1]
    # The change by a tenth of a millimetre, a hundred times: the inertia's change by the shift is of second order.
    slope = abs(shifted.value - sure.value) / 1e-4
    np.testing.assert_allclose(unsure.model_std, np.hypot(0.01 * slope, sure.model_std), rtol=0.02)
    assert unsure.model_std > 0.01


@pytest.mark.parametrize(("rel_std", "shown"), [(0.24, True), (0.26, False)])
def test_a_joint_alone_whose_mass_is_off_by_more_than_a_quarter_says_nothing(problem, heavy, rel_std, shown):
    gains = known(rel_std=np.full(6, rel_std))
    alone = masses_alone(payload_of(problem, known(), PLAIN), heavy, gains)
    assert [isinstance(each, Quantity) for each in alone] == [shown] * 6
    assert shown or "it shows the mass to 1.8 kg only" in alone[2].reason  # 0.26 of 7.025


def test_a_mass_alone_is_that_of_least_squares_with_weights_and_beliefs(problem, heavy, rng):
    found, j = payload_of(problem, known(), PLAIN), 3
    final = found.selected.final
    own = final.own[j]
    std = np.where(np.arange(len(own.std)) == 1, 0.02, np.where(np.arange(len(own.std)) == 2, 0.3, np.inf))
    own = replace(own, mean=np.linspace(0.3, 0.7, len(std)), std=std)
    rows = final.fit.rows
    weight = np.where(rows.motion == 1, 0.6, 1.7) * np.where(rows.joint == j, 1.0, 5.0)
    noisy = replace(final.columns[j], V=final.columns[j].V + 0.02 * rng.normal(size=len(final.columns[j].V)))
    fitted = replace(
        final,
        columns=(*final.columns[:j], noisy, *final.columns[j + 1 :]),
        own=(*final.own[:j], own, *final.own[j + 1 :]),
        fit=replace(final.fit, rows=replace(rows, weight=weight)),
    )
    solved = _solved(found.ready, fitted, j, float(GAIN[j]), heavy.known_part())
    assert solved is not None
    shared = len(found.ready.shared.arm)
    kilogram = noisy.payload[0] @ heavy.known_part().chi / 7.025 / GAIN[j]
    W, w = np.column_stack((own.F, noisy.shared[:, :shared], kilogram)), weight[rows.of(j)]
    size = len(W)
    believed = np.zeros((2, W.shape[1]))
    believed[0, 1], believed[1, 2] = 1.0 / 0.02, 1.0 / 0.3
    stacked = np.vstack((w[:, None] * W, believed))
    pseudo = np.linalg.pinv(stacked, rcond=1e-12)
    z = pseudo @ np.concatenate((w * noisy.V, [own.mean[1] / 0.02, own.mean[2] / 0.3]))
    scale = np.abs(pseudo[-1]).max()
    # Two factorisations; columns have a condition of 1e4 at most.
    np.testing.assert_allclose(solved.mass, z[-1], rtol=1e-8)
    np.testing.assert_allclose(solved.influence, pseudo[-1, :size] * w, rtol=0, atol=1e-8 * scale * w.max())
    np.testing.assert_allclose(solved.belief, np.linalg.norm(pseudo[-1, size:]), rtol=1e-7)
    assert solved.belief > 1e-4
    left = noisy.V - W @ z
    np.testing.assert_allclose(solved.rows.residual, left, rtol=0, atol=1e-8 * np.abs(left).max())
    shown = np.einsum("ij,ji->i", stacked, pseudo)[:size].sum()  # unknowns that the rows show, and not the beliefs
    np.testing.assert_allclose(solved.rows.unknowns[j], shown, rtol=1e-8)
    masses = masses_alone(replace(found, selected=replace(found.selected, final=fitted)), heavy, known())
    assert isinstance(masses[j], Quantity)
    np.testing.assert_allclose(masses[j].model_std, solved.belief, rtol=1e-12)  # the shape is stated to be certain


def test_a_rival_s_difference_counts_in_part_for_all_joints_and_for_each_alone(problem, heavy, monkeypatch):
    plain = payload_of(problem, known(), PLAIN)
    final = plain.selected.final
    theta = final.fit.found.theta
    moved = 0.01 * np.arange(1.0, 1.0 + len(theta))
    other = replace(
        final,
        columns=tuple(replace(each, V=1.05 * each.V) for each in final.columns),
        fit=replace(final.fit, found=replace(final.fit.found, theta=theta + moved)),
    )
    selected = replace(plain.selected, rivals=(Rival(share=0.4, other=other, final=final),))
    monkeypatch.setattr("ident.weighing.together.chosen_model", lambda ready, options: selected)
    found = payload_of(problem, known(), PLAIN)
    at = len(plain.ready.shared.arm) + np.arange(10)
    np.testing.assert_allclose(found.model - plain.model, 0.16 * np.outer(moved[at], moved[at]), rtol=1e-6)
    one, two = (masses_alone(each, heavy, known()) for each in (plain, found))
    for before, after in zip(one, two, strict=True):  # currents that are 5 % larger are of a mass that is
        added = after.model_std**2 - before.model_std**2
        np.testing.assert_allclose(np.sqrt(added), 0.4 * 0.05 * 7.025, rtol=1e-5)  # noise of 1e-9, condition 1e3


def test_the_scale_tells_which_gain_is_off(structure, heavy, rng):
    noisy = weighed(structure, heavy, rng, noise=0.005)
    rel_std = np.full(6, 0.003)
    right = verified(payload_of(noisy, known(rel_std=rel_std), PLAIN), heavy, known(rel_std=rel_std))
    assert right.passed
    assert right.together.verdict == AGREES
    assert all(each.mass is not None for each in right.joints)
    np.testing.assert_allclose(2.0 * norm.sf(right.limit), 0.05 / 7, rtol=1e-9)  # seven masses, wrong once in twenty
    wrong = known(GAIN * np.array([1.0, 1.0, 1.0, 1.0, 1.08, 1.0]), rel_std)
    off = verified(payload_of(noisy, wrong, PLAIN), heavy, wrong)
    assert [each.joint for each in off.joints if each.verdict == DIFFERS] == [4]
    assert not off.passed
    # The residual of 0.5 % and the gain's 0.3 % beside the 8 % that were injected.
    np.testing.assert_allclose(off.joints[4].rel_error, 0.08, atol=4 * off.joints[4].rel_std)


def test_deviation_of_the_scale_is_part_of_the_verdict(problem, heavy):
    found, gains = payload_of(problem, known(), PLAIN), known()
    light = replace(heavy, mass=7.2, mass_std=0.1)
    one = verified(found, light, gains).together
    np.testing.assert_allclose(one.rel_error, 7.025 / 7.2 - 1.0, rtol=1e-4)
    np.testing.assert_allclose(one.rel_std, 0.1 / 7.2, rtol=1e-4)
    assert one.verdict == AGREES  # 1.75 deviations
    assert verified(found, replace(light, mass_std=0.05), gains).together.verdict == DIFFERS  # 3.5 of them


def test_a_mass_that_is_not_sure_says_nothing(problem, heavy):
    vague = KnownGains(names=NAMES, joints=np.arange(6), value=GAIN, covariance=0.2**2 * np.outer(GAIN, GAIN))
    one = verified(payload_of(problem, vague, PLAIN), heavy, vague)
    assert one.together.verdict == SAYS_NOTHING
    assert "its deviation is 20 %, beyond 10 %" in str(one.together.reason)
    assert {(each.verdict, each.reason) for each in one.joints} == {(AGREES, None)}  # a joint alone shows a wrong gain
    assert not one.passed


def test_a_verification_needs_a_scale(problem, heavy):
    found = payload_of(problem, known(), PLAIN)
    with pytest.raises(PayloadError, match="a verification needs its mass"):
        verified(found, replace(heavy, known="none"), known())


def test_without_a_bare_or_a_loaded_motion_there_is_no_payload(problem):
    for which, words in ((slice(0, 1), "no motion carries a payload"), (slice(1, 2), "no motion is bare")):
        with pytest.raises(NotIdentifiable, match=words):
            payload_of(replace(problem, motions=problem.motions[which]), known(), PLAIN)


def test_gains_of_another_arm_are_refused(problem):
    three = KnownGains(names=("a", "b", "c"), joints=np.arange(1), value=np.ones(1) * 2, covariance=np.eye(1))
    with pytest.raises(GainsError, match="gains of 3 joints"):
        payload_of(problem, three, PLAIN)


def test_body_values_undo_huygens_and_steiner():
    mass, com, inertia = 3.7, (0.11, -0.23, 0.31), (0.05, 0.06, 0.04, 0.003, -0.002, 0.004)
    found = body_values(standard_parameters(mass, com, inertia))
    np.testing.assert_allclose(found, [mass, *com, *inertia], rtol=1e-12)  # rounding


def test_deviations_of_a_body_follow_from_those_of_its_parameters(problem):
    found = payload_of(problem, known(), PLAIN)
    rng = np.random.default_rng(5)
    factor = 1e-7 * rng.standard_normal((10, 10))
    body = body_of(replace(found, residual=factor @ factor.T, gains=0.0 * found.gains, model=4.0 * factor @ factor.T))
    moved = [body_values(found.value + column) - body_values(found.value) for column in factor.T]
    std = np.linalg.norm(moved, axis=0)  # steps of 1e-7: of second order 1e-7 of themselves
    np.testing.assert_allclose([each.residual_std for each in body.quantities], std, rtol=1e-4)
    np.testing.assert_allclose([each.model_std for each in body.quantities], 2.0 * std, rtol=1e-4)
    np.testing.assert_allclose([each.std for each in body.quantities], np.sqrt(5.0) * std, rtol=1e-4)


def test_a_mass_that_may_be_zero_has_no_centre(problem):
    found = payload_of(problem, known(), PLAIN)
    for sure, std in ((True, 2.3), (False, 2.4)):  # three deviations of 7.025 kg are 2.342
        covariance = np.diag([1e-12] * 9 + [std**2])
        body = body_of(replace(found, residual=covariance, gains=0.0 * covariance, model=0.0 * covariance))
        assert body.of("mass") is not None
        assert (body.of("x") is not None) == sure
        if not sure:
            assert body.refused["x"] == "the mass is not 3 deviations above zero"
            np.testing.assert_allclose(body.of("mass").std, 2.4, rtol=1e-9)


def test_what_a_body_cannot_have_is_said(problem):
    found = payload_of(problem, known(), PLAIN)
    value = found.value.copy()
    value[0] = -0.5
    assert body_of(replace(found, value=value)).possible is False


def test_which_parameters_show_on_their_own_follows_from_the_kinematics(structure):
    assert separable(structure).all()  # six joints in space show all ten
    turning = structure.payload_probes.copy()
    turning[:, :, 3] = 2.0 * turning[:, :, 0]  # as on an arm that feels XX and YY together only
    found = separable(replace(structure, payload_probes=turning))
    assert [name for name, own in zip(INERTIAL, found, strict=True) if not own] == ["XX", "YY"]


def test_what_shows_only_with_others_is_refused_by_name(problem):
    structure = problem.structure
    turning = structure.payload_probes.copy()
    turning[:, :, 3] = 2.0 * turning[:, :, 0]
    together = replace(problem, structure=replace(structure, payload_probes=turning))
    found = payload_of(together, known(), PLAIN)
    assert set(found.refused) == {"XX", "YY"}
    assert len(found.names) == 8
    body = body_of(found)
    assert body.possible is None
    assert "XX: this arm shows it only together with others" in body.refused["ixx"]
    assert body.of("x") is not None
    with pytest.raises(NotIdentifiable, match="the payload's YY: this arm shows it only"):
        found.at("YY")


def test_joints_agree_on_a_mass_unless_a_gain_is_off(structure, heavy, rng):
    noisy, rel_std = weighed(structure, heavy, rng, noise=0.005), np.full(6, 0.003)
    right, wrong = known(rel_std=rel_std), known(GAIN * np.array([1.0, 2.0, 1.0, 1.0, 1.0, 1.0]), rel_std)
    found = payload_of(noisy, right, PLAIN)
    agreed = accord(found, body_of(found), right)
    assert all(each.mass is not None for each in agreed)  # with the centre found, wrist joints show the mass too
    assert len(agreed) == 6
    assert DIFFERS not in [each.verdict for each in agreed]
    found = payload_of(noisy, wrong, PLAIN)
    off = accord(found, body_of(found), wrong)[1]
    assert off.verdict == DIFFERS
    # The centre moved with the gains too; the mass of the joint is doubled to within a tenth all the same.
    np.testing.assert_allclose(off.mass.value, 2.0 * heavy.mass, rtol=0.1)


def a_mass(value: float, *more: Quantity) -> FoundBody:
    shares = {"residual_std": 0.1, "gain_std": 0.0, "model_std": 0.0}
    return FoundBody(
        quantities=(Quantity(name="mass", unit="kg", value=value, **shares), *more), refused={}, possible=None
    )


def test_a_mass_below_zero_beyond_doubt_is_refused():
    with pytest.raises(NegativeMass, match=r"is -0\.31 kg, 2 sigma 0\.2 kg: .* probably swapped"):
        check_mass(a_mass(-0.31))
    for value in (-0.29, 0.31):  # three deviations are 0.3
        check_mass(a_mass(value))


@pytest.mark.parametrize("value", [-0.29, 0.29, 2001.0])
def test_of_a_mass_that_is_not_sure_joints_say_nothing(problem, value):
    assert accord(payload_of(problem, known(), PLAIN), a_mass(value), known()) == ()


def test_what_was_found_is_stated_with_its_deviations():
    values = zip("xyz", (0.08, -0.03, 0.11), (0.02, 0.05, 0.03), strict=True)
    centre = [Quantity(name=k, unit="m", value=x, residual_std=s, gain_std=0.0, model_std=0.0) for k, x, s in values]
    expected = Payload(mass=2.3, mass_std=0.1, com=(0.08, -0.03, 0.11), com_std=(0.02, 0.05, 0.03), known="com")
    assert _as_stated(a_mass(2.3, *centre)) == expected


def test_without_a_centre_joints_are_asked_for_the_mass_alone(problem, heavy):
    found = payload_of(problem, known(), PLAIN)
    far = [Quantity(name=axis, unit="m", value=4.9, residual_std=0.2, gain_std=0.0, model_std=0.0) for axis in "xyz"]
    stated = Payload(mass=heavy.mass, mass_std=0.1, known="mass")
    expected = [each.mass for each in verified(found, stated, known()).joints]
    for body in (a_mass(heavy.mass), a_mass(heavy.mass, *far)):
        assert [each.mass for each in accord(found, body, known())] == expected
