"""`ols` and `tls-2014`: what the homogeneous form adds to the contract of every estimator."""

from dataclasses import replace

import numpy as np
import pytest
from exact import EXACT, GAIN, TRUSTING, exact_pair, values
from homogeneous_methods import LOOSE, METHODS, moved, noisy

from ident.estimation.estimate import RefusedGain
from ident.estimation.estimators import ols, tls_2014
from ident.estimation.homogeneous import WEIGHTS, HomogeneousOptions, homogeneous_system
from ident.estimation.problem import Problem, pair
from ident.estimation.uncertainty import left_out
from ident.observation.observation import Observation
from ident.payload.payload import Payload
from ident.support.errors import NotIdentifiable, OptionError, TooFewRows


def imitated(observation: Observation, loaded: float) -> Observation:
    """The payload's mass puts on every joint what an offset that only loaded motions have would."""

    def changed(j, joint):
        W, W_L = joint.W.copy(), np.zeros_like(joint.W_L)
        names = [observation.structure.base.names[c] for c in joint.columns]
        W[:, names.index(f"off{j + 1}")] = loaded
        W_L[:, 9] = (0.3 + j) * loaded
        return replace(joint, W=W, W_L=W_L)

    return replace(observation, joints=tuple(changed(j, joint) for j, joint in enumerate(observation.joints)))


def shorter(observation: Observation, joints: int) -> Observation:
    """Without the first row of the first few joints."""

    def cut(joint):
        rows = {name: getattr(joint, name)[1:] for name in ("V", "W", "W_L", "t", "position")}
        return replace(joint, **rows)

    return replace(observation, joints=(*map(cut, observation.joints[:joints]), *observation.joints[joints:]))


@pytest.mark.parametrize("weights", WEIGHTS)
@pytest.mark.parametrize("method", METHODS)
def test_exact_data_give_every_gain_from_the_mass_alone_through_the_links_that_joints_share(
    method, weights, clean_pair, heavy
):
    problem = pair(*clean_pair, Payload(mass=heavy.mass, known="mass"), TRUSTING)
    np.testing.assert_allclose(values(METHODS[method](problem, weights)), GAIN, rtol=100 * EXACT)


@pytest.mark.parametrize("method", METHODS)
def test_a_weight_that_is_none_is_refused_with_those_that_exist(method, clean_pair, heavy):
    with pytest.raises(OptionError, match="weights = 'rows': expected one of equal, joint"):
        METHODS[method](pair(*clean_pair, heavy, LOOSE), "rows")


@pytest.mark.parametrize("method", METHODS)
def test_what_sets_no_scale_is_refused_at_once(method, clean_pair, heavy):
    bare, loaded = pair(*clean_pair, heavy, LOOSE).motions
    with pytest.raises(NotIdentifiable, match="no motion is bare"):
        METHODS[method](Problem(bare.observation.structure, (loaded, loaded), LOOSE), "equal")
    unknown = replace(loaded, payload=Payload(mass=heavy.mass, known="none"))
    with pytest.raises(NotIdentifiable, match="the torque of the known payload cannot be separated"):
        METHODS[method](Problem(bare.observation.structure, (bare, unknown), LOOSE), "equal")
    with pytest.raises(NotIdentifiable, match="the torque of the known payload cannot be separated"):
        METHODS[method](pair(imitated(clean_pair[0], 0.0), imitated(clean_pair[1], 1.0), heavy, LOOSE), "equal")


@pytest.mark.parametrize(("rows", "enough"), [(64, False), (65, True)])
def test_there_must_be_more_rows_than_unknowns(structure, heavy, rows, enough, rng):
    bare, loaded = exact_pair(structure, heavy, GAIN, rng, rows=6)  # 72 rows; every bare joint loses one
    motions = shorter(bare, 6), shorter(loaded, 66 - rows)
    if enough:
        assert homogeneous_system(pair(*motions, heavy, LOOSE), "equal").H.shape == (65, 64)
    else:
        with pytest.raises(TooFewRows, match="64 rows cannot give 64 unknowns"):
            homogeneous_system(pair(*motions, heavy, LOOSE), "equal")


def test_the_exact_parameters_solve_the_equations(structure, heavy):
    rng = np.random.default_rng(4)
    chi = np.random.default_rng(4).uniform(0.5, 2.0, 84)
    problem = pair(*exact_pair(structure, heavy, GAIN, rng, rows=50), heavy, LOOSE)
    base = structure.base.regrouping @ chi
    for weights in WEIGHTS:
        system = homogeneous_system(problem, weights)
        own = [base[structure.base.names.index(f"{name}{j + 1}")] for j in range(6) for name in system.own[j].names]
        x = np.concatenate((GAIN, base[system.shared.arm], own))
        np.testing.assert_allclose(system.H @ x, system.k, atol=EXACT * np.abs(system.k).max())
        assert [system.friction_at(j) for j in range(6)] == [46 + 3 * j for j in range(6)]


