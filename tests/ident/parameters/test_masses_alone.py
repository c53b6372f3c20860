"""The mass that one joint alone shows, with its gain known."""

from dataclasses import replace

import numpy as np
import pytest
from exact import GAIN
from weighings import PLAIN, known

from ident.estimation.selection import AlternativeModel
from ident.parameters.payload import Quantity, payload_of
from ident.parameters.weighing import mass_alone, masses_alone
from ident.payload.payload import standard_parameters


def test_each_joint_alone_gives_the_mass_off_by_as_much_as_its_gain(weighed_problem, heavy):
    wrong = GAIN * np.array([1.0, 1.03, 1.0, 0.96, 1.0, 1.0])
    found = payload_of(weighed_problem, known(wrong), PLAIN)
    alone = masses_alone(found, heavy, known(wrong, rel_std=np.array([0.01, 0.02, 0.03, 0.04, 0.05, 0.06])))
    masses = np.array([each.value for each in alone if isinstance(each, Quantity)])
    np.testing.assert_allclose(masses / 7.025, wrong / GAIN, rtol=1e-5)
    shares = [each.gain_std / each.value for each in alone if isinstance(each, Quantity)]
    np.testing.assert_allclose(shares, [0.01, 0.02, 0.03, 0.04, 0.05, 0.06], rtol=1e-9)


@pytest.mark.parametrize("part", ["all", "com", "mass"])
def test_of_the_shape_what_is_not_known_is_free(weighed_payload, heavy, part):
    # The stated centre and inertia are wrong where they must not be used, the mass always: it is what is found.
    stated = replace(heavy, mass=5.0, known=part)
    if part == "all":
        shape = standard_parameters(heavy.mass, heavy.com, heavy.inertia) * 5.0 / heavy.mass
        inertia = tuple(5.0 / heavy.mass * each for each in heavy.inertia)
        stated = replace(stated, inertia=inertia)
        np.testing.assert_allclose(stated.known_part().chi, shape, rtol=1e-12)
    elif part == "mass":
        stated = replace(stated, com=(0.3, 0.2, 0.1))
    alone = masses_alone(weighed_payload, stated, known())
    shown = [each.value for each in alone if isinstance(each, Quantity)]
    assert len(shown) >= 2
    np.testing.assert_allclose(shown, 7.025, rtol=1e-4)


def test_deviation_of_the_stated_shape_is_a_share_of_a_joint_alone(weighed_payload, heavy):
    changes = {"com_std": (0.0, 0.0, 0.0)}, {"com_std": (0.0, 0.0, 0.01)}, {"com": (0.1, -0.05, 0.14 + 1e-4)}
    sure, unsure, shifted = (masses_alone(weighed_payload, replace(heavy, **each), known())[1] for each in changes)
    # The change by a tenth of a millimetre, a hundred times: the inertia's change by the shift is of second order.
    slope = abs(shifted.value - sure.value) / 1e-4
    np.testing.assert_allclose(unsure.model_std, np.hypot(0.01 * slope, sure.model_std), rtol=0.02)
    assert unsure.model_std > 0.01


@pytest.mark.parametrize(("rel_std", "shown"), [(0.24, True), (0.26, False)])
def test_a_joint_alone_whose_mass_is_off_by_more_than_a_quarter_says_nothing(weighed_payload, heavy, rel_std, shown):
    gains = known(rel_std=np.full(6, rel_std))
    alone = masses_alone(weighed_payload, heavy, gains)
    assert [isinstance(each, Quantity) for each in alone] == [shown] * 6
    assert shown or "its estimate of the mass has a standard deviation of 1.8 kg" in alone[2]  # 0.26 of 7.025


