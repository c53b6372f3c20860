"""A payload of unknown parameters, held to what a body can have."""

import numpy as np

from ident.model.parameters import pseudo_inertia
from ident.parameters.nearest_body import Bodies, nearest_possible
from ident.payload.payload import standard_parameters

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
    assert np.linalg.eigvalsh(bodies.fixed + np.tensordot(found, bodies.slopes, 1)).min() > 0.0


def test_what_is_known_of_a_body_stays(rng):
    known = np.zeros((1, 10))
    known[0, 9] = 2.3
    bodies = Bodies(known=known, body=np.zeros(9, dtype=np.intp), place=ALL[:9])
    inside = standard_parameters(2.3, np.zeros(3), (0.7, 0.7, 0.7, 0.0, 0.0, 0.0))[:9]
    found = nearest_possible(bodies, rng.normal(size=9), np.diag(rng.uniform(0.5, 2.0, 9)), inside)
    assert np.linalg.eigvalsh(bodies.fixed + np.tensordot(found, bodies.slopes, 1)).min() > 0.0
    pseudo = pseudo_inertia(np.append(found, 2.3))
    assert np.linalg.eigvalsh(pseudo)[0] > 0.0
    assert pseudo[3, 3] == 2.3
