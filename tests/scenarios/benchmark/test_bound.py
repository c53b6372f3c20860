from dataclasses import replace

import numpy as np
import pytest
from protocols import protocol_setup
from scipy import linalg

from ident.estimation.rows import Columns
from scenarios.benchmark.study import bound_of, gain_bound
from scenarios.experiments.scenario import load_scenario, setup_of, with_method


def columns(F: list[np.ndarray], V: list[np.ndarray]) -> Columns:
    """Rows of some joints, with up to two own columns each."""
    joint, r = np.repeat(np.arange(len(V)), [len(each) for each in V]), sum(map(len, V))
    own = [np.hstack((each, np.zeros((len(each), 3 - each.shape[1])))) for each in F]
    return Columns(
        joint=joint,
        motion=np.zeros(len(joint), dtype=np.intp),
        position=np.concatenate([np.arange(len(each)) for each in V]),
        V=np.concatenate(V),
        names=("Fv1", "Fc1", "off1"),
        W=np.vstack(own),
        W_L=np.zeros((0, r, 10)),
        t=np.zeros(r),
        weight=np.ones(r),
        loaded=np.zeros(r, dtype=bool),
    )


def test_the_bound_is_the_inverse_of_the_information_of_the_whole_model(rng):
    h, theta, phi = np.array([0.7, -2.1]), rng.normal(size=3), [rng.normal(size=2), rng.normal(size=1)]
    A, k = [rng.normal(size=(r, 3)) for r in (30, 25)], [rng.normal(size=30), np.zeros(25)]
    F = [rng.normal(size=(30, 2)), rng.normal(size=(25, 1))]
    sigma = [rng.uniform(0.1, 0.9, 30), rng.uniform(0.1, 0.9, 25)]

    def currents(x: np.ndarray) -> np.ndarray:
        g, t = np.exp(x[:2]) / h, x[2:5]  # log-gains of size 0 at the truth
        own = [x[5:7], x[7:8]]
        return np.concatenate([((A[j] @ t + k[j]) * h[j] / (g[j] * h[j]) + F[j] @ own[j]) / sigma[j] for j in (0, 1)])

    truth = np.concatenate([np.zeros(2), theta, *phi])
    V = [(A[j] @ theta + k[j]) * h[j] + F[j] @ phi[j] for j in (0, 1)]
    J = np.column_stack([(currents(truth + e) - currents(truth - e)) / 2e-5 for e in 1e-5 * np.eye(8)])
    expected = np.sqrt(np.diag(linalg.inv(J.T @ J)))[:2]
    # Central differences of a smooth function with steps of 1e-5: 1e-10, and rounding of 1e-11.
    found = bound_of(columns(F, V), (np.vstack(A), np.concatenate(k)), h, np.concatenate(sigma))
    np.testing.assert_allclose(found, expected, rtol=1e-7)


def test_a_joint_that_nothing_known_reaches_has_no_bound(rng):
    A, known = rng.normal(size=(30, 2)), rng.normal(size=30)
    each = [np.hstack((A, np.zeros((30, 2)))), np.hstack((np.zeros((30, 2)), A))]
    V = [A @ [1.0, 2.0] + known, A @ [1.0, 2.0]]
    rows, shared = columns(2 * [np.zeros((30, 0))], V), (np.vstack(each), np.append(known, np.zeros(30)))
    found = bound_of(rows, shared, np.array([1.0, 1.0]), np.ones(60))
    assert found[0] < 1.0
    assert found[1] > 1e6


@pytest.mark.parametrize(
    ("name", "percent"),
    [
        ("mass-only", [0.55, 0.34, 0.34, 0.89, 0.90]),
        pytest.param("nominal", [0.28, 0.22, 0.18, 0.19, 0.23], marks=pytest.mark.slow),
    ],
)
def test_the_bound_of_a_scenario_is_what_a_second_implementation_found(name, percent):
    # From all samples and the exact spectrum; two digits are known of it.
    np.testing.assert_allclose(100.0 * gain_bound(setup_of(load_scenario(name)))[:5], percent, atol=0.01)


def test_the_bound_is_in_proportion_to_the_noise_and_none_without(scenario):
    nominal = setup_of(with_method(load_scenario(str(scenario)), "nls", []))

    def noisy(**sensors: float):
        return replace(
            nominal, experiments=tuple(replace(e, sensors=replace(e.sensors, **sensors)) for e in nominal.experiments)
        )

    assert gain_bound(noisy(current_white=0.0, current_coloured=0.0)) is None
    white = gain_bound(noisy(current_coloured=0.0))
    np.testing.assert_allclose(gain_bound(noisy(current_white=0.15, current_coloured=0.0)), 3.0 * white, rtol=1e-9)
    coloured, both = gain_bound(noisy(current_white=0.0)), gain_bound(nominal)
    np.testing.assert_allclose(np.hypot(white, coloured), both, rtol=1e-9)  # variances of the same rows add up


def test_the_bound_does_not_depend_on_the_order_of_the_motions(tmp_path):
    names = ("bare", "heavy", "light", "bare", "heavy"), ("bare", "bare", "heavy", "heavy", "light")
    one, other = (gain_bound(protocol_setup(tmp_path, each)) for each in names)
    np.testing.assert_allclose(one[:5], other[:5], rtol=1e-6)
