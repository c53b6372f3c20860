"""The free model of each joint, and what small faults change of the currents, beside logs that are read so."""

from dataclasses import replace
from functools import reduce
from itertools import product

import numpy as np
import pytest
from consistency_logs import doubted, logs_of, problem_of
from known_logs import BRICK, fourier
from real_friction import MIDDLE, RATE, Truth

from ident.diagnosis.models import Reference, free_columns, reference, reference_fit
from ident.estimation.intervals import BLOCKS
from ident.estimation.problem import joint_rows
from ident.model.parameters import STANDARD
from ident.observation.observation import Observation, ObserveOptions, observe
from ident.recordings.recording import Recording


def share_left(columns: np.ndarray, x: np.ndarray) -> float:
    """Share of a signal that columns leave."""
    unit = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    return float(np.linalg.norm(x - unit @ np.linalg.lstsq(unit, x)[0]) / np.linalg.norm(x))


@pytest.mark.parametrize("joint", [0, 1, 2])
def test_the_columns_span_what_a_log_of_its_own_friction_and_any_payload_may_hold(sound, joint):
    rows = joint_rows(sound.problem, joint)
    W = free_columns(sound.problem, rows)
    loaded = rows.motion == 1
    rng = np.random.default_rng(4)
    friction = rows.W[:, [rows.names.index(f"{name}{joint + 1}") for name in ("Fv", "Fc", "off")]]
    arm = rows.W @ rng.normal(size=rows.W.shape[1])
    payload, drifting = rows.W_L[0] @ rng.normal(size=10), friction @ [0.3, -2.0, 0.7] * loaded
    for known in (arm, payload, drifting, np.abs(friction[:, 0])):
        assert share_left(W, known) < 1e-6  # rounding, of a condition of 1e4
    # of the last link, a payload is as good as the link itself
    for unknown in [np.linspace(0.0, 1.0, len(rows.V)) * rows.V, *([arm * loaded] if joint < 2 else [])]:
        assert share_left(W, unknown) > 1e-3


def test_nothing_that_is_stated_of_a_payload_enters(axes, sound, fit):
    wrong = replace(BRICK, mass=40.0, com=(0.3, -0.3, 0.3), known="mass")
    other = doubted(axes, sound.recordings, (None, wrong))
    np.testing.assert_array_equal(other.fits.score.squares, sound.fits.score.squares)
    np.testing.assert_array_equal(reference(other.problem).theta, fit.theta)


def test_logs_of_one_mounting_share_its_payload_and_others_have_their_own(axes):
    twin = replace(BRICK)
    logs = logs_of(Truth(), payloads=(None, BRICK, BRICK))
    problems = (problem_of(axes, logs, (None, BRICK, other)) for other in (BRICK, twin))
    shared, own = (free_columns(problem, joint_rows(problem, 1)).shape[1] for problem in problems)
    loaded = problem_of(axes, logs[1:], (BRICK, twin))  # one of two is as good as the last link
    assert own - shared == 10
    assert shared - free_columns(loaded, joint_rows(loaded, 1)).shape[1] == 3  # friction of a third log


def test_a_log_with_a_payload_may_come_before_the_bare_one(axes, sound, fit):
    turned = doubted(axes, sound.recordings[::-1], (BRICK, None))
    squares = np.roll(turned.fits.score.squares, BLOCKS, axis=1)
    np.testing.assert_allclose(squares, sound.fits.score.squares, rtol=1e-4)  # but for the weak prior of each column
    other = reference_fit(turned.problem)
    np.testing.assert_allclose(other.cost, reference_fit(sound.problem).cost, rtol=1e-6)
    payloads = [each.payload and each.payload.known for each in other.ready.problem.motions]
    assert payloads == [None, "none"]


def test_friction_in_proportion_to_the_motors_torque_is_no_fault_of_a_log(axes):
    model = doubted(axes, logs_of(Truth(load_motor=(0.08, 0.12, 0.1))))
    for j, rows in enumerate(model.rows):  # white noise of 1 % of each current; without the column 2.5 % on joint 2
        assert model.fits.sigma[j] < 0.008 * np.sqrt(np.mean(rows.V**2))


