"""The methods of 2011: gains joint by joint, and by the moments of the payload that the first joints show."""

from dataclasses import replace

import numpy as np
import pytest
from exact import EXACT, GAIN, TRUSTING, drive_gains, exact_pair, exact_problem, sequential_gains, values

import ident
from ident.estimation.estimate import RefusedGain, joint_signs, judge_identifiability
from ident.estimation.estimators import ESTIMATORS
from ident.estimation.joint_by_joint import joint_by_joint, joint_fit
from ident.estimation.problem import GainOptions, ObservedMotion, Problem, pair
from ident.payload.payload import Payload
from ident.support.errors import NotIdentifiable

CLASSICAL = GainOptions(max_rel_std=10.0, uncertainty="classical")


def found(method: str, problem: Problem):
    return ESTIMATORS[method].estimate(problem, ESTIMATORS[method].options())


@pytest.fixture
def light(heavy) -> Payload:
    """Of which the mass alone is known."""
    return Payload(mass=heavy.mass, known="mass")


def test_the_reason_of_a_joint_without_a_solution_is_told_of_that_joint(structure, heavy, rng):
    problem, known = pair(*exact_pair(structure, heavy, GAIN, rng), heavy, TRUSTING), [heavy.known_part()]
    fits = [joint_fit(problem, joint, known) for joint in range(6)]
    solution = joint_by_joint(problem, [*fits[:2], "it rests", *fits[3:]], known)
    assert solution.unsolved == {2: "it rests"}
    assert solution.joints.tolist() == [0, 1, 3, 4, 5]


def test_the_mass_alone_gives_joints_1_to_3_exactly_and_refuses_the_rest(structure, heavy, light, rng):
    pair = exact_pair(structure, heavy, GAIN, rng)
    estimate = drive_gains(*pair, light, TRUSTING)
    np.testing.assert_allclose(values(estimate)[:3], GAIN[:3], rtol=EXACT)
    for joint in estimate.joints[3:]:
        assert isinstance(joint, RefusedGain)
        assert joint.predicted_rel_std is None
        assert "mass alone on this joint cannot be separated" in joint.reason
    every = sequential_gains(*pair, light, TRUSTING)
    np.testing.assert_allclose(values(every), GAIN, rtol=100 * EXACT)  # two solutions in a row
    moments = [each.value for each in every.payload]
    np.testing.assert_allclose(moments, heavy.mass * np.array(heavy.com), rtol=100 * EXACT)


# Problems of several motions


def test_several_motions_and_payloads_give_exact_gains(structure, heavy, rng):
    chi, other = rng.uniform(0.5, 2.0, 84), replace(heavy, mass=2.3, com=(-0.07, 0.11, 0.05))
    mounted = (heavy, None, other, None, heavy)
    problem = exact_problem(structure, [(chi, each, each) for each in mounted], GAIN, rng, rows=120)
    assert problem.payloads == (heavy, other)
    estimate = found("ls-2011", problem)
    np.testing.assert_allclose(values(estimate), GAIN, rtol=EXACT)
    assert list(np.unique(estimate.solution.rows.motion)) == [0, 1, 2, 3, 4]
    with pytest.raises(NotIdentifiable, match="sequential-2011 accepts one payload; 2 are mounted"):
        found("sequential-2011", problem)


def test_these_methods_need_a_bare_and_a_loaded_motion_and_motions_of_one_mounting_share_it(structure, heavy, rng):
    bare, loaded = exact_pair(structure, heavy, GAIN, rng, rows=20)
    without, mounted = (ObservedMotion(bare, None), ObservedMotion(loaded, None)), ObservedMotion(loaded, heavy)
    for method in ("ls-2011", "sequential-2011", "iv"):
        with pytest.raises(NotIdentifiable, match="no motion carries a payload"):
            found(method, Problem(structure, without, TRUSTING))
        with pytest.raises(NotIdentifiable, match="no motion is bare"):
            found(method, Problem(structure, (mounted,), TRUSTING))
    twin = ObservedMotion(loaded, replace(heavy))
    shared = Problem(structure, (without[0], mounted, twin, mounted), TRUSTING).payloads
    assert [id(each) for each in shared] == [id(heavy), id(twin.payload)]


