"""Real recordings: a UR10e with motor currents and a weighed payload, a TX-40 without payload."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from ident.estimation.estimators.nls import AllJointsOptions
from ident.estimation.gain_comparison import compared
from ident.estimation.known_gains import KnownGains, estimated_gains
from ident.estimation.problem import Columns, GainOptions, ObservedMotion, Problem
from ident.identification import identify
from ident.model.arm import load_arm
from ident.model.regressor import inverse_dynamics
from ident.model.structure import Structure, structure_of
from ident.numerics.least_squares import least_squares
from ident.numerics.signals import smooth_motion
from ident.observation.observation import ObserveOptions, observe
from ident.parameters.payload import payload_of
from ident.parameters.weighing import DIFFERS, verified
from ident.payload.payload import Payload
from ident.recordings.files import read, read_recording
from ident.recordings.recording import Motion, Recording

pytestmark = pytest.mark.real


def test_ur10e_gives_the_joints_that_the_mass_loads_and_refuses_the_others(real: Path):
    folder = real / "ur10e"
    found = identify(load_arm(folder / "ur10e.urdf"), pair_of(folder), method="ls-2011")
    estimate = found.estimate
    assert list(estimate.identifiable) == [False, True, True, True, False, False]
    assert "predicted standard deviation" in str(estimate.joints[0].reason)
    assert all("mass alone" in str(joint.reason) for joint in estimate.joints[4:])
    assert sum("resampled" in note for note in found.notes) == 2  # both clocks jitter
    # No published gain to compare with: a plausible range (a torque constant near 0.1 N m/A, a gear near 100) only.
    assert all(8.0 < joint.value < 16.0 for joint in estimate.joints[1:4])


def test_tx40_fits_its_own_model_to_about_5_percent(real: Path):
    folder = real / "tx40"
    structure = structure_of(load_arm(folder / "tx40.urdf", couplings=((4, 5),)))
    observation = observe(read_recording(folder / "recording.parquet"), structure, ObserveOptions())
    system = Columns.of([ObservedMotion(observation, None)])  # logged in N m: gains are 1
    assert system.W.shape[1] == 58 + 3
    fit = least_squares(system.W, system.V, rank_tol=1e-7)
    assert np.linalg.norm(fit.residual) / np.linalg.norm(system.V) < 0.06
    # Published identification of this robot (figaroh-examples, TX40_config.yaml), at 100 Hz and with low speeds left
    # in: viscous and Coulomb friction trade off by some 20 %.
    found = dict(zip(structure.base.names, fit.x, strict=True))
    for name, published in {"Fv1": 8.05, "Fv2": 5.53, "Fc1": 7.14, "Fc2": 8.26, "Fv3": 1.97, "Fc3": 6.34}.items():
        np.testing.assert_allclose(found[name], published, rtol=0.25)


@pytest.mark.parametrize("loaded", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_half_of_a_tx40_motion_with_a_payload_added_to_its_torques_gives_the_gains_by_the_mass_alone(real, loaded):
    folder, gain = real / "tx40", np.array([1.12, 0.87, 1.23, 0.93, 1.31, 0.9])
    structure = structure_of(load_arm(folder / "tx40.urdf", couplings=((4, 5),)))
    whole = read_recording(folder / "recording.parquet")
    payload = Payload(mass=5.3, com=(0.02, -0.03, 0.08), inertia=(0.011, 0.012, 0.009, 0.0, 0.0, 0.0))
    chi = np.zeros(structure.base.regrouping.shape[1])
    chi[structure.payload_columns] = payload.known_part().chi
    added = inverse_dynamics(structure.arm, chi, *smooth_motion(whole.q, whole.period, 40.0))
    motions = list[Motion]()
    for k, rows in enumerate((slice(None, len(whole.t) // 2), slice(len(whole.t) // 2, None))):
        v = (whole.v + (k == loaded) * added)[rows] / gain
        recording = Recording(whole.t[rows] - whole.t[rows][0], whole.q[rows], v, f"half {k + 1}")
        motions.append(Motion(recording, replace(payload, known="mass") if k == loaded else None))
    found = identify(structure, motions)
    # 4.5 s of a motion for other purposes: standard deviations of 3 to 8 %. The largest of the twelve z-scores of both
    # halves is below 2.5 in 86 of 100 such pairs if intervals are correct.
    assert (found.estimate.identifiable).sum() >= 5
    off = (found.gain / gain - 1.0) / (found.std / found.gain)
    assert np.abs(off).max() < 2.5
    assert (found.std[:4] / found.gain[:4]).max() < 0.08


PAIRS = ("ur10e", "ur10e_december")


@pytest.fixture(scope="module")
def ur10e(real: Path) -> Structure:
    return structure_of(load_arm(real / "ur10e" / "ur10e.urdf"))


def pair_of(folder: Path) -> list[Motion]:
    return [read(folder / "unloaded.parquet"), read(folder / "loaded.parquet", payload=folder / "payload.toml")]


@pytest.fixture(scope="module")
def found(real: Path, ur10e: Structure) -> Callable[[str], KnownGains]:
    """The gains of each pair, found once."""
    return cache(lambda name: estimated_gains(identify(ur10e, pair_of(real / name)).estimate))


@pytest.mark.parametrize(("gains", "weighed"), [PAIRS, pytest.param(*PAIRS[::-1], marks=pytest.mark.slow)])
def test_gains_of_one_pair_weigh_the_payload_of_the_other(real: Path, ur10e, found, gains, weighed):
    motions, known = pair_of(real / weighed), found(gains)
    payload = motions[1].payload
    bare, heavy = (observe(each.recording, ur10e, ObserveOptions()) for each in motions)
    carried = ObservedMotion(heavy, replace(payload, known="none"))
    problem = Problem(ur10e, (ObservedMotion(bare, None), carried), GainOptions())
    shown = identify(ur10e, motions).estimate
    verification = verified(payload_of(problem, known, AllJointsOptions()), payload, known, shown)
    assert verification.passed
    # Off by 0.1 and 0.6 %, where the stated deviations are 2.4 %, half of them by laws of the gains.
    assert abs(verification.together.rel_error) < 2.0 * verification.together.rel_std < 0.06
    wrong = replace(known, value=known.value * np.where(np.arange(len(known.value)) == 1, 1.15, 1.0))
    told = verified(payload_of(problem, wrong, AllJointsOptions(friction="load-motor")), payload, wrong, shown)
    assert max(told.joints, key=lambda each: abs(each.rel_error or 0.0) / (each.rel_std or 1.0)).joint == 1
    assert told.joints[1].verdict == DIFFERS


@pytest.mark.slow
def test_gains_of_both_pairs_did_not_move(found):
    assert not compared(*map(found, PAIRS)).moved
