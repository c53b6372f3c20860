"""A small arm, and a payload that nothing is known of exactly."""

from dataclasses import replace

import numpy as np
import pytest
from exact import lopsided
from pinocchio_arms import random_arm
from three_joints import N

from ident.model.arm import arm_from_pinocchio
from ident.model.structure import Structure, structure_of
from ident.payload.payload import Payload


@pytest.fixture(scope="session")
def small() -> Structure:
    return structure_of(arm_from_pinocchio(random_arm(np.random.default_rng(4), N, prismatic=0.0)))


@pytest.fixture(scope="session")
def unsure(payload) -> Payload:
    spread = {"mass_std": 0.02, "com_std": (0.001, 0.003, 0.002), "inertia_std": (3e-3, 1e-3, 2e-3, 5e-4, 7e-4, 9e-4)}
    return replace(lopsided(payload), **spread)
