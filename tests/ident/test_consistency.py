"""What an estimate says against itself: identities of parts of the rows, faults that are found, and silence."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from known_logs import BRICK, arm_of
from real_friction import GAIN, Truth, real_logs, three_axes

from ident.all_joints.friction import Term
from ident.all_joints.solution import fit_with, setting
from ident.all_joints.stiffness import (
    LEAST_ROTOR,
    RESONANCE_HZ,
    ROTOR_SHARE,
    STATES,
    assumed_compliance,
    joint_inertia,
)
from ident.all_joints.terms import torque_terms
from ident.consistency import CHECKS, UNCHECKED, findings
from ident.consistency.bare import bare_drifts, check_bare
from ident.consistency.curves import check_position, check_speed, residual_curve
from ident.consistency.difference import FALSE_ALARM, FREEDOM, most_deviations
from ident.consistency.elasticity import check_elasticity
from ident.consistency.evidence import Evidence
from ident.consistency.finding import joints_in_words
from ident.consistency.halves import check_halves
from ident.consistency.hidden import Hidden, hidden_effect
from ident.consistency.joints import check_joints
from ident.consistency.part import linear_fit, part_of
from ident.consistency.single_load import USUAL, check_single_load, load_currents
from ident.consistency.soft_currents import soft_currents
from ident.consistency.whiteness import check_whiteness, neighbours
from ident.estimate import GainSolution
from ident.estimators import ESTIMATORS
from ident.estimators.nls import AllJointsOptions, all_joints_gains
from ident.identification import Recorded, identify_motions
from ident.observation import ObserveOptions, observe
from ident.options import GainOptions
from ident.payload import Payload
from ident.problem import Motion, Problem
from ident.recording import Recording
from ident.rows import Rows
from ident.structure import Structure, structure_of
from ident.wiring import known_wiring

PAYLOADS = (None, BRICK)
LOOSE = GainOptions(max_rel_std=10.0)
PLAIN = AllJointsOptions(friction="viscous-coulomb")


@pytest.fixture(scope="module")
def axes() -> Structure:
    return structure_of(arm_of(three_axes()))


def problem_of(axes: Structure, logs: list[Recording], payloads: tuple[Payload | None, ...] = PAYLOADS) -> Problem:
    motions = (Motion(observe(log, axes, ObserveOptions()), each) for log, each in zip(logs, payloads, strict=True))
    return Problem(axes, tuple(motions), LOOSE)


def logs_of(truth: Truth, seed: int = 5, payloads: tuple[Payload | None, ...] = PAYLOADS) -> list[Recording]:
    return real_logs(truth, payloads, np.random.default_rng(seed))


def evidence_of(problem: Problem, options: AllJointsOptions = PLAIN) -> Evidence:
    return Evidence(problem=problem, estimate=all_joints_gains(problem, options), drift=True)


def joint_by_joint(problem: Problem) -> Evidence:
    chosen = ESTIMATORS["ls-2011"]
    return Evidence(problem=problem, estimate=chosen.estimate(problem, chosen.options()), drift=False)


def with_current(log: Recording, joint: int, change) -> Recording:
    """The log with another current of a joint, given time from 0 to 1, position and speed."""
    v, time = log.v.copy(), (log.t - log.t[0]) / (log.t[-1] - log.t[0])
    speed = np.convolve(np.gradient(log.q[:, joint], log.t), np.ones(9) / 9.0, "same")
    v[:, joint] = change(v[:, joint], time, log.q[:, joint], speed)
    return Recording(log.t, log.q, v, log.name)


@pytest.fixture(scope="module")
def clean(axes) -> Evidence:
    return evidence_of(problem_of(axes, logs_of(Truth())))


@pytest.fixture(scope="module")
def chosen(axes) -> Evidence:
    return evidence_of(problem_of(axes, logs_of(Truth())), AllJointsOptions())


# Parts of the rows


def linear_solution(rng: np.random.Generator):
    """Two joints of 2 motions with 30 rows each, 7 unknowns, beliefs about all; currents, and fits of some rows."""
    r, u = 120, 7
    W, belief, of = rng.normal(size=(r, u)), 2.3 * rng.normal(size=(u, u)), rng.normal(size=(2, u))
    weight = np.repeat([0.7, 3.1], r // 2)
    y, expected = rng.normal(size=r), rng.normal(size=u)
    stacked = np.vstack((weight[:, None] * W, belief))
    pseudo = np.linalg.pinv(stacked)
    z = pseudo @ np.concatenate((weight * y, expected))
    solution = GainSolution(
        rows=Rows(
            V=y,
            residual=y - W @ z,
            joint=np.repeat([0, 1], r // 2),
            motion=np.tile(np.repeat([0, 1], r // 4), 2),
            position=np.tile(np.arange(r // 4), 4) + 3,
            row_period=0.05,
            unknowns={0: 3.0, 1: 4.0},
            weight=weight,
            explained=np.linalg.qr(stacked)[0][:r],
        ),
        joints=np.array([0, 1]),
        inverse=of @ z,
        influence=(of @ pseudo[:, :r]) * weight,
        payload=np.zeros((2, 0)),
        model=np.zeros((2, 0)),
        load_rms=np.ones(2),
        friction=np.zeros((2, 2)),
        friction_influence=np.zeros((2, 2, r)),
        unsolved={},
    )

    def refit(kept: np.ndarray, currents: np.ndarray = y) -> np.ndarray:
        some = np.vstack(((weight[:, None] * W)[kept], belief))
        return of @ np.linalg.lstsq(some, np.concatenate(((weight * currents)[kept], expected)), rcond=None)[0]

    def left_of(kept: np.ndarray) -> np.ndarray:
        some = np.vstack(((weight[:, None] * W)[kept], belief))
        return y - W @ np.linalg.lstsq(some, np.concatenate(((weight * y)[kept], expected)), rcond=None)[0]

    return solution, y, left_of, refit


KEPT = {
    "first half": np.array([True, False, True, False]),
    "second half": np.array([False, True, False, True]),
    "joint 1": np.array([True, True, False, False]),
    "joint 2": np.array([False, False, True, True]),
}


@pytest.mark.parametrize("kept", KEPT.values(), ids=KEPT)
def test_a_part_of_the_rows_gives_what_a_fit_of_them_and_the_beliefs_gives(kept):
    solution, y, left_of, refit = linear_solution(np.random.default_rng(3))
    rows, fit = solution.rows, linear_fit(solution)
    group = 2 * rows.joint + (rows.position >= 18)  # of positions 3 to 32
    changes = part_of(fit, kept, [0, 1]).changes
    # Linear algebra in another order; the condition of the parts is below 1e2.
    np.testing.assert_allclose([changes[k].value for k in (0, 1)], refit(kept[group]) - solution.inverse, rtol=1e-9)
    nudge = np.random.default_rng(4).normal(size=len(y))
    moved = refit(kept[group], y + nudge) - refit(kept[group]) - solution.influence @ nudge
    np.testing.assert_allclose([changes[k].influence @ nudge for k in (0, 1)], moved, rtol=1e-9)
    own = kept[group]
    left = part_of(fit, kept, [0]).residual
    assert not left[~own].any()
    np.testing.assert_allclose(left[own], left_of(own)[own], rtol=1e-9, atol=1e-12)


def test_a_part_that_does_not_show_a_quantity_gives_none():
    solution, *_ = linear_solution(np.random.default_rng(3))
    rows = solution.rows
    # Without beliefs, two rows of joint 1 cannot show 1/g, which hangs on seven unknowns.
    Q = np.linalg.qr(np.random.default_rng(8).normal(size=(len(rows.V), 7)))[0]
    alone = replace(
        solution,
        rows=replace(rows, explained=Q, weight=np.ones(len(rows.V))),
        influence=np.random.default_rng(9).normal(size=(2, 7)) @ Q.T,
    )
    fit = linear_fit(replace(alone, rows=replace(alone.rows, joint=np.array([0, 0] + [1] * 118))))
    assert part_of(fit, np.array([True, True, False, False]), [0, 1]).changes == {}
    assert set(part_of(fit, np.array([False, False, True, True]), [1]).changes) == {1}


def test_an_estimate_that_is_no_least_squares_is_left_alone(axes, clean):
    solution, *_ = linear_solution(np.random.default_rng(3))
    crooked = solution.influence + 1e-3 * np.random.default_rng(5).normal(size=solution.influence.shape)
    assert linear_fit(replace(solution, influence=crooked)) is None
    estimate = replace(
        clean.estimate, solution=replace(clean.estimate.solution, influence=clean.estimate.solution.influence**3)
    )
    other = Evidence(problem=clean.problem, estimate=estimate, drift=True)
    assert check_halves(other) is None
    assert check_joints(other) is None


def half_of(problem: Problem, which: int) -> Problem:
    """The problem of one half of every motion."""
    motions = []
    for motion in problem.motions:
        joints = []
        positions = [joint.position for joint in motion.observation.joints]
        for joint, at in zip(motion.observation.joints, positions, strict=True):
            low, high = min(p.min() for p in positions), max(p.max() for p in positions)
            kept = (2 * at > low + high) == bool(which)
            fields = ("V", "V_rate", "W", "W_L", "t", "position")
            joints.append(replace(joint, **{name: getattr(joint, name)[kept] for name in fields}))
        motions.append(Motion(replace(motion.observation, joints=tuple(joints)), motion.payload))
    return replace(problem, motions=tuple(motions))


def test_halves_are_what_a_search_on_each_half_gives(clean):
    halves = [all_joints_gains(half_of(clean.problem, which), PLAIN).solution.inverse for which in (0, 1)]
    finding = check_halves(clean)
    k = finding.joint
    fit, second = clean.fit, np.arange(6) % 2 == 1
    first_order = [part_of(fit, kept, [0, 1, 2]).changes for kept in (~second, second)]
    std = np.sqrt(np.diag(clean.estimate.covariance))
    for j in range(3):
        apart = first_order[1][j].value - first_order[0][j].value
        # A search weighs rows by the residual of the half alone, and the model is not linear.
        np.testing.assert_allclose(apart, halves[1][j] - halves[0][j], atol=0.3 * std[j])
    apart = first_order[1][k].value - first_order[0][k].value
    plain = first_order[1][k].influence - first_order[0][k].influence
    sigma = np.array([clean.estimate.solution.rows.sigma(j) for j in clean.estimate.solution.rows.joint])
    white = np.sqrt(np.sum((plain * sigma) ** 2))
    # The halves' own fits leave a little less than that of all rows; what lasts may make the deviation larger.
    assert 0.4 * abs(apart) / white < finding.statistic < 1.1 * abs(apart) / white


# Silence


@pytest.mark.parametrize("check", CHECKS.values(), ids=CHECKS)
def test_clean_recordings_give_no_word(check, chosen):
    finding = check(chosen)
    assert finding is None or not finding.failed, finding


def test_tests_that_are_not_asked_for_are_not_made(clean):
    assert findings(clean, UNCHECKED) == ()
    made = [each.check for each in findings(clean)]
    assert made == [name for name in CHECKS if name != "bare"]  # there is but one bare motion


def test_a_method_that_solves_each_joint_alone_has_no_joints_to_compare(axes, clean):
    assert check_joints(joint_by_joint(clean.problem)) is None


# Faults


@pytest.mark.parametrize(("factor", "word"), [(1.03, "smaller"), (0.97, "larger")])
def test_a_current_that_grows_in_the_second_half_of_the_motions_is_a_smaller_gain_there(axes, factor, word):
    logs = [with_current(log, 1, lambda v, t, q, dq: np.where(t > 0.5, factor * v, v)) for log in logs_of(Truth())]
    finding = check_halves(evidence_of(problem_of(axes, logs)))
    assert finding.failed
    assert finding.joint == 1
    assert finding.statistic > finding.threshold
    change = float(finding.sentence.split("a gain ")[1].split(" %")[0])
    assert f"% {word} than the first" in finding.sentence
    np.testing.assert_allclose(change, 3.0, atol=1.0)  # other joints' halves pull at the gain


def test_a_joint_whose_payload_torque_is_wrong_says_something_else_than_all_joints(axes):
    wrong = replace(BRICK, com=(0.07, -0.05, 0.03), com_std=(0.001,) * 3)
    finding = check_joints(evidence_of(problem_of(axes, logs_of(Truth()), (None, wrong))))
    assert finding.failed
    assert "its own currents alone give a gain" in finding.sentence
    known = replace(wrong, com_std=(0.1,) * 3)  # stated to be that uncertain, it is no contradiction
    assert not check_joints(evidence_of(problem_of(axes, logs_of(Truth()), (None, known)))).failed


def test_friction_that_changes_between_bare_motions_is_named_with_its_size(axes):
    before, after = Truth(), replace(Truth(), Fc=(11.0, 9.0, 5.0), off=(1.0, -2.0, 1.3))
    payloads = (None, BRICK, None)
    logs = [*logs_of(before), *real_logs(after, (None,), np.random.default_rng(9))]
    problem = problem_of(axes, logs, payloads)
    finding = check_bare(evidence_of(problem))
    assert finding.failed
    said = {(each.joint, each.what): each for j in range(3) for each in bare_drifts(problem, j, [0, 2], drift=True)}
    coulomb, offset = said[1, "Coulomb friction changed"], said[2, "the offset changed"]
    assert coulomb.z < -finding.threshold  # of a drive wired backwards the currents are turned
    assert offset.z > finding.threshold
    rms = [
        np.sqrt(np.mean(np.concatenate([problem.motions[m].observation.joints[j].V for m in (0, 2)]) ** 2))
        for j in (1, 2)
    ]
    # Five deviations; sign(dq) is cleared of reversals and its rms in a row a little below 1.
    np.testing.assert_allclose(coulomb.share, 1.0 / GAIN[1] / rms[0], rtol=0.05 + 5.0 / abs(coulomb.z))
    np.testing.assert_allclose(offset.share, 0.6 / GAIN[2] / rms[1], rtol=0.05 + 5.0 / abs(offset.z))
    assert coulomb.harmless
    assert not offset.harmless
    assert "joint 2: Coulomb friction" in finding.sentence
    assert "in motion 3" in finding.sentence
    assert finding.sentence.endswith("warm the drives up before recording")
    unchanged = problem_of(axes, [*logs_of(before), *real_logs(before, (None,), np.random.default_rng(9))], payloads)
    assert not check_bare(evidence_of(unchanged)).failed


def test_a_bare_motion_with_more_left_of_it_is_named(axes):
    logs = [*logs_of(Truth()), *real_logs(Truth(), (None,), np.random.default_rng(9), noise=0.02)]
    finding = check_bare(evidence_of(problem_of(axes, logs, (None, BRICK, None))))
    assert finding.failed
    assert "what the model leaves changed by +" in finding.sentence


def test_a_current_that_follows_the_position_is_found_on_its_joint(axes):
    logs = [
        with_current(log, 2, lambda v, t, q, dq: v + 0.03 * np.std(v) * np.sin(5.0 * q)) for log in logs_of(Truth())
    ]
    evidence = evidence_of(problem_of(axes, logs))
    finding = check_position(evidence)
    assert finding.failed
    assert finding.joint == 2
    assert "depends on the joint's own position: joint 3" in finding.sentence


def test_friction_of_another_shape_is_found_on_its_joint(axes):
    def stribeck(v, t, q, dq):
        return v + 0.15 * np.std(v) * np.sign(dq) * np.exp(-((dq / (0.3 * np.std(dq))) ** 2))

    finding = check_speed(evidence_of(problem_of(axes, [with_current(log, 2, stribeck) for log in logs_of(Truth())])))
    assert finding.failed
    assert finding.joint == 2
    assert "depends on the joint's own speed: joint 3" in finding.sentence


def test_a_curve_moves_the_gain_by_what_a_fit_with_its_columns_gives(clean):
    def columns(q, dq):
        return np.column_stack((np.sin(2.0 * q), np.cos(3.0 * q)))

    curve, joint = residual_curve(clean, 1, columns), 1
    ready = setting(clean.problem, per_motion=True, prior_std=1.0)
    rows = clean.estimate.solution.rows
    own = rows.of(joint)
    added = columns(*clean.states(joint))
    terms = [{} for _ in range(3)]
    terms[joint] = {"first": Term(added[:, 0]), "second": Term(added[:, 1])}
    fitted = fit_with(ready, terms, (), fit_with(ready, [{} for _ in range(3)], (), None)).fit
    moved = clean.estimate.solution.inverse[joint] / fitted.found.h[joint] - 1.0
    # First order, and weights from another residual.
    np.testing.assert_allclose(curve.moved, moved, rtol=0.1, atol=1e-5)
    left = [np.sum((rows.weight * each)[own] ** 2) for each in (rows.residual, fitted.rows.residual)]
    np.testing.assert_allclose(curve.share, 1.0 - left[1] / left[0], rtol=0.15, atol=1e-3)


def test_residuals_that_last_are_told_where_they_matter(axes):
    rng = np.random.default_rng(6)

    def lasting(v, t, q, dq):
        noise = np.convolve(rng.normal(size=len(v) + 160), np.ones(160) / 160.0**0.5, "valid")[: len(v)]
        return v + 0.04 * np.std(v) * noise

    logs = [with_current(log, 1, lasting) for log in logs_of(Truth())]
    evidence = evidence_of(problem_of(axes, logs))
    finding = check_whiteness(evidence)
    assert finding.failed
    assert finding.joint == 1
    assert "allows for them" in finding.sentence
    plain = replace(evidence.problem, options=replace(LOOSE, uncertainty="classical"))
    unaware = check_whiteness(evidence_of(plain))
    assert unaware.failed
    assert "larger than the one claimed" in unaware.sentence


def test_the_correlation_of_neighbours_is_that_of_rows_that_follow_each_other():
    left = np.array([1.0, 2.0, -3.0, 5.0, 7.0, -2.0])
    rows = Rows(
        V=left, residual=left, joint=np.array([0, 0, 0, 0, 0, 1]), motion=np.array([0, 0, 0, 1, 1, 1]),
        position=np.array([4, 5, 7, 0, 1, 2]), row_period=0.05, unknowns={0: 1, 1: 0}, weight=np.ones(6),
        explained=np.zeros((6, 0)),
    )  # fmt: skip
    # Pairs (1, 2) and (5, 7); -3 follows after a gap, 5 begins a motion.
    np.testing.assert_allclose(neighbours(rows, 0), 37.0 / np.sqrt(26.0 * 53.0), rtol=1e-12)


# What no residual shows

SOFT = Truth(compliance=(2e-4, 1.5e-4, 2e-4))


def test_stiff_joints_are_seen_to_be_stiff(clean, chosen):
    for evidence in (clean, chosen):
        effect = hidden_effect(evidence, soft_currents(evidence))
        assert abs(effect.seen) < 4.0 * effect.std
        assert effect.possible < 0.5
        assert not effect.suspected


def test_what_elastic_joints_would_do_is_what_they_do(axes):
    problem = problem_of(axes, logs_of(SOFT))
    evidence = evidence_of(problem)
    ready = setting(problem, per_motion=True, prior_std=1.0)
    plain = fit_with(ready, [{} for _ in range(3)], (), None)
    softened = torque_terms(problem, ready.shared, plain.own, plain.fit, compliance=True).softened
    added = np.concatenate([h * each @ SOFT.compliance for h, each in zip(plain.fit.found.h, softened, strict=True)])
    effect = hidden_effect(evidence, added)
    found = np.array(list(effect.moved.values()))
    stiff = evidence_of(problem_of(axes, logs_of(Truth())))
    bias = stiff.estimate.solution.inverse / evidence.estimate.solution.inverse - 1.0
    # The effect is first order, and torques are those of a fit that it bends.
    np.testing.assert_allclose(found, bias, rtol=0.35, atol=2e-3)
    np.testing.assert_allclose(effect.seen, 1.0, atol=0.2)
    finding = check_elasticity(evidence)
    assert finding.failed
    assert f"at {RESONANCE_HZ:.0f} Hz (assumed)" in finding.sentence
    assert "let the joints yield" in finding.sentence


def test_joints_that_yield_in_the_model_are_not_suspected(axes):
    finding = check_elasticity(evidence_of(problem_of(axes, logs_of(SOFT)), AllJointsOptions()))
    assert not finding.failed


@pytest.mark.parametrize(
    ("seen", "std", "possible", "suspected"),
    [
        (0.1, 0.05, 0.2, False),
        (0.3, 0.05, 0.4, True),
        (-0.2, 0.6, 1.0, True),
        (0.0, np.inf, 1.0, True),
        (-3.0, 1.0, 0.0, False),
    ],
)
def test_an_effect_is_possible_up_to_two_deviations_above_what_is_seen(seen, std, possible, suspected):
    effect = Hidden(seen=seen, std=std, moved={})
    np.testing.assert_allclose(effect.possible, possible, rtol=1e-12)
    assert effect.suspected is suspected


def test_an_effect_that_the_fit_explains_is_never_seen_and_moves_nothing(clean):
    rows = clean.estimate.solution.rows
    effect = hidden_effect(clean, rows.explained[:, 5] / rows.weight)
    assert effect.std == np.inf or effect.possible == 1.0


def test_the_assumed_compliance_makes_a_rotor_swing_at_the_assumed_frequency(axes, clean):
    ready = setting(clean.problem, per_motion=True, prior_std=1.0)
    fit = fit_with(ready, [{} for _ in range(3)], (), None).fit
    whole = joint_inertia(clean.problem, ready.shared, fit.found.theta)
    model, behind = three_axes(), clean.problem.motions[0].observation.full_rate
    data, places = model.createData(), np.linspace(0, len(behind.q) - 1, STATES).astype(int)
    known = np.mean([np.diag(pin.crba(model, data, behind.q[k])) for k in places], axis=0)
    np.testing.assert_allclose(whole, known, rtol=0.03)  # identified from noisy rows
    swings = 1.0 / (
        assumed_compliance(clean.problem, ready.shared, fit.found.theta) * (2.0 * np.pi * RESONANCE_HZ) ** 2
    )
    share = swings / whole
    assert ((np.isclose(share, ROTOR_SHARE)) | (share >= LEAST_ROTOR * (1.0 - 1e-9))).all()
    assert (share <= 1.0).all()


def test_gains_that_one_weight_does_not_tell_from_load_friction_are_named(axes):
    evidence = joint_by_joint(problem_of(axes, logs_of(Truth(load_motor=(0.06, 0.09, 0.05)))))
    finding = check_single_load(evidence)
    assert finding.failed
    assert "a second, different weight tells them apart" in finding.sentence
    heavy = replace(BRICK, mass=7.9)
    both = problem_of(axes, logs_of(Truth(), payloads=(None, BRICK, heavy)), (None, BRICK, heavy))
    assert check_single_load(joint_by_joint(both)) is None


@pytest.mark.parametrize("joint", [1, 2])
def test_what_load_friction_would_do_is_what_it_does(axes, joint):
    losses = tuple(USUAL * (j == joint) for j in range(3))
    free, lossy = (joint_by_joint(problem_of(axes, logs_of(Truth(load_motor=each)))) for each in ((0.0,) * 3, losses))
    moved = hidden_effect(free, load_currents(free, joint)).moved
    bias = free.estimate.solution.inverse / lossy.estimate.solution.inverse - 1.0
    # First order; rows whose filter holds a reversal have another mean of |V|, a tenth of the loss at most.
    np.testing.assert_allclose(moved[joint], bias[joint], rtol=0.2, atol=4e-3)
    others = [moved[j] for j in range(3) if j != joint]
    np.testing.assert_allclose(others, 0.0, atol=1e-15)  # each joint has rows of its own


def test_the_slope_of_a_gain_by_its_load_friction_is_that_of_fits_with_two_coefficients(axes):
    problem = problem_of(axes, logs_of(Truth(load_motor=(0.06, 0.09, 0.05))))
    estimate = all_joints_gains(problem, AllJointsOptions(friction="load-motor"))
    ready = setting(problem, per_motion=True, prior_std=1.0)
    plain = fit_with(ready, [{} for _ in range(3)], (), None)
    terms = torque_terms(problem, ready.shared, plain.own, plain.fit, compliance=False).own
    free = fit_with(ready, [{"load-motor": Term(each["load-motor"])} for each in terms], (), plain)
    at = [own.names.index("load-motor") for own in free.own]
    coefficient = [phi[k] for phi, k in zip(free.fit.phi, at, strict=True)]

    def log_gain(joint: int, change: float) -> np.ndarray:
        held = [
            {"load-motor": Term(each["load-motor"], c + change, 1e-7) if j == joint else Term(each["load-motor"])}
            for j, (each, c) in enumerate(zip(terms, coefficient, strict=True))
        ]
        return -np.log(np.abs(fit_with(ready, held, (), free).fit.found.h))

    slope = [float((log_gain(j, 0.01) - log_gain(j, -0.01))[j]) / 0.02 for j in range(3)]
    # The columns follow from torques of another pass, and weights from another residual.
    # Joint 1 has a vertical axis: the load does not show its coefficient.
    np.testing.assert_allclose(estimate.solution.load_friction.slope[1:], slope[1:], rtol=0.1, atol=0.05)


# What is told


def test_limits_are_those_of_students_t_for_so_many_tests():
    from scipy import stats

    np.testing.assert_allclose(2 * 7 * stats.t.sf(most_deviations(7), FREEDOM), FALSE_ALARM, rtol=1e-9)


def test_joints_are_listed_in_words():
    assert joints_in_words([3]) == "joint 4"
    assert joints_in_words([0, 4]) == "joints 1 and 5"
    assert joints_in_words([0, 2, 4]) == "joints 1, 3 and 5"


def test_failed_tests_are_among_the_notes_of_an_identification(axes):
    logs = [with_current(log, 1, lambda v, t, q, dq: np.where(t > 0.5, 1.03 * v, v)) for log in logs_of(Truth())]
    motions = [Recorded(log, payload) for log, payload in zip(logs, PAYLOADS, strict=True)]
    given = {"options": PLAIN, "gains": LOOSE, "wiring": known_wiring}
    found = identify_motions(motions, axes, **given)
    failed = [each for each in found.findings if each.failed]
    assert any(each.check == "halves" for each in failed)
    assert all(each.sentence in found.notes for each in failed)
    quiet = identify_motions(motions, axes, **given, checks=UNCHECKED)
    assert quiet.findings == ()
    assert not any("second half" in note for note in quiet.notes)