def test_a_column_that_the_model_has_besides_is_explained(sound):
    rng = np.random.default_rng(8)
    extra = [rng.normal(size=(len(rows.V), 2)) for rows in sound.rows]
    model = replace(sound, terms=(extra[0], None, extra[2]))
    for j, given in enumerate(extra):
        left = np.linalg.norm(model.fits.parts[j].without(given)) / np.linalg.norm(given)
        assert (left < 1e-3) == (j != 1)


def test_a_joint_with_fewer_rows_than_unknowns_has_no_fit(sound):
    names, motions = ("V", "W", "W_L", "weight", "t", "position"), []
    for each in sound.problem.motions:
        one, two, three = each.observation.joints
        short = replace(two, **{name: getattr(two, name)[:12] for name in names})
        motions.append(replace(each, observation=replace(each.observation, joints=(one, short, three))))
    model = replace(sound, problem=replace(sound.problem, motions=tuple(motions)))
    assert [each is None for each in model.fits.parts] == [False, True, False]
    assert not model.fits.score.rows[1].any()


def test_every_log_has_its_blocks_and_rows_are_counted_with_those_left_out(sound):
    seen = [motion.observation.joints for motion in sound.problem.motions]
    counts = [1 + max(int(each.position[-1]) for each in joints) for joints in seen]
    assert sound.fits.score.rows.shape == (3, 2 * BLOCKS)
    for j, (log, joints) in product(range(3), enumerate(seen)):
        expected = np.bincount(joints[j].position * BLOCKS // counts[log], minlength=BLOCKS)
        np.testing.assert_array_equal(sound.fits.score.rows[j, BLOCKS * log : BLOCKS * (log + 1)], expected)


@pytest.fixture(scope="module")
def fit(sound) -> Reference:
    return reference(sound.problem)


def test_the_rate_of_currents_is_that_of_a_motion_a_little_later(axes):
    def log(later: float) -> Recording:
        motion = fourier(np.random.default_rng(31), MIDDLE)
        t = np.arange(0.0, motion.period, 1.0 / RATE)
        return Recording(t, motion(t + later)[0], base[0].v, "bare")

    def currents(seen: Observation) -> list[np.ndarray]:  # of the fitted arm, through the estimator's own regressor
        each = zip(fit.h, seen.joints, strict=True)
        return [h * joint.W @ (seen.structure.base.regrouping[joint.columns] @ chi) for h, joint in each]

    base, size = logs_of(Truth(), seed=9), 1e-3  # of differences: second-order terms cancel, rounding is 1e-13 of it
    fit = reference(doubted(axes, [log(0.0), base[1]]).problem)
    chi = fit.torques[0].chi.copy()
    viscous = np.array([fit.friction[j]["Fv", 0] for j in range(3)])
    chi[np.arange(3) * len(STANDARD) + STANDARD.index("Fv")] = viscous / fit.h
    at = [observe(log(s * size), axes, ObserveOptions()) for s in (1.0, -1.0, 0.0)]
    joint, motion = fit.rows.joint, fit.rows.motion
    rates = [each[motion[joint == j] == 0, 0] for j, each in enumerate(fit.change(fit.rate))]
    own = [*map(currents, at[:2]), rates]
    for j in range(3):
        seen = [each.joints[j] for each in at]
        clear = [each.position[(np.abs(each.weight - 1.0) < 1e-6) & (each.position > 0)] for each in seen]
        kept = reduce(np.intersect1d, clear)  # of no reversal, whose samples differ; the first filter begins at rest
        assert len(kept) > 100
        later, earlier, rate = (x[j][np.isin(each.position, kept)] for each, x in zip(seen, own, strict=True))
        slope = (later - earlier) / (2.0 * size)
        # Torques are evaluated at a lower rate and interpolated, and a rate has more of high frequencies.
        np.testing.assert_allclose(rate, slope, rtol=0, atol=0.036 * np.sqrt(np.mean(slope**2)))
