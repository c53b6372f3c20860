"""Shared: payloads and exact rows, a log of a known arm, and logs without a fault, as the engine sees them."""

import numpy as np
import pytest
from consistency_logs import all_joints, doubted, logs_of
from exact import lopsided
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, arm_of, known_logs, ur_like
from real_friction import Truth, three_axes
from weighings import PLAIN, known, weighed

from ident.diagnosis.hypothesis import Logs
from ident.diagnosis.search import Survey, survey
from ident.estimation.estimate import GainEstimate
from ident.estimation.problem import Problem
from ident.model.structure import Structure, structure_of
from ident.parameters.payload import FoundPayload, payload_of
from ident.payload.payload import Payload
from ident.recordings.recording import Recording


@pytest.fixture(scope="session")
def heavy(payload) -> Payload:
    return lopsided(payload)


@pytest.fixture
def chi(rng) -> np.ndarray:
    """Standard parameters of six links and drives."""
    return rng.uniform(0.5, 2.0, 84)


@pytest.fixture(scope="session")
def weighed_problem(structure, heavy) -> Problem:
    return weighed(structure, heavy, np.random.default_rng(7), noise=1e-9)


@pytest.fixture(scope="session")
def weighed_payload(weighed_problem) -> FoundPayload:
    """What the exact currents give with the gains known."""
    return payload_of(weighed_problem, known(), PLAIN)


@pytest.fixture(scope="session")
def ur() -> Structure:
    return structure_of(arm_of(ur_like()))


@pytest.fixture(scope="session")
def ur_log() -> Recording:
    """A bare motion of the arm `ur` as a fine encoder logs it."""
    rng = np.random.default_rng(41)
    clean = known_logs(ur_like(), BRICK, UR_GAIN, rng, middle=UR_MIDDLE)[0]
    return Recording(clean.t, clean.q + rng.normal(0.0, 3e-6, clean.q.shape), clean.v, "a/log.csv")


@pytest.fixture(scope="session")
def six(ur) -> Logs:
    """A bare and a loaded log of the arm `ur`, nothing wrong with them."""
    return doubted(ur, known_logs(ur_like(), BRICK, UR_GAIN, np.random.default_rng(0), middle=UR_MIDDLE))


@pytest.fixture(scope="session")
def axes() -> Structure:
    return structure_of(arm_of(three_axes()))


@pytest.fixture(scope="session")
def sound(axes) -> Logs:
    """A bare and a loaded log of three axes, nothing wrong with them."""
    return doubted(axes, logs_of(Truth()))


@pytest.fixture(scope="session")
def sound_estimate(sound) -> GainEstimate:
    return all_joints(sound.problem)


@pytest.fixture(scope="session")
def sound_survey(sound) -> Survey:
    return survey(sound)
