"""A payload of unknown parameters, held to what a body can have."""

from dataclasses import replace

import numpy as np
import pytest
from exact import GAIN, exact_problem, values

from ident.estimation.all_joints.body import possible
from ident.estimation.all_joints.pseudo_inertia import Bodies, nearest_possible
from ident.estimation.all_joints.solution import Fitted, setting
from ident.estimation.estimators.nls import AllJointsOptions, all_joints_gains, fit_as_named
from ident.estimation.gain_options import GainOptions
from ident.estimation.problem import Problem
from ident.model.parameters import pseudo_inertia
from ident.payload.payload import Payload, standard_parameters
from ident.support.errors import NotIdentifiable, OptionError

LOOSE = GainOptions(noise_floor=1e-12, max_rel_std=10.0)
ALL = np.arange(10)


def test_the_pseudo_inertia_is_the_second_moment_of_the_mass(rng):
    m, r = rng.uniform(0.2, 1.7, 5), rng.normal(size=(5, 3))
    points = sum(standard_parameters(mass, at, (0.0,) * 6) for mass, at in zip(m, r, strict=True))
    moments = np.column_stack((r, np.ones(5)))
    np.testing.assert_allclose(pseudo_inertia(points), np.einsum("k,ki,kj->ij", m, moments, moments), rtol=1e-12)


def test_in_the_metric_of_the_pseudo_inertia_negative_eigenvalues_become_zero(rng):
    bodies = Bodies(known=np.zeros((2, 10)), body=np.repeat([0, 1], 10), place=np.tile(ALL, 2))
    slopes = bodies.slopes.reshape(20, -1)
    wanted = rng.normal(size=20)
    inside = np.tile(standard_parameters(1.3, np.zeros(3), (0.7, 0.7, 0.7, 0.0, 0.0, 0.0)), 2)
    found = nearest_possible(bodies, wanted, slopes @ slopes.T, inside)
    for each, near in zip(wanted.reshape(2, 10), found.reshape(2, 10), strict=True):
        size, axes = np.linalg.eigh(pseudo_inertia(each))
        assert size[0] < -0.1
        # Higham (1988). The barrier ends at a distance whose square is within 8e-11 of the least.
        np.testing.assert_allclose(pseudo_inertia(near), (axes * np.maximum(size, 0.0)) @ axes.T, rtol=0, atol=2e-5)
    assert bodies.least(found) > 0.0


def test_what_is_known_of_a_body_stays(rng):
    known = np.zeros((1, 10))
    known[0, 9] = 2.3
    bodies = Bodies(known=known, body=np.zeros(9, dtype=np.intp), place=ALL[:9])
    inside = standard_parameters(2.3, np.zeros(3), (0.7, 0.7, 0.7, 0.0, 0.0, 0.0))[:9]
    found = nearest_possible(bodies, rng.normal(size=9), np.diag(rng.uniform(0.5, 2.0, 9)), inside)
    assert bodies.least(found) > 0.0
    pseudo = pseudo_inertia(np.append(found, 2.3))
    assert np.linalg.eigvalsh(pseudo)[0] > 0.0
    assert pseudo[3, 3] == 2.3


ROD = Payload(mass=6.3, com=(0.06, -0.04, 0.11), inertia=(0.02, 0.02, 1e-5, 0.0, 0.0, 0.0), known="mass")


@pytest.fixture(scope="module")
def thin(structure) -> Problem:
    """A payload so thin that noise makes it impossible: its second moments across are next to zero."""
    chi = np.random.default_rng(8).uniform(0.5, 2.0, 84)
    motions = [(chi, None, None), (chi, ROD, ROD)]
    return exact_problem(structure, motions, GAIN, np.random.default_rng(9), noise=0.02, rows=200, options=LOOSE)


def shown_as(final: Fitted, **computed: np.ndarray) -> Fitted:
    """The same fit with other values of what is computed on demand."""
    fit = replace(final.fit)
    vars(fit).update(computed)
    return replace(final, fit=fit)


