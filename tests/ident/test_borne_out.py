"""A reading that is a little better is believed only where the log as it is does as badly as it then ought to."""

from dataclasses import replace

import numpy as np
import pytest
from ident.borne_out import CLEAR, borne_out
from ident.checks import comparison
from ident.checks.arm_remarks import named_readings
from ident.evidence import convincing, evidence_of, gain_over
from ident.explanation import explanations, unknowns_of
from ident.instants import instants
from ident.readings import Reading, as_it_is
from ident.wiring import MANY, check_wiring
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, arm_of, known_logs, ur_like

from ident import borne_out as module
from ident.arm import Arm
from ident.observation import ObserveOptions
from ident.recording import Recording
from ident.structure import structure_of

OPTIONS = ObserveOptions()
COARSE = 1e-3
"""Deviation of an encoder [rad] that leaves little of the accelerations."""


def _coarse(log: Recording, std: float, rng: np.random.Generator) -> Recording:
    return replace(log, q=log.q + std * rng.standard_normal(log.q.shape))


def test_the_deviation_is_that_of_what_the_other_columns_leave_along_what_the_own_ones_miss():
    own, other = np.eye(4)[:, :1], np.eye(4)[:, :1] + np.eye(4)[:, 1:2]
    v = np.array([3.0, 5.0, 7.0, 2.0])  # the other column leaves (-1, 1, 7, 2); the own one misses (0, 4, 0, 0) of it
    found = module._deviation(7.0 * own, 0.3 * other, v)
    assert found == pytest.approx(4.0 / (4.0 * np.sqrt(55.0 / 3.0)), rel=1e-12)


def _longer(arm: Arm) -> Reading:
    return replace(as_it_is(arm), words="every length times 1.25", stretch=np.full(arm.n, 1.25))


def _shorter(arm: Arm) -> Reading:
    return replace(as_it_is(arm), words="every length times 0.8", stretch=np.full(arm.n, 0.8))


def test_lengths_that_are_wrong_are_borne_out_where_they_matter_little():
    arm = arm_of(ur_like())
    logs = known_logs(ur_like(), BRICK, UR_GAIN, np.random.default_rng(21), middle=UR_MIDDLE)
    short = structure_of(replace(arm, translation=0.8 * arm.translation))
    seen, unknowns = [instants(each, MANY, OPTIONS) for each in logs], unknowns_of(short)
    given, other = (explanations(short.arm, unknowns, seen, (each(short.arm),))[0] for each in (as_it_is, _longer))
    assert 0.0 < gain_over(given.left, other.left).sum() < CLEAR
    assert borne_out(short.arm, (unknowns, unknowns), seen, _longer(short.arm))


def test_lengths_that_only_make_up_for_a_coarse_encoder_are_not():
    structure = structure_of(arm_of(ur_like()))
    rng = np.random.default_rng(22)
    logs = known_logs(ur_like(), BRICK, UR_GAIN, np.random.default_rng(21), middle=UR_MIDDLE)
    logs = tuple(_coarse(each, COARSE, rng) for each in logs)
    seen, unknowns = [instants(each, MANY, OPTIONS) for each in logs], unknowns_of(structure)
    arm = structure.arm
    given, other = (explanations(arm, unknowns, seen, (each(arm),))[0] for each in (as_it_is, _shorter))
    gain = gain_over(given.left, other.left)
    assert convincing(gain, evidence_of(gain, given.freedom, other.freedom), other.reading)
    assert not borne_out(arm, (unknowns, unknowns), seen, other.reading)
    check_wiring(structure, *logs, OPTIONS)
    alternative = comparison._alternative(comparison.prepared(structure, logs, OPTIONS), given, [other])
    assert not alternative.borne_out
    assert not named_readings(comparison.Comparison(given, (), (), (alternative,)), ())
    assert named_readings(comparison.Comparison(given, (), (), (replace(alternative, borne_out=True),)), ())
