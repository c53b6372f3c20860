"""Checks of gains: implausible values, autocorrelated residuals, encoder noise, link masses."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from consistency_logs import LOOSE, all_joints, changed, identified, joint_by_joint, logs_of, problem_of
from estimates import gain_estimate
from exact import GAIN as EXACT_GAIN
from exact import exact_problem
from known_logs import BRICK, mounted, torque, with_payload
from pinocchio_arms import standard_parameters_of
from real_friction import GAIN, Truth, three_axes

from ident.diagnosis import gain_checks
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Effect, Severity, larger
from ident.diagnosis.gain_checks import (
    FACTOR,
    FAR,
    SHOWN_SHARE,
    SURE_LOAD_Z,
    LinkWeight,
    autocorrelation,
    gain_diagnoses,
    judged,
    lagged,
    link_mass_consistency,
    link_weights,
    noise_in_currents,
    noise_in_load,
    symptoms,
)
from ident.diagnosis.plausibility import LARGE_RESIDUAL
from ident.estimation.estimate import FRICTION_Z, GainEstimate
from ident.estimation.intervals import Basis, Rows, classical
from ident.estimation.problem import ObservedMotion, Problem
from ident.identification import identify, without_spoilt
from ident.model.regressor import inverse_dynamics
from ident.model.structure import structure_of
from ident.observation.observation import ObserveOptions, observe
from ident.payload.payload import standard_parameters
from ident.preparation import SIMULATED
from ident.recordings.recording import Recording
from ident.support.errors import Contradiction


def estimate(*gains: float | None) -> GainEstimate:
    return gain_estimate(*gains, std=0.01, reason="no load")


def implausible(name: str, *gains: float | None) -> list[Diagnosis]:
    return [each for each in gain_diagnoses(estimate(*gains)) if each.name == name]


def test_a_negative_gain_is_a_doubt_and_no_error():
    (found,) = implausible("negative gain", 13.2, None, None, -7.1)
    assert (found.severity, found.joints, found.value, found.unit) == (Severity.WEAK, (3,), -7.1, "N m/unit")
    assert found.sentence.startswith("joint 4: the gain is negative; v4 and q4 have opposite signs")


def test_a_gain_far_from_the_median_of_the_others_is_named_with_the_ratio():
    def far_off(*gains: float | None) -> list[tuple[int, ...]]:
        return [each.joints for each in implausible("gain outlier", *gains)]

    (found,) = implausible("gain outlier", 13.2, 9.7 / FAR / 1.4, -9.7)
    np.testing.assert_allclose(found.value, 9.7 / FAR / 1.4 / 11.45, rtol=1e-12)  # the median of 13.2 and 9.7
    assert (found.joints, far_off(13.2, 11.45 * FAR * 1.01, -9.7)) == ((1,), [(1,)])
    assert far_off(13.2, 11.45 * FAR * 0.99, -9.7) == far_off(13.2, 11.4 / FAR * 1.2) == far_off(None, 5e-6) == []
    assert far_off(1.0, 1.0, 1.0, 0.99 * FAR, 0.99 * FAR) == []  # not of their mean
    assert far_off(1.0, 1.0, 1.0, 0.9 * FAR, 1.01 * FAR) == [(4,)]


def test_signs_by_load_and_by_friction_contradict_where_both_are_sure(monkeypatch):
    load, friction = np.array([[1.1, -1.1, -1.1, 0.9, 1.1], [-1.1, 1.1, -1.1, -1.1, -0.9]])
    signs = SimpleNamespace(load_z=SURE_LOAD_Z * load, friction_z=FRICTION_Z * friction)
    monkeypatch.setattr("ident.diagnosis.gain_checks.joint_signs", lambda _: signs)
    found = implausible("sign of the gain", None, 3.0, -2.0, 2.0, 4.0, 2.5)
    assert [(each.severity, each.joints) for each in found] == [(Severity.WRONG, (1,)), (Severity.WRONG, (2,))]


def test_a_joint_whose_current_is_badly_explained_is_named():
    given = estimate(3.0, 2.0)
    rows = given.solution.rows

    own = rows.joint == 1
    size = float(np.sqrt(np.mean(rows.V[own] ** 2)))

    def badly(share: float, signs: tuple[int, ...] = (1,), noisy: int = 0) -> list[tuple[tuple[int, ...], object]]:
        known = Diagnosis(
            name="encoder noise",
            severity=Severity.WEAK,
            sentence="",
            effects=(Effect(joint=noisy, percent=3.0, deviations=2.0),),
        )
        left = replace(rows, residual=np.where(own, share * size * np.resize(signs, len(own)), 0.01))
        off = replace(given, solution=replace(given.solution, rows=left))
        found = symptoms(off, Diagnosed(diagnoses=(known,)))
        return [(each.joints, each.value) for each in found.diagnoses if each.name == "residual"]

    share = 1.01 * LARGE_RESIDUAL
    assert badly(0.99 * LARGE_RESIDUAL) == []
    assert badly(share) == [((1,), pytest.approx(100.0 * share, rel=1e-9))]
    assert badly(share, noisy=1) == []
    assert badly(0.7, signs=(2, 1, -1)) == []  # as noise, a row is unlike the second one after it


@pytest.fixture(scope="module")
def lasting(axes) -> Problem:
    """Logs in which a drift of more than a second moves the current of joint 2."""
    rng = np.random.default_rng(6)

    def drifting(log: Recording) -> Recording:
        noise = np.convolve(rng.normal(size=len(log.t) + 160), np.ones(160) / 160.0**0.5, "valid")[: len(log.t)]
        return changed(log, v=log.v + np.outer(0.04 * np.std(log.v[:, 1]) * noise, [0.0, 1.0, 0.0]))

    return problem_of(axes, [drifting(log) for log in logs_of(Truth())])


def test_residuals_that_last_are_told_with_the_ratio_of_deviations_whatever_is_asked_for(lasting, sound_estimate):
    estimate, white = all_joints(lasting), autocorrelation(sound_estimate)
    assert (white.severity, white.advice) == (Severity.GOOD, None)
    assert autocorrelation(replace(estimate, joints=())) is None
    white = np.diag(classical(estimate.solution.rows, estimate.solution.influence))
    ratio = np.sqrt(estimate.covariance[1, 1] / white[1])  # of 1/g, as the influence is
    unaware = all_joints(replace(lasting, options=replace(LOOSE, uncertainty="classical")))
    for found, verb in ((autocorrelation(estimate), "is"), (autocorrelation(unaware), "would be")):
        severity = Severity.GOOD if verb == "is" else Severity.WEAK
        assert (found.severity, found.joints) == (severity, (1,))
        np.testing.assert_allclose(found.value, ratio, rtol=1e-6)  # the default is the cautious one
        assert f"accounts for it {verb} {larger(ratio)} that of white residuals" in found.sentence


def test_the_correlation_of_neighbours_is_that_of_rows_that_follow_each_other():
    left = np.array([1.0, 2.0, -3.0, 5.0, 7.0, -2.0])
    rows = Rows(
        V=left, residual=left, joint=np.array([0, 0, 0, 0, 0, 1]), motion=np.array([0, 0, 0, 1, 1, 1]),
        position=np.array([4, 5, 7, 8, 9, 10]), unknowns={0: 1, 1: 0}, weight=np.ones(6),
        explained=Basis.of(np.zeros((6, 0))),
    )  # fmt: skip
    # Pairs (1, 2) and (5, 7); -3 follows after a gap, 5 begins a motion, at whatever number.
    np.testing.assert_allclose(lagged(rows, 0, 1), 37.0 / np.sqrt(26.0 * 53.0), rtol=1e-12)
    assert lagged(rows, 0, 2) == -1.0  # of 2 and -3 alone


pytestmark = pytest.mark.usefixtures("_computed_once")

SLOW = ObserveOptions(cutoff_hz=4.0, decimation_cutoff_hz=4.0, rows_per_second=8.0)


def test_a_gain_that_encoder_noise_biases_is_refused_until_the_filter_removes_the_noise(axes):
    logs = logs_of(Truth(), encoder=2e-3)
    biased = identified(axes, logs)
    (said,) = [each for each in biased.diagnoses if each.name == "encoder noise"]
    assert said.severity is Severity.WRONG
    assert "--cutoff-hz" in said.advice
    assert said.cause in biased.reasons[0]
    assert biased.reasons[1:] == (None, None)  # the payload's weight determines them
    assert np.all(np.abs(biased.gain - GAIN)[1:] < 4.0 * biased.std[1:])  # more would be called wrong
    slower = identified(axes, logs, observing=SLOW)
    assert not any(each.name == "encoder noise" for each in slower.diagnoses)
    assert np.all(np.abs(slower.gain - GAIN) < 3.0 * slower.std)
    assert not slower.gain.mask.any()

    other = identify(axes, mounted(*logs, BRICK), method="iv", gains=LOOSE, policy=SIMULATED)
    moved = biased.gain / other.gain - 1.0
    doubted = np.flatnonzero(np.abs(moved) > 2.0 * np.hypot(biased.std / biased.gain, other.std / other.gain))
    assert {0, *doubted[doubted > 0]} == {each.joint for each in said.effects}
    for each in said.effects[1:]:  # that of joint 1 is refused
        np.testing.assert_allclose(each.percent, 100.0 * moved[each.joint], rtol=1e-9)


@pytest.mark.parametrize(
    ("moved", "share", "doubted"),
    [(0.11, 0.4, "wrong"), (-0.11, 0.4, "wrong"), (0.05, 1.7, "weak"), (0.01, 1.7, "weak"), (0.06, 0.4, "")],
)
def test_a_gain_is_doubted_where_an_unbiased_one_differs_or_noise_exceeds_its_load(monkeypatch, moved, share, doubted):
    def gains(first: float) -> SimpleNamespace:  # two deviations of the difference of two are 8.5 %
        own = {"residual_std": 0.18, "payload_std": 0.0, "model_std": 0.0}
        return SimpleNamespace(
            identified={j: SimpleNamespace(value=6.0 * x, **own) for j, x in enumerate((first, 1.0))}
        )

    recorded = SimpleNamespace(recording=None, cutoff_hz=12.5)
    motion = SimpleNamespace(observation=SimpleNamespace(full_rate=recorded, recorded=recorded))
    problem = SimpleNamespace(structure=SimpleNamespace(arm=SimpleNamespace(n=2)), motions=(motion,))
    monkeypatch.setattr(gain_checks, "position_quanta", lambda _: (None, 0.0015))
    monkeypatch.setattr(gain_checks, "quiet_cutoff", lambda _, observing: 0.43 * observing.cutoff_hz)
    monkeypatch.setattr(gain_checks, "noise_in_load", lambda _: np.array([share, 0.2]))
    monkeypatch.setattr(gain_checks, "instrumental_gains", lambda _: gains(1.0))
    said = [*gain_checks.encoder_noise(problem, gains(1.0 + moved))]
    assert [(one.severity.value, len(one.effects), one.effects[0].joint) for one in said] == (
        [(doubted, 1, 0)] if doubted else []
    )
    for one in said:
        found = (one.effects[0].percent, one.effects[0].deviations)
        np.testing.assert_allclose(found, (100.0 * moved, moved * (1.0 + moved) / 0.03), rtol=1e-9)
        assert one.cause == "the positions have steps of 0.0015 rad or m (q2), too coarse for a low-pass at 12.5 Hz"
        assert "--cutoff-hz 5.4," in one.advice


def test_fine_encoders_need_no_other_estimate(axes, monkeypatch):
    monkeypatch.delattr("ident.diagnosis.gain_checks.instrumental_gains")
    found = identified(axes, logs_of(Truth(), encoder=1e-6))
    assert not any(each.name == "encoder noise" for each in found.diagnoses)


@pytest.mark.parametrize("encoder", [1e-4, 1e-3])
def test_the_share_of_noise_in_a_load_is_that_of_logs_without_it(axes, encoder):
    noisy, quiet = (observe(logs_of(Truth(), encoder=each)[1], axes, ObserveOptions()) for each in (encoder, 0.0))
    q, still = quiet.recorded.q, np.zeros_like(quiet.recorded.q)
    chi = np.zeros(axes.base.regrouping.shape[1])
    chi[axes.payload_columns] = standard_parameters(BRICK.mass, BRICK.com, BRICK.inertia)
    added = noisy.recorded.ddq - quiet.recorded.ddq
    moment = inverse_dynamics(axes.arm, chi, q, still, added) - inverse_dynamics(axes.arm, chi, q, still, still)
    load = [np.var(each.W_L @ chi[axes.payload_columns]) for each in noisy.joints]
    # Noise density, and mean square over about 600 independent values and some 50 poses: 15 %.
    np.testing.assert_allclose(noise_in_load(ObservedMotion(noisy, BRICK)), np.mean(moment**2, axis=0) / load, rtol=0.3)


def test_the_noise_in_currents_is_that_of_the_accelerations_through_arm_and_payload(axes):
    logs, quiet = (logs_of(Truth(), encoder=each) for each in (1e-4, 0.0))
    added = list[np.ndarray]()
    for model, *pair in zip((three_axes(), with_payload(three_axes(), BRICK)), logs, quiet, strict=True):
        noisy, still = (observe(each, axes, ObserveOptions()).recorded for each in pair)
        zero, step = np.zeros_like(still.q), noisy.ddq - still.ddq
        added.append(np.var((torque(model, still.q, zero, step) - torque(model, still.q, zero, zero)) / GAIN, axis=0))
    problem = problem_of(axes, logs)
    found = [noise_in_currents(problem, joint) for joint in range(3)]
    np.testing.assert_allclose(found, np.max(added, axis=0), rtol=0.3)  # as above


def test_only_what_is_known_of_a_payload_is_a_load(axes):
    motion = observe(logs_of(Truth(), encoder=1e-3)[1], axes, ObserveOptions())
    every, mass = (noise_in_load(ObservedMotion(motion, replace(BRICK, known=each))) for each in ("all", "mass"))
    assert (np.abs(mass / every - 1.0) > 0.02).any()
    np.testing.assert_array_equal(noise_in_load(ObservedMotion(motion, None)), np.zeros(3))


@pytest.mark.parametrize("couplings", [(), ((4, 5),)])
def test_links_drawn_c_times_too_light_are_found_c_times_heavier_whatever_motors_and_friction_are(
    arm, structure, heavy, rng, couplings
):
    coupled = structure_of(replace(arm, couplings=couplings)) if couplings else structure
    chi = rng.uniform(0.5, 2.0, len(coupled.base.labels))
    problem = exact_problem(coupled, [(chi, None, None), (chi, heavy, heavy)], EXACT_GAIN, rng, rows=160)
    gains = {j: each.value for j, each in enumerate(joint_by_joint(problem).joints)}
    found = link_weights(problem.motions, gains, chi[:84].reshape(6, 14)[:, :10] / 3.7)
    assert [each.joint for each in found] == list(range(6))
    # Exact rows: rounding, amplified by the condition of the gains.
    np.testing.assert_allclose([each.factor for each in found], 3.7, rtol=1e-9)
    np.testing.assert_allclose([each.share for each in found], 1.0, rtol=1e-9)


def test_gains_that_make_the_arm_another_weight_than_the_models_are_doubted_and_other_units_refused(
    sound, sound_estimate
):
    links = standard_parameters_of(three_axes())
    wrong = {1.0: Severity.GOOD, 1 / 37.0: Severity.WRONG, 37.0: Severity.WRONG}  # of other materials none is refused
    for drawn in (1.0, 1 / 29.0, 1.9, 29.0, 1 / 37.0, 37.0):
        found = link_mass_consistency(sound.problem, sound_estimate, drawn * links)
        assert found.severity is wrong.get(drawn, Severity.WEAK)
        np.testing.assert_allclose(found.value, 1.0 / drawn, rtol=0.05)  # gains are known within 2 %
    said = f"^payload mass {BRICK.mass:g} kg: .* times those of its model .*mass in kg"
    with pytest.raises(Contradiction, match=said):
        without_spoilt(sound_estimate, [found])
    # Without a bare motion, or with masses that are all alike, there is no witness.
    loaded = replace(sound.problem, motions=sound.problem.motions[1:])
    assert link_mass_consistency(loaded, sound_estimate, links) is None
    links[:, 9] = 1.0
    assert link_mass_consistency(sound.problem, sound_estimate, links) is None


def weights(*factors: float, share: float = 0.9) -> list[LinkWeight]:
    return [LinkWeight(joint=joint, factor=factor, share=share) for joint, factor in enumerate(factors)]


def test_weights_of_links_are_doubted_from_the_factor_of_most_joints_and_named_with_its_median():
    good = [weights(1.2, 4.9), weights(1.1, 1.2, 4.8, 4.9), weights(0.1, 1.2), weights(0.1, 4.9, 1.2)]
    weak = [weights(1.6, 4.9), weights(1.1, 4.7, 4.8, 4.9), weights(0.1, 0.2, 1.2), weights(*3 * [FACTOR + 0.01])]
    weak.append(weights(8.0, 8.0, share=SHOWN_SHARE))  # links of other proportions explain torques badly
    none = [weights(8.0, 8.0, share=SHOWN_SHARE - 0.01), [*weights(8.0), *weights(8.0, share=0.1)]]
    none.append(weights(-2.0, -1.3, 1.1))  # torques against the model's have another cause
    for grade, cases in ((Severity.GOOD, [*good, weights(*3 * [FACTOR])]), (Severity.WEAK, weak), (None, none)):
        assert {(found := judged(each)) and found.severity for each in cases} == {grade}
    found = judged([*weights(1.6, 4.8), *weights(8.0, share=0.1)])
    assert found.joints == (0, 1)
    assert "masses are 3.2 times those of its model (median of joints 1 and 2," in found.sentence
    assert judged(weights(1.1, 1.2)).advice is None
    assert judged(weights(0.9, 1.7, 4.8)).value == 1.7


@pytest.mark.parametrize(
    ("ratio", "words"),
    [
        (1.0488, "4.9 % larger than"),
        (1.37, "37 % larger than"),
        (2.34, "2.3 times as large as"),
        (41.3, "41 times as large as"),
    ],
)
def test_a_ratio_near_one_is_told_as_a_difference(ratio, words):
    assert larger(ratio) == words