def test_gains_are_those_with_the_nearest_possible_payload(thin):
    free, held = (all_joints_gains(thin, AllJointsOptions(payload_body=body)) for body in ("free", "possible"))
    assert free.remarks == ()
    assert "the best-fitting payload parameters are not physically consistent" in held.remarks[0]
    ready = setting(thin, per_motion=True, prior_std=1.0)
    final = fit_as_named(ready, (), compliance=False)
    moved = possible(ready, final).log
    mirrored = shown_as(final, log_influence=-final.fit.log_influence, log_belief=-final.fit.log_belief)
    assert possible(ready, mirrored).remarks == held.remarks  # of the largest change, whatever its sign
    np.testing.assert_allclose(values(held), values(free) * np.exp(-moved), rtol=1e-12)  # g = 1 / h
    joint = int(np.argmax(np.abs(moved)))
    assert f"joint {joint + 1} by {100.0 * abs(moved[joint]):.2g} %" in held.remarks[0]
    np.testing.assert_allclose(
        [a.residual_std / a.value for a in held.joints], [a.residual_std / a.value for a in free.joints], rtol=1e-12
    )
    # A second implementation: the fit of all rows with the nearest payload told as known.
    unknown = len(ready.shared.arm) + np.arange(9)
    spread = np.hstack((final.fit.theta_influence[unknown] / final.fit.rows.weight, final.fit.theta_belief[unknown]))
    bodies = Bodies(known=ready.shared.known, body=np.zeros(9, dtype=np.intp), place=ALL[:9])
    inside = standard_parameters(ROD.mass, np.zeros(3), (0.1, 0.1, 0.1, 0.0, 0.0, 0.0))[:9]
    nearest = nearest_possible(bodies, final.fit.found.theta[unknown], np.linalg.inv(spread @ spread.T), inside)
    told = all_joints_gains(with_known(thin, np.append(nearest, ROD.mass)), AllJointsOptions())
    # The linear step leaves what is of second order in it; on joint 6 nothing but the payload ties the gain.
    assert np.abs(np.log(values(held) / values(told)))[:5].max() < 0.2 * np.abs(moved[:5]).max()


def with_known(problem: Problem, chi: np.ndarray) -> Problem:
    """The problem with a payload of which all is known, of standard parameters."""
    com = chi[6:9] / chi[9]
    xx, xy, xz, yy, yz, zz = chi[:6] - standard_parameters(chi[9], com, (0.0,) * 6)[:6]
    known = Payload(mass=chi[9], com=tuple(com), inertia=(xx, yy, zz, xy, xz, yz), known="all")
    bare, loaded = problem.motions
    return replace(problem, motions=(bare, replace(loaded, payload=known)))


def test_a_payload_that_is_possible_stays_bit_for_bit(structure, rng):
    thick, chi = replace(ROD, inertia=(0.4, 0.5, 0.3, 0.02, -0.01, 0.03)), rng.uniform(0.5, 2.0, 84)
    problem = exact_problem(structure, [(chi, None, None), (chi, thick, thick)], GAIN, rng, noise=1e-4, options=LOOSE)
    free, held = (all_joints_gains(problem, AllJointsOptions(payload_body=body)) for body in ("free", "possible"))
    np.testing.assert_array_equal(held.solution.inverse, free.solution.inverse)
    assert held.remarks == free.remarks == ()


def test_a_payload_that_is_known_is_not_asked(structure, rng):
    known, chi = replace(ROD, known="all"), rng.uniform(0.5, 2.0, 84)
    problem = exact_problem(structure, [(chi, None, None), (chi, known, known)], GAIN, rng, noise=0.02, options=LOOSE)
    free, held = (all_joints_gains(problem, AllJointsOptions(payload_body=body)) for body in ("free", "possible"))
    np.testing.assert_array_equal(held.solution.inverse, free.solution.inverse)


def test_parameters_that_nothing_shows_are_refused(thin):
    ready = setting(thin, per_motion=True, prior_std=1.0)
    final = fit_as_named(ready, (), compliance=False)
    few = replace(ready, shared=replace(ready.shared, free=(ready.shared.free[0][:-1],)))
    unseen = final.fit.theta_influence.copy()
    unseen[len(ready.shared.arm) + 3] = 0.0
    for asked, shown in ((few, final), (ready, shown_as(final, theta_influence=unseen))):
        with pytest.raises(NotIdentifiable, match="not every unknown payload parameter is identifiable"):
            possible(asked, shown)


def test_free_is_the_default_and_other_names_are_refused():
    assert AllJointsOptions() == AllJointsOptions(payload_body="free")
    with pytest.raises(OptionError, match="payload_body = 'round': expected one of free, possible"):
        AllJointsOptions(payload_body="round")