@pytest.mark.parametrize("weights", WEIGHTS)
@pytest.mark.parametrize("method", METHODS)
def test_the_load_on_a_joint_is_what_the_known_payload_puts_on_its_loaded_rows(method, weights, clean_pair, heavy):
    chi = heavy.known_part().chi
    rms = [np.sqrt(np.mean((joint.W_L @ chi) ** 2)) for joint in clean_pair[1].joints]
    found = METHODS[method](pair(*clean_pair, heavy, LOOSE), weights).solution.load_rms
    np.testing.assert_allclose(found, rms, rtol=1e-12)


def test_joint_weights_are_one_over_the_deviation_of_the_torque(clean_pair, heavy):
    # The deviation of 180 rows less up to 48 unknowns is known to 1 / sqrt(2 * 132) = 6 %; 4 of them.
    share = np.array([0.002, 0.004, 0.003, 0.002, 0.005, 0.001])
    rows = noisy(clean_pair, np.random.default_rng(8), share)
    system = homogeneous_system(pair(*rows, heavy, LOOSE), "joint")
    for j in range(6):
        V = np.concatenate([o.joints[j].V for o in clean_pair])
        deviation = share[j] * np.sqrt(np.mean(V**2)) * abs(GAIN[j])
        np.testing.assert_allclose(system.weight[system.joint == j] * deviation, 1.0, rtol=0.25)


def test_the_derivative_of_least_squares_holds_at_any_noise(clean_pair, heavy):
    rows = noisy(clean_pair, np.random.default_rng(5), np.full(6, 0.1))

    def solved(loaded: Observation):
        return ols._solved(homogeneous_system(pair(rows[0], loaded, heavy, LOOSE), "equal"))

    found, h = solved(rows[1]), 1e-4
    for joint in (1, 4):
        at = np.zeros(90)
        at[31] = h
        ends = [solved(moved(rows[1], {joint: sign * at})).x for sign in (-1.0, 1.0)]
        derivative = (ends[1] - ends[0]) / (2.0 * h)
        column = found.by_current[:, 180 * joint + 90 + 31]
        # A central difference of steps of 1e-5 of the current: rounding 1e-11, times a condition of 1e5.
        np.testing.assert_allclose(derivative, column, atol=1e-5 * np.abs(column).max())


def test_left_out_stretches_are_those_of_least_squares_without_them(clean_pair, heavy):
    # Influence is of first order in the noise, 2e-5; leaving out is exact for fixed columns.
    rows = noisy(clean_pair, np.random.default_rng(5), np.full(6, 2e-5))
    problem = pair(*rows, heavy, LOOSE)
    system = homogeneous_system(problem, "equal")
    estimate = METHODS["ols"](problem, "equal")
    for block, left in left_out(estimate.solution.rows)[::7]:
        kept = np.setdiff1d(np.arange(len(system.k)), block)
        without = np.linalg.lstsq(system.H[kept], system.k[kept])[0][:6]
        change = 1.0 / estimate.solution.inverse - without
        found = -(estimate.solution.influence[:, block] @ left) / estimate.solution.inverse**2
        np.testing.assert_allclose(found, change, atol=2e-3 * np.abs(change).max())


@pytest.mark.parametrize("weights", WEIGHTS)
def test_residuals_are_the_currents_less_what_gain_and_torque_say(clean_pair, heavy, weights):
    problem = pair(*noisy(clean_pair, np.random.default_rng(5), np.full(6, 0.02)), heavy, LOOSE)
    for method in METHODS:
        estimate = METHODS[method](problem, weights)
        system = homogeneous_system(problem, weights)
        own = ols._solved(system) if method == "ols" else tls_2014._solved(system)
        torque = (system.k - system.H[:, 6:] @ own.x[6:]) / system.weight
        rows = estimate.solution.rows
        np.testing.assert_allclose(rows.residual, rows.V - torque / own.x[rows.joint], atol=1e-9 * np.abs(rows.V).max())
        np.testing.assert_allclose(rows.explained.T @ rows.explained, np.eye(rows.explained.shape[1]), atol=1e-12)
        assert sum(rows.unknowns.values()) == pytest.approx(64.0, rel=1e-12)
        if method == "ols":
            leverage = np.einsum("ru,ur->r", system.H, np.linalg.pinv(system.H))
            shares = [leverage[rows.joint == j].sum() for j in range(6)]
            np.testing.assert_allclose([rows.unknowns[j] for j in range(6)], shares, rtol=1e-7)
        np.testing.assert_allclose(rows.weight, np.abs(own.x[rows.joint]) * system.weight, rtol=1e-12)


