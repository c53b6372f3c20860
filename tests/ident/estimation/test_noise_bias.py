"""The bias that noise of the currents leaves in the homogeneous form, as it is stated."""

from dataclasses import replace

import numpy as np
import pytest
from exact import GAIN
from homogeneous_methods import LOOSE, METHODS, noisy

from ident.estimation.estimate import IdentifiedGain
from ident.estimation.estimators import ols
from ident.estimation.estimators.ols import noise_bias
from ident.estimation.homogeneous import WEIGHTS, homogeneous_system
from ident.estimation.problem import pair


# Equal weights are held against the closed form below.
@pytest.mark.parametrize("weights", [pytest.param(w, marks=[pytest.mark.slow] * (w == "equal")) for w in WEIGHTS])
def test_the_stated_bias_is_that_of_forty_draws(clean_pair, heavy, weights):
    share = np.array([0.06, 0.10, 0.04, 0.08, 0.05, 0.03])
    error, stated = [], []
    for seed in range(40):
        problem = pair(*noisy(clean_pair, np.random.default_rng(seed), share), heavy, LOOSE)
        system = homogeneous_system(problem, weights)
        found = ols._solved(system)
        error.append(found.x[:6] / GAIN - 1.0)
        stated.append([noise_bias(system, found)[j] for j in range(6)])
    mean, wanted = np.mean(stated, axis=0), np.mean(error, axis=0)
    deviation = np.std(error, axis=0) / np.sqrt(40)
    assert (wanted < -10.0 * deviation).sum() >= 4  # there is a bias to be found
    # Four deviations of the mean of six joints: once in 2600 seeds; to second order the closed form, a ratio of means,
    # is off by a few percent of itself.
    np.testing.assert_array_less(np.abs(mean - wanted), 4.0 * deviation + 0.05 * np.abs(wanted))


def test_the_bias_is_the_closed_form_of_what_the_noise_adds_to_the_normal_matrix(clean_pair, heavy):
    # By hand: E g = (S_0 + N)^-1 S_0 g_0 with S = S_0 + N from the data, solved for g_0 by plain inverses.
    rows = noisy(clean_pair, np.random.default_rng(2), np.full(6, 0.05))
    system = homogeneous_system(pair(*rows, heavy, LOOSE), "equal")
    own, others = system.H[:, :6], system.H[:, 6:]
    apart = np.eye(len(own)) - others @ np.linalg.pinv(others)
    S, N = own.T @ apart @ own, np.zeros((6, 6))
    for j in range(6):
        mine = system.joint == j
        W = np.hstack((others[mine], np.concatenate([o.joints[j].W_L * loaded for loaded, o in enumerate(rows)])))
        left = own[mine, j] - W @ (np.linalg.pinv(W, rcond=1e-9) @ own[mine, j])
        N[j, j] = left @ left / (mine.sum() - np.linalg.matrix_rank(W, tol=1e-6)) * np.diag(apart)[mine].sum()
    found = ols._solved(system)
    gain, bias = found.x[:6], noise_bias(system, found)
    before = np.linalg.inv(S - N) @ S @ gain
    np.testing.assert_allclose([bias[j] for j in range(6)], gain / before - 1.0, rtol=1e-6)  # condition of S: 1e5


def test_each_gain_has_its_bias_in_words_and_a_refused_one_has_none(clean_pair, heavy):
    rows = noisy(clean_pair, np.random.default_rng(2), np.full(6, 0.05))
    problem = pair(*rows, heavy, LOOSE)
    loose = METHODS["ols"](problem, "equal")
    system = homogeneous_system(problem, "equal")
    bias = noise_bias(system, ols._solved(system))
    assert max(bias.values()) < 0.0
    assert loose.remarks == tuple(
        f"joint {j + 1}: noise of the currents makes this gain {-100.0 * bias[j]:.2g} % too small" for j in range(6)
    )
    predicted = np.array([joint.predicted_rel_std for joint in loose.joints])
    limit = float(np.sort(predicted)[2])
    strict = METHODS["ols"](replace(problem, options=replace(LOOSE, max_rel_std=limit)), "equal")
    given = [j for j, joint in enumerate(strict.joints) if isinstance(joint, IdentifiedGain)]
    assert len(given) == 3
    assert [remark.split(":")[0] for remark in strict.remarks] == [f"joint {j + 1}" for j in given]


def test_currents_of_nothing_but_noise_have_no_bias_that_could_be_stated(clean_pair, heavy):
    rng = np.random.default_rng(6)
    rows = [
        replace(o, joints=tuple(replace(joint, V=rng.standard_normal(len(joint.V))) for joint in o.joints))
        for o in clean_pair
    ]
    problem = pair(*rows, heavy, LOOSE)
    system = homogeneous_system(problem, "equal")
    assert noise_bias(system, ols._solved(system)) is None
    (remark,) = METHODS["ols"](problem, "equal").remarks
    assert "unknown" in remark