def test_a_mass_alone_is_that_of_least_squares_with_weights_and_beliefs(weighed_payload, heavy, rng):
    found, j = weighed_payload, 3
    final = found.selected.final
    model, columns = final.model, found.selected.final.ready.columns
    std, mean = np.full(model.std.shape, np.inf), np.tile(np.linspace(0.3, 0.7, model.std.shape[1]), (6, 1))
    std[j, 1], std[j, 2] = 0.02, 0.3
    rows, at = final.rows, columns.joint == j
    weight = np.where(rows.motion == 1, 0.6, 1.7) * np.where(rows.joint == j, 1.0, 5.0)
    V = rows.V + 0.02 * rng.normal(size=len(rows.V))
    fitted = replace(final, model=replace(model, mean=mean, std=std))
    vars(fitted)["rows"] = replace(rows, V=V, weight=weight)
    solved = mass_alone(fitted, j, float(GAIN[j]), heavy.known_part())
    assert solved is not None
    shared = len(found.selected.final.ready.shared.arm)
    kilogram = columns.W_L[0][at] @ heavy.known_part().chi / 7.025 / GAIN[j]
    W, w = np.column_stack((model.F[at], found.selected.final.ready.A[at, :shared], kilogram)), weight[at]
    size = len(W)
    believed = np.zeros((2, W.shape[1]))
    believed[0, 1], believed[1, 2] = 1.0 / 0.02, 1.0 / 0.3
    stacked = np.vstack((w[:, None] * W, believed))
    pseudo = np.linalg.pinv(stacked, rcond=1e-12)
    z = pseudo @ np.concatenate((w * V[at], [mean[j, 1] / 0.02, mean[j, 2] / 0.3]))
    scale = np.abs(pseudo[-1]).max()
    # Two factorisations; columns have a condition of 1e4 at most.
    np.testing.assert_allclose(solved.mass, z[-1], rtol=1e-8)
    np.testing.assert_allclose(solved.influence, pseudo[-1, :size] * w, rtol=0, atol=1e-8 * scale * w.max())
    np.testing.assert_allclose(solved.belief, np.linalg.norm(pseudo[-1, size:]), rtol=1e-7)
    assert solved.belief > 1e-4
    left = V[at] - W @ z
    np.testing.assert_allclose(solved.rows.residual, left, rtol=0, atol=1e-8 * np.abs(left).max())
    shown = np.einsum("ij,ji->i", stacked, pseudo)[:size].sum()  # unknowns that the rows show, and not the beliefs
    np.testing.assert_allclose(solved.rows.unknowns[j], shown, rtol=1e-8)
    masses = masses_alone(replace(found, selected=replace(found.selected, final=fitted)), heavy, known())
    assert isinstance(masses[j], Quantity)
    np.testing.assert_allclose(masses[j].model_std, solved.belief, rtol=1e-12)  # the shape is stated to be certain


def test_a_rival_s_difference_counts_in_part_for_all_joints_and_for_each_alone(weighed_problem, heavy, monkeypatch):
    plain = payload_of(weighed_problem, known(), PLAIN)
    final = plain.selected.final
    moved, other = 0.01 * np.arange(1.0, 1.0 + len(final.theta)), replace(final)
    vars(other).update(theta=final.theta + moved, rows=replace(final.rows, V=1.05 * final.rows.V))
    selected = replace(plain.selected, rivals=(AlternativeModel(share=0.4, other=other, final=final),))
    monkeypatch.setattr("ident.parameters.arm.chosen_model", lambda ready, options: selected)
    found = payload_of(weighed_problem, known(), PLAIN)
    at = len(plain.selected.final.ready.shared.arm) + np.arange(10)
    np.testing.assert_allclose(
        found.shares.model - plain.shares.model, 0.16 * np.outer(moved[at], moved[at]), rtol=1e-6
    )
    one, two = (masses_alone(each, heavy, known()) for each in (plain, found))
    for before, after in zip(one, two, strict=True):  # currents that are 5 % larger are of a mass that is
        added = after.model_std**2 - before.model_std**2
        np.testing.assert_allclose(np.sqrt(added), 0.4 * 0.05 * 7.025, rtol=1e-5)  # noise of 1e-9, condition 1e3