def test_friction_over_gain_is_that_of_the_arm_and_its_influence_the_derivative(structure, heavy):
    chi = np.random.default_rng(4).uniform(0.5, 2.0, 84)
    motions = exact_pair(structure, heavy, GAIN, np.random.default_rng(4), noise=1e-6, rows=60)
    for method in METHODS:
        solution = METHODS[method](pair(*motions, heavy, LOOSE), "equal").solution
        for j in range(6):
            Fv, Fc = (chi[structure.base.labels.index(f"{name}{j + 1}")] for name in ("Fv", "Fc"))
            place = [structure.base.names[c] for c in motions[0].joints[j].columns].index(f"Fv{j + 1}")
            dq = np.concatenate([o.joints[j].W[:, place] for o in motions])
            total = (Fv * np.sqrt(np.mean(dq**2)) + Fc) / GAIN[j]
            np.testing.assert_allclose(solution.friction[j], [total, Fc / GAIN[j]], rtol=1e-3)  # noise 1e-6, cond 1e2
        row, h, ends = 29, 1e-6, []
        for sign in (-1.0, 1.0):
            at = np.zeros(60)
            at[row] = sign * h
            both = (motions[0], moved(motions[1], {2: at}))
            ends.append(METHODS[method](pair(*both, heavy, LOOSE), "equal").solution.friction)
        derivative, found = (ends[1] - ends[0]) / (2.0 * h), solution.friction_influence[:, :, 120 * 2 + 60 + row]
        np.testing.assert_allclose(derivative, found, atol=1e-3 * np.abs(found).max())


@pytest.mark.parametrize("method", METHODS)
def test_a_joint_whose_rows_say_nothing_has_no_gain_and_spoils_no_other(method, clean_pair, heavy):
    silent = [
        replace(
            o,
            joints=tuple(
                replace(joint, V=0.0 * joint.V, W=0.0 * joint.W, W_L=0.0 * joint.W_L) if j == 3 else joint
                for j, joint in enumerate(o.joints)
            ),
        )
        for o in clean_pair
    ]
    estimate = METHODS[method](pair(*silent, heavy, TRUSTING), "equal")
    others = [0, 1, 2, 4, 5]
    np.testing.assert_allclose(values(estimate)[others], GAIN[others], rtol=100 * EXACT)
    refused = estimate.joints[3]
    assert isinstance(refused, RefusedGain)
    assert refused.reason == "its rows do not determine the gain"
    assert refused.predicted_rel_std is None
    assert 3 not in estimate.solution.rows.joint


def test_the_model_s_known_payload_moves_gains_of_the_homogeneous_form_as_stated(clean_pair, heavy):
    rows = noisy(clean_pair, np.random.default_rng(5), np.full(6, 1e-4))
    sure = replace(heavy, mass_std=0.0)
    for method in METHODS:
        stated = METHODS[method](pair(*rows, replace(sure, com_std=(0.0, 0.002, 0.0)), LOOSE), "equal")
        x, y, z = heavy.com
        ends = [
            values(METHODS[method](pair(*rows, replace(sure, com=(x, y + d, z)), LOOSE), "equal"))
            for d in (-1e-5, 1e-5)
        ]
        share = np.abs((ends[1] - ends[0]) / 2e-5 / values(stated)) * 0.002
        # The known torque is part of the column's scale: of second order in the noise.
        np.testing.assert_allclose([joint.payload_rel_std for joint in stated.joints], share, rtol=2e-2, atol=1e-6)


def test_total_least_squares_have_columns_of_unit_norm_and_rows_weighted_by_joint_unless_told_otherwise(
    clean_pair, heavy
):
    problem = pair(*noisy(clean_pair, np.random.default_rng(9), np.full(6, 0.03)), heavy, LOOSE)
    system = homogeneous_system(problem, "joint")
    M = np.column_stack((system.H, -system.k))
    scale = np.linalg.norm(M, axis=0)
    z = np.linalg.eigh((M / scale).T @ (M / scale))[1][:, 0] / scale
    found = tls_2014.total_gains(problem, HomogeneousOptions()).solution.inverse
    np.testing.assert_allclose(1.0 / found, z[:6] / z[-1], rtol=1e-6)  # a square of singular values, condition 1e3
