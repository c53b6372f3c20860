"""All joints at once on exact rows: which knowledge suffices, what is refused, what does not spoil what."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from exact import EXACT, GAIN, TRUSTING, exact_pair, exact_problem, shared_columns, values
from pinocchio_arms import random_arm
from scipy import stats

from ident.estimation.estimate import GainEstimate, RefusedGain
from ident.estimation.estimators import ESTIMATORS
from ident.estimation.estimators.nls import AllJointsOptions, all_joints_gains, student
from ident.estimation.problem import Columns, GainOptions, Problem, pair
from ident.estimation.setting import friction_z, setting
from ident.model.arm import arm_from_pinocchio
from ident.model.structure import structure_of
from ident.observation.observation import Observation
from ident.payload.payload import Payload
from ident.support.errors import NotIdentifiable, OptionError

# The search ends at steps of 1e-11; one more at that point would be smaller by the square of the noise, which is none.
FOUND = 1e4 * EXACT
COMMON = AllJointsOptions(friction="viscous-coulomb", friction_per_motion=False)
PER_MOTION = AllJointsOptions(friction="viscous-coulomb", friction_per_motion=True)


LIGHT = Payload(mass=3.4, com=(-0.06, 0.09, 0.05), inertia=(0.007, 0.005, 0.004, 0.001, -0.0005, 0.0008))


@pytest.fixture
def plain(structure, heavy, chi, rng) -> Problem:
    return exact_problem(structure, [(chi, None, None), (chi, heavy, heavy)], GAIN, rng)


def drifted(chi: np.ndarray, viscous: float, coulomb: float) -> np.ndarray:
    """The same arm with other friction."""
    other = chi.reshape(-1, 14).copy()
    other[:, 11] *= viscous
    other[:, 12] *= coulomb
    return other.ravel()


def knowing(payload: Payload, what: str) -> Payload:
    """The same payload, of which nothing else is stated than what is known."""
    unknown = {"all": (), "com": ("inertia",), "mass": ("com", "inertia"), "none": ("com", "inertia")}[what]
    return replace(payload, known=what, **dict.fromkeys(unknown))


def gains(problem: Problem, options: AllJointsOptions = COMMON) -> np.ndarray:
    return values(all_joints_gains(problem, options))


@pytest.mark.parametrize(
    ("first", "second"), [("all", "none"), ("com", "mass"), ("mass", "com"), ("mass", "none"), ("all", "all")]
)
def test_two_mountings_give_exact_gains_whatever_is_known_of_each(structure, heavy, chi, rng, first, second):
    one, two = knowing(heavy, first), knowing(LIGHT, second)
    motions = [(chi, LIGHT, two), (chi, None, None), (chi, heavy, one), (chi, None, None), (chi, heavy, one)]
    given = motions[::2] if first == second else motions  # two known payloads need no bare motion
    np.testing.assert_allclose(gains(exact_problem(structure, given, GAIN, rng)), GAIN, rtol=FOUND)


@pytest.mark.parametrize("seed", [0, 2, *(pytest.param(each, marks=pytest.mark.slow) for each in (1, 3))])
def test_gains_of_random_arms_are_exact(seed, heavy):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 8))
    structure = structure_of(arm_from_pinocchio(random_arm(rng, n, prismatic=0.3)))
    gain, chi = rng.uniform(0.5, 2.0, n) * rng.choice([-1.0, 1.0], n), rng.uniform(0.5, 2.0, 14 * n)
    problem = exact_problem(structure, [(chi, None, None), (chi, heavy, heavy)], gain, rng)
    np.testing.assert_allclose(gains(problem), gain, rtol=10 * FOUND)  # random arms are less well conditioned
    alone = ESTIMATORS["ls-2011"].estimate(problem, ESTIMATORS["ls-2011"].options())
    np.testing.assert_allclose(values(alone), gain, rtol=100 * EXACT)


def test_friction_that_differs_between_motions_needs_columns_of_each_motion(structure, heavy, chi, rng):
    motions = [(chi, None, None), (drifted(chi, 1.2, 0.7), heavy, heavy), (drifted(chi, 0.9, 1.4), None, None)]
    problem = exact_problem(structure, motions, GAIN, rng, options=replace(TRUSTING, max_rel_std=100.0))
    np.testing.assert_allclose(gains(problem, PER_MOTION), GAIN, rtol=FOUND)
    assert np.abs(gains(problem, COMMON) / GAIN - 1.0).max() > 1e-3


def test_friction_of_the_solution_is_its_torque_over_the_gain_at_rms_speed(plain, chi):
    solution = all_joints_gains(plain, PER_MOTION).solution
    for j in range(6):
        _, Fv, Fc, _ = chi.reshape(6, 14)[j, 10:]
        speed = 2.0 / np.sqrt(3.0)  # of states even on +-2, known to 1 / sqrt(5 N) = 4 %
        np.testing.assert_allclose(solution.friction[j], np.array([Fv * speed + Fc, Fc]) / GAIN[j], rtol=0.04)


def test_a_joint_that_nothing_loads_is_refused_and_does_not_spoil_the_others(structure, chi, rng):
    # A point mass on the axis of joint 6, and a last link without inertia: joint 6 turns its own rotor only.
    point = Payload(mass=6.1, com=(0.0, 0.0, 0.14), inertia=(0.0,) * 6)
    chi.reshape(6, 14)[5, :10] = 0.0
    for noise, within in ((0.0, FOUND), (1e-4, 2e-3)):  # some 300 rows of 1e-4 against a share of the load of a tenth
        problem = exact_problem(structure, [(chi, None, None), (chi, point, point)], GAIN, rng, noise=noise)
        estimate = all_joints_gains(problem, COMMON)
        np.testing.assert_allclose(values(estimate)[:5], GAIN[:5], rtol=within)
        assert isinstance(estimate.joints[5], RefusedGain)
        assert estimate.joints[5].predicted_rel_std > 0.5  # all that is known of it is the prior, of deviation 1
        assert max(joint.model_rel_std for joint in estimate.joints[:5]) < 1e-3


@pytest.mark.parametrize("prior_std", [1.0, 0.6])
def test_one_payload_in_every_motion_leaves_the_scale_free_and_every_gain_refused(
    structure, heavy, chi, rng, prior_std
):
    # Noise that the cross products resolve; of exact rows they leave a free scale to rounding.
    problem = exact_problem(structure, [(chi, heavy, heavy)] * 2, GAIN, rng, noise=1e-4)
    estimate = all_joints_gains(problem, replace(COMMON, prior_std=prior_std))
    assert not estimate.identifiable.any()
    # Six priors on six logarithms whose differences the links fix: their mean has the deviation of one over sqrt(6).
    granted = np.linalg.norm(estimate.solution.model, axis=1)
    # The links fix the differences to the noise, 1e-4; cross products are known to 1e-8 of noise squared.
    np.testing.assert_allclose(granted, np.full(6, prior_std / np.sqrt(6.0)), rtol=1e-4)


def test_options_that_make_no_sense_are_refused():
    assert AllJointsOptions(friction="load+cbrt+by-direction").friction_terms == ("load", "cbrt", "by-direction")
    unknown = ("cbrt+stribeck", "cbrt+cbrt", "load+load-motor", "load+auto", "")
    together = "gain_joint and gain_value must be given together"
    for said, options in {
        "friction = ": [{"friction": each} for each in unknown],
        "prior_std": [{"prior_std": 0.0}, {"prior_std": 101.0}],
        together: [{"gain_joint": 3}, {"gain_value": 3.0}],
        "gain_value = 0": [{"gain_joint": 2, "gain_value": 0.0}],
        "loss = 'huber': expected one of squares, student": [{"loss": "huber"}],
    }.items():
        for wrong in options:
            with pytest.raises(OptionError, match=said):
                AllJointsOptions(**wrong)


def test_rows_that_come_from_no_recording_have_no_friction_but_viscous_and_dry(plain):
    automatic, told = (all_joints_gains(plain, each) for each in (AllJointsOptions(), PER_MOTION))
    np.testing.assert_array_equal(automatic.solution.inverse, told.solution.inverse)
    assert automatic.remarks == told.remarks == ()
    assert told.method == "nls"


@pytest.mark.parametrize("joint", [2, pytest.param(5, marks=pytest.mark.slow)])
def test_bare_motions_and_one_given_gain_give_the_others_and_nothing_sets_no_scale(structure, heavy, chi, rng, joint):
    for believed in (None, replace(heavy, known="none")):
        problem = exact_problem(structure, [(chi, None, None), (chi, heavy, believed)], GAIN, rng)
        with pytest.raises(NotIdentifiable, match="no motion carries a payload of known mass"):
            all_joints_gains(problem, COMMON)
    bare = exact_problem(structure, [(chi, None, None)] * 2, GAIN, rng, rows=200)
    for k in (1.0, 2.0):  # the search ends at steps of 1e-11 in the logarithms
        given = AllJointsOptions(gain_joint=joint, gain_value=k * float(GAIN[joint - 1]))
        np.testing.assert_allclose(gains(bare, given), k * GAIN, rtol=1e-8)
    with pytest.raises(NotIdentifiable, match="only ratios of gains are identifiable; mount one"):
        all_joints_gains(bare, AllJointsOptions())
    with pytest.raises(OptionError, match="gain_joint = 7: the arm has joints 1 to 6"):
        all_joints_gains(bare, AllJointsOptions(gain_joint=7, gain_value=1.5))


def test_as_many_rows_as_columns_and_one_are_enough(plain):
    columns = len(setting(plain, per_motion=False, prior_std=1.0).blocks.std) + 3 + 2  # own ones, known torque, current

    def found(many: int) -> int:
        """Rows that are used where joint 4 has so many."""
        motions = []
        for each, rows in zip(plain.motions, (many // 3, many - many // 3), strict=True):
            *before, joint = each.observation.joints[:4]
            cut = {name: getattr(joint, name)[:rows] for name in ("V", "W", "W_L", "t", "position", "weight")}
            joints = (*before, replace(joint, **cut), *each.observation.joints[4:])
            motions.append(replace(each, observation=replace(each.observation, joints=joints)))
        return all_joints_gains(replace(plain, motions=tuple(motions)), COMMON).rows

    assert found(columns + 1) == 5 * 300 + columns + 1
    for many, unknowns in ((columns, columns), (0, r"\d+")):
        said = f"joint 4: {many} rows cannot give {unknowns} unknowns; record a longer"
        with pytest.raises(NotIdentifiable, match=said):
            found(many)


def test_a_search_without_end_is_an_error(plain, monkeypatch):
    monkeypatch.setattr("ident.estimation.all_joints.MOST_STEPS", 0)
    with pytest.raises(NotIdentifiable, match="the gains do not converge in 0 steps; record longer"):
        all_joints_gains(plain, COMMON)


def test_the_search_starts_with_gains_of_joints_alone_and_signs_by_friction(structure, heavy, chi, rng):
    # The mass alone shows joints 1 to 3 (eq. 27); of the others friction says the sign, and shared links the size.
    weighed = replace(heavy, known="mass")
    problem = exact_problem(structure, [(chi, None, None), (chi, heavy, weighed)], GAIN, rng, noise=1e-4)
    ready = setting(problem, per_motion=False, prior_std=1.0)
    assert (np.abs(np.log(ready.start * GAIN)) < 0.03).all()  # of the right sign, a hundred times the noise off
    brakes, columns = friction_z(ready), Columns.of(problem.motions)
    for j in range(6):  # the surer of both frictions over its deviation, by the joint's own rows
        own = columns.joint == j
        W = np.column_stack([columns.friction(per_motion=False)[1], shared_columns(ready), ready.k])[own]
        norms = np.linalg.norm(W, axis=0)
        pseudo = np.linalg.pinv(W / np.where(norms > 0.0, norms, 1.0), rcond=1e-9)
        z = pseudo[:2] @ columns.V[own] / (ready.sigma[j] * np.linalg.norm(pseudo[:2], axis=1))
        np.testing.assert_allclose(brakes[j], z[np.argmax(np.abs(z))], rtol=1e-4)


def test_a_joint_on_which_no_other_shows_a_torque_starts_at_the_scale_of_the_others(rng):
    # A joint that turns about the vertical of a lift: a payload of known mass weighs on the lift alone.
    model = pin.Model()
    for j, kind in enumerate((pin.JointModelPZ(), pin.JointModelRZ())):
        index = model.addJoint(j, kind, pin.SE3.Identity(), f"joint{j + 1}")
        model.appendBodyToJoint(index, pin.Inertia.Random(), pin.SE3.Identity())
    structure = structure_of(arm_from_pinocchio(model))
    chi = np.zeros(structure.base.regrouping.shape[1])
    chi.reshape(-1, 14)[:2, [5, 9, 10, 11, 12]] = (0.7, 4.1, 0.6, 2.3, 3.7), (0.4, 2.6, 0.3, 1.9, 2.8)
    known = Payload(mass=5.3, com=None, known="mass")
    motions = [(chi, None, None), (chi, known, known)]
    problem = exact_problem(structure, motions, np.array([3.1, -17.0]), rng, noise=1e-3)
    start = setting(problem, per_motion=False, prior_std=1.0).start
    np.testing.assert_allclose(start, [1.0 / 3.1, -1.0 / 3.1], rtol=0.05)


# Student's loss: what least squares sees of residuals, and what it finds then

LOOSE = GainOptions(noise_floor=1e-12, max_rel_std=10.0, uncertainty="classical")


def found(motions: tuple[Observation, Observation], heavy: Payload, loss: str, options=LOOSE) -> GainEstimate:
    return all_joints_gains(pair(*motions, heavy, options), AllJointsOptions(loss=loss))


def with_currents(motions: tuple[Observation, Observation], change) -> tuple[Observation, Observation]:
    unloaded, loaded = (
        replace(each, joints=tuple(replace(joint, V=change(joint.V)) for joint in each.joints)) for each in motions
    )
    return unloaded, loaded


def test_what_least_squares_sees_is_the_score_of_student_s_distribution():
    e = np.array([0.31, -0.52, 0.17, 2.9, -41.0, 0.08, -0.23])
    s = stats.norm.ppf(0.75) ** -1 * 0.31  # 0.31 is the median of the sizes
    u, step = e / s, 1e-5
    law = stats.t(4.0)
    score = -(law.logpdf(u + step) - law.logpdf(u - step)) / (2.0 * step)
    slope = -(law.logpdf(u + step) - 2.0 * law.logpdf(u) + law.logpdf(u - step)) / step**2
    # Differences of logarithms of size 10 over 1e-10; 1.4826 has five digits.
    np.testing.assert_allclose(student(e, np.ones(7)), s * score / slope.mean(), rtol=1e-4)
    rounded = np.array([3e-17, -2e-17, 1e-16])  # far below 1e-6 of the currents, they stay as they are
    np.testing.assert_allclose(student(rounded, np.full(3, 2.7)), rounded, rtol=1e-12)


def test_gross_outliers_hardly_move_gains_and_are_told(structure, heavy, rng):
    motions = exact_pair(structure, heavy, GAIN, rng, noise=0.003, rows=300)

    def spoilt(V: np.ndarray) -> np.ndarray:
        far = np.arange(len(V)) % 50 == 7  # 2 %, all to one side
        return np.where(far, V + 3.0 * np.sqrt(np.mean(V**2)), V)

    clean = found(motions, heavy, "squares")
    squares, tamed = (found(with_currents(motions, spoilt), heavy, loss) for loss in ("squares", "student"))
    std, told = (np.array([joint.residual_std for joint in each.joints]) / np.abs(GAIN) for each in (clean, tamed))
    off = [np.abs(values(each) / GAIN - 1.0) / std for each in (squares, tamed)]
    assert off[0].max() > 20.0
    assert off[1].max() < 4.0  # of six gains; the loss costs a tenth in deviation
    # Deviations are those of data without outliers, not of the squares of these.
    np.testing.assert_allclose(told / std, 1.1, atol=0.25)
    assert 2.0 <= float(tamed.remarks[-1].split()[0]) < 4.0
