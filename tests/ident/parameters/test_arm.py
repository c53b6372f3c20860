"""Bare motions alone: ratios of gains, and the arm over one of them or in SI."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from exact import GAIN, TRUSTING, exact_problem
from refusals import refused
from weighings import NAMES, known

from ident.estimation.estimators.nls import AllJointsOptions
from ident.estimation.known_gains import KnownGains
from ident.estimation.problem import Problem
from ident.estimation.selection import AlternativeModel
from ident.model.structure import structure_of
from ident.parameters.arm import GainRatios, arm_in_SI, friction_unit, gain_ratios, rival_friction, surest
from ident.support.errors import GainsError, NotIdentifiable

PLAIN = AllJointsOptions(friction_per_motion=False)


def bare(structure, chi, rng, noise: float) -> Problem:
    return exact_problem(structure, [(chi, None, None), (chi, None, None)], GAIN, rng, noise=noise, options=TRUSTING)


def base_values(structure, chi) -> dict[str, float]:
    return dict(zip(structure.base.names, structure.base.regrouping @ chi, strict=True))


def test_exact_motions_give_the_ratios_and_the_arm_over_the_reference(structure, chi, rng):
    gain = -GAIN
    problem = exact_problem(structure, [(chi, None, None)] * 2, gain, rng, noise=1e-6, options=TRUSTING)
    found = gain_ratios(problem, PLAIN)
    r = found.ratios.reference
    # Noise of 1e-6 of the rms currents, amplified by the condition number.
    np.testing.assert_allclose(found.ratios.value, gain / gain[r], rtol=1e-4)
    np.testing.assert_array_equal(np.sign(found.selected.final.h), np.sign(gain))  # so that friction brakes
    assert found.ratios.rel_std[r] == 0.0
    assert found.ratios.given.all()
    assert gain[r] < 0.0
    true = base_values(structure, chi)
    assert len(found.inertial) == sum(name[:2] not in ("Fv", "Fc", "of") for name in true)
    for each in found.inertial:
        np.testing.assert_allclose(each.value, true[each.name] / gain[r], rtol=1e-3, atol=1e-3, err_msg=each.name)
        assert each.std > 0.0
        assert each.unit.endswith(f"/ g{r + 1}")
    for j, own in enumerate(found.friction):
        assert [each.name for each in own] == ["Fv", "Fc", "off"]
        for each in own:
            np.testing.assert_allclose(each.value, true[f"{each.name}{j + 1}"] / gain[j], rtol=1e-3)


def test_of_joints_beside_which_as_many_are_sure_the_surest_is_the_reference():
    C = np.diag(np.array([0.03, 0.011, 0.02, 0.7]) ** 2)
    assert (surest(C, 0.1), surest(C[::-1, ::-1], 0.1)) == (1, 2)


def test_friction_of_each_motion_has_its_number(structure, chi, rng):
    found = gain_ratios(bare(structure, chi, rng, 1e-6), AllJointsOptions())
    names = ["Fv in motion 1", "Fv in motion 2", "Fc in motion 1", "Fc in motion 2", "off"]
    assert [each.name for each in found.friction[3]] == names
    assert [each.unit for each in found.friction[3]] == ["units s/rad"] * 2 + ["units"] * 3


def test_what_belongs_to_a_sliding_joint_has_units_of_force(arm, rng):
    slides = structure_of(replace(arm, revolute=np.array([True, True, False, True, True, True])))
    chi = rng.uniform(0.5, 2.0, 84)
    found = gain_ratios(bare(slides, chi, rng, 1e-6), PLAIN)
    units = {each.name: each.unit.partition(" / ")[0] for each in found.inertial}
    assert [units[name] for name in ("Ia3", "Ia5", "XX4")] == ["kg", "kg m^2", "kg m^2"]
    for own, unit in zip(found.friction[1:3], ("units s/rad", "units s/m"), strict=True):
        assert [each.unit for each in own] == [unit, "units", "units"]
    units = {"Fv": "units s/m", "by-direction": "units s/m", "cbrt": "units (s/m)^(1/3)", "load-motor": "1"}
    assert {name: friction_unit(name, turns=False) for name in units} == units


@pytest.mark.slow
def test_deviations_of_ratios_and_parameters_are_those_of_the_draws(structure, chi):
    # 50 draws, five ratios: the rms z-score has a deviation of some 5 %, more as they share the
    # reference, and the larger of two deviations is stated; the bounds are -40 and +20 %.
    z, theta, friction = [], [], []
    true = base_values(structure, chi)
    for seed in range(50):
        problem = bare(structure, chi, np.random.default_rng(seed), 0.03)
        found = gain_ratios(problem, PLAIN)
        ratios = found.ratios
        others = ratios.given & (np.arange(6) != ratios.reference)
        off = np.log((ratios.value / (GAIN / GAIN[ratios.reference]))[others])
        z += (off / ratios.rel_std[others]).tolist()
        theta.append([(p.value - true[p.name] / GAIN[ratios.reference]) / p.std for p in found.inertial])
        own = [(p, true[f"{p.name}{j + 1}"] / GAIN[j]) for j, each in enumerate(found.friction) for p in each]
        friction.append([(p.value - value) / p.std for p, value in own])
    assert len(z) > 150
    for each in (np.array(z), np.array(friction)):
        assert 0.6 < np.sqrt(np.mean(each**2)) < 1.2
    assert np.isfinite(np.array(theta)).all()


def test_motions_that_show_no_ratio_are_refused(structure, chi, rng):
    problem = bare(structure, chi, rng, 0.03)
    strict = replace(problem, options=replace(TRUSTING, max_rel_std=1e-6))
    refused(NotIdentifiable, "bare motions determine no ratio of gains", gain_ratios, strict, AllJointsOptions())


def test_a_ratio_that_no_drives_have_is_refused_unless_it_is_none_already():
    def ratios(third: float) -> GainRatios:
        value, given = np.array([0.7, 1.3, third, 1e9]), np.array([True, True, True, False])
        return GainRatios(reference=1, value=value, rel_std=np.full(4, 0.05), given=given, max_rel_std=0.1)

    ratios(3e5)
    for third in (-4e6, 2e-7):
        refused(NotIdentifiable, "gain of joint 3 diverged from that of joint 2", ratios, third)


def test_known_gains_give_the_arm_in_si_with_their_deviations(structure, chi, rng):
    problem = bare(structure, chi, rng, 1e-5)
    together = KnownGains(names=NAMES, joints=np.arange(6), value=GAIN, covariance=0.02**2 * np.outer(GAIN, GAIN))
    found = arm_in_SI(problem, PLAIN, together)
    true = base_values(structure, chi)
    assert found.ratios is None
    for each in found.inertial:
        np.testing.assert_allclose(each.value, true[each.name], rtol=1e-2, atol=1e-3, err_msg=each.name)
        # Gains that are all off by one unknown share make all parameters off by it.
        np.testing.assert_allclose(each.std, 0.02 * abs(each.value), rtol=2e-2, atol=5e-4, err_msg=each.name)
        assert "g" not in each.unit.replace("kg", "")
    two = KnownGains(names=("a", "b"), joints=np.array([0]), value=np.array([2.0]), covariance=np.array([[0.1]]))
    refused(GainsError, "gains of 2 joints", arm_in_SI, problem, AllJointsOptions(), two)


def test_known_gains_make_friction_as_uncertain_as_it_changes_with_them(structure, chi, rng):
    problem = bare(structure, chi, rng, 1e-3)
    some = np.array([0, 2, 3, 5])  # the others are free
    log_std = np.array([0.03, 0.02, 0.05, 0.04])
    rho = 0.3 * np.outer(log_std, log_std)
    np.fill_diagonal(rho, log_std**2)

    def friction(value, log_covariance):
        gains = KnownGains(names=NAMES, joints=some, value=value, covariance=log_covariance * np.outer(value, value))
        found = arm_in_SI(problem, PLAIN, gains)
        return np.array([[(each.value, each.std) for each in own] for own in found.friction])  # (n, f, 2)

    value = GAIN[some]
    by_gain = np.stack([
        (friction(value * np.exp(+step), rho)[..., 0] - friction(value * np.exp(-step), rho)[..., 0]) / 2e-4
        for step in 1e-4 * np.eye(4)
    ], axis=-1)  # (n, f, 4)  # fmt: skip
    added = friction(value, rho)[..., 1] ** 2 - friction(value, 1e-12 * rho)[..., 1] ** 2
    expected = np.einsum("nfk,kl,nfl->nf", by_gain, rho, by_gain)
    assert np.sqrt(np.delete(expected, 4, axis=0)).min() > 0.01  # joint 5 hardly shows
    np.testing.assert_allclose(np.sqrt(added), np.sqrt(expected), rtol=1e-3)  # first order, of residuals of 1e-3


def test_what_a_rival_changes_of_inertial_parameters_counts_by_its_share(structure, chi, rng, monkeypatch):
    problem, gains = bare(structure, chi, rng, 1e-3), known()
    plain = arm_in_SI(problem, PLAIN, gains)
    final, change = plain.selected.final, 0.1 * np.arange(1.0, 1.0 + len(plain.inertial))
    other = replace(final)
    vars(other)["theta"] = final.theta + change
    selected = replace(plain.selected, rivals=(AlternativeModel(share=0.3, other=other, final=final),))
    monkeypatch.setattr("ident.parameters.arm.chosen_model", lambda *_: selected)
    added = arm_in_SI(problem, PLAIN, gains).inertial_covariance - plain.inertial_covariance
    np.testing.assert_allclose(added, 0.09 * np.outer(change, change), rtol=1e-9)


def test_what_a_rival_changes_of_friction_is_found_by_name_and_motion(structure, chi, rng):
    final = gain_ratios(bare(structure, chi, rng, 1e-3), AllJointsOptions()).selected.final
    own = final.friction(2)
    assert list(own)[:2] == [("Fv", 0), ("Fv", 1)]
    kept, change = [4, 1, 0, 3], np.array([0.7, -0.2, 0.5, 0.3])  # without one, in another order, and with one more
    moved = {list(own)[k]: list(own.values())[k] + by for k, by in zip(kept, change, strict=True)}
    other = SimpleNamespace(friction=lambda joint: moved | {("load", -1): 0.06} if joint == 2 else {})
    found = rival_friction(AlternativeModel(share=0.4, other=other, final=final), 2, final)
    np.testing.assert_allclose(found, [0.4 * 0.5, 0.4 * -0.2, 0.0, 0.4 * 0.3, 0.4 * 0.7], rtol=1e-12)  # rounding


def test_a_gain_is_off_beside_what_the_reference_says():
    ratios = GainRatios(
        reference=1,
        value=np.array([0.5, 1.0, -1.4, 3.0]),
        rel_std=np.array([0.01, 0.0, 0.02, 0.03]),
        given=np.array([True, True, True, False]),
        max_rel_std=0.025,
    )
    std = np.array([0.03, 0.04, 0.06])
    value = np.array([0.6, 1.2, -1.8])
    C = np.diag(std**2)
    C[0, 1] = C[1, 0] = 0.0007
    believed = KnownGains(names=tuple("abcd"), joints=np.arange(3), value=value, covariance=C * np.outer(value, value))
    found = ratios.against(believed)
    assert list(found) == [0, 2]
    first = np.sqrt(0.01**2 + 0.03**2 + 0.04**2 - 2 * 0.0007)
    np.testing.assert_allclose(found[0], (0.0, first), rtol=1e-9, atol=1e-12)
    third = 1.4 / 1.5 * np.sqrt(0.02**2 + 0.06**2 + 0.04**2)
    np.testing.assert_allclose(found[2], (1.4 / 1.5 - 1.0, third), rtol=1e-9)  # 7 % below
    assert ratios.against(replace(believed, joints=np.array([0, 2, 3]))) == {}
    assert replace(ratios, reference=3).against(believed) == {}
    *given, refused = map(ratios.reason, range(4))
    assert given == [None] * 3
    assert refused == (
        "standard deviation 3 % of the ratio exceeds 2.5 %; these motions hardly excite the links that it shares with "
        "joint 2"
    )