def test_the_sign_by_friction_is_measured_in_its_own_deviations(structure, heavy):
    motions = exact_pair(structure, heavy, GAIN, np.random.default_rng(5), noise=0.02, rows=150)
    options = replace(CLASSICAL, noise_floor=1e-12)
    problem, known = pair(*motions, heavy, options), [heavy.known_part()]
    signs, least = (
        joint_signs(drive_gains(*motions, heavy, replace(options, noise_floor=floor))) for floor in (1e-12, 70.0)
    )
    for j in range(6):
        fit = joint_fit(problem, j, known)
        names = [structure.base.names[c] for c in structure.joint_independent[j]]
        size = np.sqrt(np.mean(fit.system.W**2, axis=0))
        weights = np.zeros((2, len(fit.fit.x)))
        for weight, wanted in zip(weights, ((f"Fv{j + 1}", f"Fc{j + 1}"), (f"Fc{j + 1}",)), strict=True):
            weight[: len(names)] = [size[k] * (name in wanted) for k, name in enumerate(names)]
        friction = weights @ fit.fit.x
        z = friction / np.sqrt(np.diag(weights @ fit.fit.covariance @ weights.T))
        np.testing.assert_allclose(fit.system.friction @ fit.fit.x, friction, rtol=1e-12)
        np.testing.assert_allclose(signs.friction_z[j], z[np.argmax(np.abs(z))], rtol=1e-8)
    std = np.array([each.residual_std / abs(each.value) for each in drive_gains(*motions, heavy, options).joints])
    np.testing.assert_allclose(np.abs(signs.load_z), 1.0 / std, rtol=1e-9)
    # Friction that no real residual would show tells no sign.
    assert (np.sign(least.friction_z) == np.sign(signs.friction_z)).all()
    assert (np.abs(least.friction_z) < 0.1 * np.abs(signs.friction_z)).all()


def test_everything_that_ident_exports_exists():
    assert all(hasattr(ident, name) for name in ident.__all__)
    assert ident.RefusedGain is RefusedGain
    with pytest.raises(AttributeError, match="attribute identity"):
        _ = ident.identity


def test_the_deviation_that_decides_is_of_residuals_payload_and_model_together(structure, heavy, rng):
    problem, known = pair(*exact_pair(structure, heavy, GAIN, rng), heavy, TRUSTING), [heavy.known_part()]
    solution = joint_by_joint(problem, [joint_fit(problem, j, known) for j in range(6)], known)
    plain, more = (
        judge_identifiability("x", problem, replace(solution, payload=np.full((6, 2), a), model=np.full((6, 1), b)))
        for a, b in ((0.0, 0.0), (0.003, 0.005))
    )
    for one, other in zip(plain.joints, more.joints, strict=True):
        grown = np.sqrt(one.predicted_rel_std**2 + 2.0 * 0.003**2 + 0.005**2)
        np.testing.assert_allclose(other.predicted_rel_std, grown, rtol=1e-12)


# By the moments of the payload


@pytest.mark.parametrize("draws", [12, pytest.param(60, marks=pytest.mark.slow)])
def test_deviations_of_gains_and_moments_carry_the_errors_of_the_steps_before(structure, heavy, light, draws):
    # 60 draws of three gains that rest on estimated moments, and of these: their rms z-scores have a standard deviation
    # of 1 / sqrt(2 * 180) = 5.3 %; 19 % is left by chance once in 3000 seeds, not so if step 2's error were dropped.
    # The seeds are fixed; of the first 12 it is 11.8 %.
    z, dropped, of_moments = [], [], []
    for seed in range(draws):
        motions = exact_pair(structure, heavy, GAIN, np.random.default_rng(seed), noise=0.003, rows=120)
        estimate, known = sequential_gains(*motions, light, CLASSICAL), drive_gains(*motions, heavy, CLASSICAL)
        for j in (3, 4, 5):
            error = estimate.joints[j].value - GAIN[j]
            z.append(error / estimate.joints[j].residual_std)
            dropped.append(error / known.joints[j].residual_std)
        assert [parameter.name for parameter in estimate.payload] == ["MX", "MY", "MZ"]
        true = heavy.mass * np.array(heavy.com)
        of_moments += [(each.value - t) / each.std for each, t in zip(estimate.payload, true, strict=True)]
    rms, moments, without = (np.sqrt(np.mean(np.square(each))) for each in (z, of_moments, dropped))
    assert max(abs(rms - 1.0), abs(moments - 1.0)) < 0.19
    assert without > 1.2 * rms
    sure, unsure = (sequential_gains(*motions, replace(light, mass_std=std), CLASSICAL).payload for std in (0.0, 0.07))
    for a, b in zip(sure, unsure, strict=True):
        np.testing.assert_allclose(b.std**2, a.std**2 + (0.07 / heavy.mass * a.value) ** 2, rtol=1e-9)
