"""Fits of a joint alone: the sign of its friction, and the predicted accuracy of its gain."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from consistency_logs import joint_by_joint
from known_logs import BRICK
from real_friction import GAIN

from ident.diagnosis.diagnosis import Severity
from ident.diagnosis.plausibility import excitation, friction_sign, friction_z, opposed, predicted_rel_std
from ident.estimation.estimate import FRICTION_Z, largest
from ident.estimation.problem import Columns, GainOptions, Problem

NAMES = ("XX3", "Fc3", "off3", "Fv3")


def rows_of(W: np.ndarray, V: np.ndarray) -> Columns:
    r = len(V)
    return Columns(
        joint=np.full(r, 2), names=NAMES, W=W, W_L=np.zeros((0, r, 10)), V=V, t=np.zeros(r), weight=np.ones(r),
        motion=np.zeros(r, dtype=int), position=np.arange(r), loaded=np.zeros(r, dtype=bool),
    )  # fmt: skip


GAINS = GainOptions()
PROBLEM = SimpleNamespace(options=GAINS)


@pytest.mark.parametrize(("dry", "viscous", "total"), [(0.9, 0.19, True), (-0.7, 0.21, False), (-0.5, -0.5, True)])
def test_friction_is_as_sure_as_its_dry_part_or_all_of_it(monkeypatch, rng, dry, viscous, total):
    W = rng.normal(size=(80, 4)) * [3.0, 0.9, 1.0, 40.0]
    W[:, 3] += 30.0 * W[:, 1]  # speed, and its sign
    V = W @ [0.2, dry, -0.3, viscous / 40.0] + 0.3 * np.where(np.arange(80) % 2, 1.0, -1.0) * rng.uniform(0.5, 1.5, 80)
    monkeypatch.setattr("ident.diagnosis.plausibility.joint_rows", lambda problem, joint: rows_of(W, V))
    # The larger deviation: that of white residuals (eq. 20), or of fits without each of twenty blocks of four rows.
    found, (square,) = np.linalg.lstsq(W, V)[:2]
    covariance = square / (80 - 4) * np.linalg.inv(W.T @ W)
    size = np.linalg.norm(W, axis=0)
    parts = [np.array([0.0, size[1], 0.0, size[3]]), np.array([0.0, size[1], 0.0, 0.0])]
    kept = [np.arange(80) // 4 != block for block in range(20)]
    fits = np.array([np.linalg.lstsq(W[rows], V[rows])[0] for rows in kept])
    apart = 19.0 / 20.0 * np.sum(((fits - fits.mean(axis=0)) @ np.transpose(parts)) ** 2, axis=0)
    white = [part @ covariance @ part for part in parts]
    z = [float(part @ found / np.sqrt(max(pair))) for part, *pair in zip(parts, white, apart, strict=True)]
    assert (abs(z[0]) > 1.05 * abs(z[1])) == total
    np.testing.assert_allclose(friction_z(PROBLEM, 2), z, rtol=1e-9)  # condition below 100
    np.testing.assert_array_equal(largest(np.array(z)), z[0] if total else z[1])


def test_as_many_rows_as_unknowns_say_nothing_of_friction(monkeypatch, rng):
    W, V = rng.normal(size=(5, 4)), rng.normal(size=5)
    for r, told in ((5, True), (4, False)):
        monkeypatch.setattr(
            "ident.diagnosis.plausibility.joint_rows", lambda problem, joint, r=r: rows_of(W[:r], V[:r])
        )
        assert friction_z(PROBLEM, 2).any() == told


def test_friction_drives_a_joint_that_it_surely_drives_in_one_log_and_brakes_in_none(monkeypatch):
    told = [(-1.1, -3.0), (-1.1, 0.9), (-1.1, 1.1), (0.0, -1.1), (0.0, 0.0), (-0.9, -0.8), (1.1, 2.0)]  # surely by log

    def z(problem, joint):
        return FRICTION_Z * np.array([0.0, told[joint][problem.log]])

    def backward(about):
        return [each.joints[0] for each in friction_sign(problems, about) if each.advice is not None]

    monkeypatch.setattr("ident.diagnosis.plausibility.friction_z", z)
    problems = [SimpleNamespace(log=k, structure=SimpleNamespace(arm=SimpleNamespace(n=7))) for k in (0, 1)]
    assert backward(None) == [0, 1, 3]
    about = np.array([2.0, -3.0, 2.0, -4.0, 2.0, 2.0, -5.0])  # friction of a drive that is wired backwards is negative
    assert backward(about) == [0, 6]


def test_friction_that_brakes_in_one_log_and_drives_in_another_names_the_log_of_the_rarer_sign(monkeypatch):
    told = [  # in deviations that are sure, by log
        (1.2, -1.3, 3.0), (-1.2, 1.1, -1.4), (1.2, -0.9, 2.0), (0.0, 1.2, -1.1), (-2.0, -1.1, 0.0),
        (-1.4, 0.3, 1.3),  # one of each: the later log
    ]  # fmt: skip

    def z(problem, joint):
        return FRICTION_Z * np.array([told[joint][problem.motions[0]], 0.0])

    monkeypatch.setattr("ident.diagnosis.plausibility.friction_z", z)
    arm = SimpleNamespace(arm=SimpleNamespace(n=6, joint_names=tuple("abcdef")))
    assert opposed(Problem(arm, (0, 1, 2), GainOptions()), range(6)) == [(0, 1), (1, 1), (3, 2), (5, 2)]
    assert opposed(Problem(arm, (0, 1, 2), GainOptions()), (1, 3)) == [(1, 1), (3, 2)]
    assert opposed(Problem(arm, (1,), GainOptions()), range(6)) == []


def test_the_deviation_that_is_predicted_is_that_of_the_loaded_motion(sound):
    """The same motion, recorded with the payload, gives deviations of the same size by the estimator itself."""
    bare = sound.problem.motions[0].observation
    predicted = predicted_rel_std(bare, BRICK, np.abs(GAIN), GAINS)
    expected = [joint.predicted_rel_std for joint in joint_by_joint(sound.problem).joints]
    # The loaded motion is another, of larger currents, and 5 % of them is the floor.
    np.testing.assert_allclose(predicted, expected, rtol=0.5)
    assert predicted_rel_std(bare, BRICK, GAIN, GAINS) == predicted  # one is wired backwards


def test_joints_whose_gain_would_not_be_good_enough_are_listed():
    options = replace(GAINS, max_rel_std=0.07)
    found, good = (excitation("bare", each, options) for each in ((0.0123, None, 0.071, 0.069, 0.5), (0.0123, 0.069)))
    assert (found.severity, found.logs, found.joints) == (Severity.WEAK, ("bare",), (1, 2, 4))
    assert found.sentence.endswith("joint by joint: 1.2, -, 7.1, 6.9, 50 %")
    assert (good.severity, good.advice, good.joints) == (Severity.GOOD, None, ())
