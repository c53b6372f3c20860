from dataclasses import replace

import numpy as np
import pytest
from exact import EXACT, GAIN, TRUSTING, drive_gains, exact_observation, exact_pair, lopsided, values

import ident
from ident.estimation.estimate import IdentifiedGain, joint_signs
from ident.estimation.estimators.ls_2011 import JointByJointOptions, joint_by_joint_gains
from ident.estimation.estimators.sequential_2011 import SequentialOptions, sequential_gains
from ident.estimation.joint_by_joint import gain_system, joint_fit
from ident.estimation.problem import ObservedMotion, Problem, pair
from ident.support.errors import NotIdentifiable


@pytest.fixture
def payloads(payload):
    heavy = lopsided(payload)
    return heavy, replace(heavy, mass=2.3, com=(-0.07, 0.11, 0.05))


def test_several_motions_and_payloads_give_exact_gains(structure, payloads, rng):
    chi = rng.uniform(0.5, 2.0, 84)
    mounted = (payloads[0], None, payloads[1], None, payloads[0])
    motions = [
        ObservedMotion(
            exact_observation(
                structure, chi, np.zeros(10) if p is None else p.known_part().chi, GAIN, rng, noise=0.0, rows=120
            ),
            p,
        )
        for p in mounted
    ]
    problem = Problem(structure, tuple(motions), TRUSTING)
    assert problem.payloads == payloads
    estimate = joint_by_joint_gains(problem, JointByJointOptions())
    np.testing.assert_allclose(values(estimate), GAIN, rtol=EXACT)
    assert list(np.unique(estimate.solution.rows.motion)) == [0, 1, 2, 3, 4]
    # Each payload has unknown parameters of its own: the masses alone still give the joints that they load.
    light = [replace(motion, payload=motion.payload and replace(motion.payload, known="mass")) for motion in motions]
    by_mass = joint_by_joint_gains(Problem(structure, tuple(light), TRUSTING), JointByJointOptions())
    np.testing.assert_allclose(values(by_mass)[:3], GAIN[:3], rtol=EXACT)
    assert not by_mass.identifiable[3:].any()
    with pytest.raises(NotIdentifiable, match="sequential-2011 accepts one payload; 2 are mounted"):
        sequential_gains(problem, SequentialOptions())


@pytest.mark.parametrize(
    "gains",
    [lambda p: joint_by_joint_gains(p, JointByJointOptions()), lambda p: sequential_gains(p, SequentialOptions())],
)
def test_the_methods_of_2011_need_a_bare_and_a_loaded_motion(structure, payloads, rng, gains):
    bare, loaded = exact_pair(structure, payloads[0], GAIN, rng, rows=20)
    with pytest.raises(NotIdentifiable, match="no motion carries a payload"):
        gains(Problem(structure, (ObservedMotion(bare, None), ObservedMotion(loaded, None)), TRUSTING))
    with pytest.raises(NotIdentifiable, match="no motion is bare"):
        gains(Problem(structure, (ObservedMotion(loaded, payloads[0]),), TRUSTING))


def test_motions_of_one_mounting_share_what_is_unknown_of_it(structure, payloads, rng):
    bare, loaded = exact_pair(structure, payloads[0], GAIN, rng, rows=20)
    twin = replace(payloads[0])
    motions = [ObservedMotion(bare, None), *(ObservedMotion(loaded, each) for each in (payloads[0], twin, payloads[0]))]
    found = Problem(structure, tuple(motions), TRUSTING).payloads
    assert [id(each) for each in found] == [id(payloads[0]), id(twin)]


def test_the_load_on_a_joint_is_the_rms_of_the_known_torque_on_loaded_rows(structure, payloads, rng):
    problem = pair(*exact_pair(structure, payloads[0], GAIN, rng, rows=150), payloads[0], TRUSTING)
    system = gain_system(problem, 3, [payloads[0].known_part()])
    torque = problem.motions[1].observation.joints[3].W_L @ payloads[0].known_part().chi
    np.testing.assert_allclose(system.load_rms, np.sqrt(np.mean(torque**2)), rtol=1e-12)


def test_the_sign_by_friction_is_measured_in_its_own_deviations(structure, payloads):
    motions = exact_pair(structure, payloads[0], GAIN, np.random.default_rng(5), noise=0.02, rows=150)
    options = replace(TRUSTING, uncertainty="classical", max_rel_std=10.0)
    problem, known = pair(*motions, payloads[0], options), [payloads[0].known_part()]
    signs = joint_signs(drive_gains(*motions, payloads[0], options))
    for j in range(6):
        fit = joint_fit(problem, j, known)
        names = [structure.base.names[c] for c in structure.joint_independent[j]]
        z, friction = [], []
        for wanted in ((f"Fv{j + 1}", f"Fc{j + 1}"), (f"Fc{j + 1}",)):
            weight = np.zeros(len(fit.fit.x))
            for k, name in enumerate(names):
                weight[k] = np.sqrt(np.mean(fit.system.W[:, k] ** 2)) if name in wanted else 0.0
            friction.append(weight @ fit.fit.x)
            z.append(friction[-1] / np.sqrt(weight @ fit.fit.covariance @ weight))
        np.testing.assert_allclose(fit.system.friction @ fit.fit.x, friction, rtol=1e-12)
        np.testing.assert_allclose(signs.friction_z[j], z[int(np.argmax(np.abs(z)))], rtol=1e-8)


def test_friction_that_no_real_residual_would_show_tells_no_sign(structure, payloads):
    motions = exact_pair(structure, payloads[0], GAIN, np.random.default_rng(5), noise=0.02, rows=150)
    options = replace(TRUSTING, max_rel_std=10.0)
    sure, least = (
        joint_signs(drive_gains(*motions, payloads[0], replace(options, noise_floor=floor))).friction_z
        for floor in (1e-12, 70.0)
    )
    assert (np.sign(least) == np.sign(sure)).all()
    assert (np.abs(least) < 0.1 * np.abs(sure)).all()


def test_everything_that_ident_exports_exists():
    for name in ident.__all__:
        assert getattr(ident, name).__name__ in (name, "dict") if hasattr(getattr(ident, name), "__name__") else True
    assert ident.IdentifiedGain is IdentifiedGain
    with pytest.raises(AttributeError, match="attribute identity"):
        _ = ident.identity
