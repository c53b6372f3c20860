"""The model's masses as a witness of the payload's."""

import re
from dataclasses import replace

import numpy as np
import pytest
from exact import TRUSTING, drive_gains, exact_observation
from real_friction import three_axes

from ident.diagnosis.diagnosis import Severity
from ident.diagnosis.gain_checks import FACTOR, SHOWN_SHARE, LinkWeight, judged, link_mass_consistency, link_weights
from ident.estimation.problem import pair
from ident.identification import without_spoilt
from ident.model.structure import structure_of
from ident.support.errors import Contradiction


def links_of_three_axes() -> np.ndarray:
    """Standard parameters (n, 10) of the arm behind the logs, by Pinocchio: m, m c, xx, xy, yy, xz, yz, zz."""
    return np.array([each.toDynamicParameters()[[4, 5, 7, 6, 8, 9, 1, 2, 3, 0]] for each in three_axes().inertias[1:]])


@pytest.mark.parametrize("couplings", [(), ((4, 5),)])
def test_links_drawn_c_times_too_light_are_found_c_times_heavier_whatever_motors_and_friction_are(
    arm, structure, heavy, couplings
):
    coupled = structure_of(replace(arm, couplings=couplings)) if couplings else structure
    rng = np.random.default_rng(19)
    gain = np.array([0.94, -0.96, 1.11, 0.91, 25.0, -0.04])
    chi = rng.uniform(0.5, 2.0, len(coupled.base.labels))
    bare, loaded = (
        exact_observation(coupled, chi, load, gain, rng, noise=0.0, rows=160)
        for load in (np.zeros(10), heavy.known_part().chi)
    )
    problem, estimate = pair(bare, loaded, heavy, TRUSTING), drive_gains(bare, loaded, heavy)
    gains = {j: each.value for j, each in enumerate(estimate.joints)}
    found = link_weights(problem.motions, gains, chi[:84].reshape(6, 14)[:, :10] / 3.7)
    assert [each.joint for each in found] == list(range(6))
    # Exact rows: rounding, amplified by the condition of the gains.
    np.testing.assert_allclose([each.factor for each in found], 3.7, rtol=1e-9)
    np.testing.assert_allclose([each.share for each in found], 1.0, rtol=1e-9)


def test_an_arm_that_weighs_what_its_model_says_is_not_doubted(sound, sound_estimate):
    finding = link_mass_consistency(sound.problem, sound_estimate, links_of_three_axes())
    assert finding.severity is Severity.GOOD
    # Gains are known within 2 %.
    np.testing.assert_allclose(finding.value, 1.0, atol=0.05)


@pytest.mark.parametrize("drawn", [1 / 9.7, 1.9])
def test_gains_that_make_the_arm_another_weight_than_the_models_are_doubted(sound, sound_estimate, drawn):
    finding = link_mass_consistency(sound.problem, sound_estimate, drawn * links_of_three_axes())
    assert finding.severity is Severity.WEAK
    said = re.match(r"with these gains the arm's masses are (\S+) times those of its model", finding.sentence)
    # Gains are known within 2 %.
    np.testing.assert_allclose(float(said[1]), 1.0 / drawn, rtol=0.05)
    np.testing.assert_allclose(finding.value, 1.0 / drawn, rtol=0.05)


@pytest.mark.parametrize("drawn", [1 / 29.0, 29.0])
def test_links_of_other_materials_are_doubted_and_no_gain_is_refused_for_them(sound, sound_estimate, drawn):
    assert link_mass_consistency(sound.problem, sound_estimate, drawn * links_of_three_axes()).severity is Severity.WEAK


@pytest.mark.parametrize("drawn", [1 / 37.0, 37.0])
def test_masses_in_different_units_refuse_every_gain(sound, sound_estimate, drawn):
    finding = link_mass_consistency(sound.problem, sound_estimate, drawn * links_of_three_axes())
    assert finding.severity is Severity.WRONG
    mass = sound.problem.motions[1].payload.mass
    with pytest.raises(Contradiction, match=f"^payload mass {mass:g} kg: .* times those of its model .*mass in kg"):
        without_spoilt(sound_estimate, [finding])


def test_a_model_whose_masses_are_all_alike_is_no_witness(sound, sound_estimate):
    links = links_of_three_axes()
    links[:, 9] = 1.0
    assert link_mass_consistency(sound.problem, sound_estimate, links) is None


def test_without_a_bare_motion_there_is_no_witness(sound, sound_estimate):
    loaded = replace(sound.problem, motions=sound.problem.motions[1:])
    assert link_mass_consistency(loaded, sound_estimate, links_of_three_axes()) is None


def weights(*factors: float, share: float = 0.9) -> list[LinkWeight]:
    return [LinkWeight(joint=joint, factor=factor, share=share) for joint, factor in enumerate(factors)]


def test_more_than_half_of_the_joints_have_to_be_beyond_the_factor_one_way():
    assert judged(weights(1.2, 4.9)).severity is Severity.GOOD
    assert judged(weights(1.6, 4.9)).severity is Severity.WEAK
    assert judged(weights(1.1, 1.2, 4.8, 4.9)).severity is Severity.GOOD
    assert judged(weights(1.1, 4.7, 4.8, 4.9)).severity is Severity.WEAK
    assert judged(weights(0.1, 1.2)).severity is Severity.GOOD
    assert judged(weights(0.1, 0.2, 1.2)).severity is Severity.WEAK
    assert judged(weights(0.1, 4.9, 1.2)).severity is Severity.GOOD


def test_the_joints_that_show_it_are_named_and_advice_is_given_where_it_is_in_doubt():
    found = judged([*weights(1.6, 4.8), *weights(8.0, share=0.1)])
    assert found.joints == (0, 1)
    assert "payload's mass" in found.advice
    assert judged(weights(1.1, 1.2)).advice is None


def test_the_weight_that_is_told_is_the_median():
    assert "masses are 3.2 times those of its model (median of joints 1 and 2," in judged(weights(1.6, 4.8)).sentence


def test_the_limit_itself_is_no_doubt():
    assert judged(weights(FACTOR, FACTOR, FACTOR)).severity is Severity.GOOD
    assert judged(weights(FACTOR + 0.01, FACTOR + 0.01, FACTOR + 0.01)).severity is Severity.WEAK


def test_joints_that_links_of_other_proportions_explain_badly_say_nothing():
    assert judged(weights(8.0, 8.0, share=SHOWN_SHARE - 0.01)) is None
    assert judged(weights(8.0, 8.0, share=SHOWN_SHARE)).severity is Severity.WEAK
    assert judged([*weights(8.0), *weights(8.0, share=0.1)]) is None


def test_torques_against_the_models_have_another_cause_than_weight():
    assert judged(weights(-2.0, -1.3, 1.1)) is None
