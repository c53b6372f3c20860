"""Assumed compliance of joints, if it is not known: from the resonance of the rotor on its transmission."""

import numpy as np

from ident.estimation.all_joints.columns import SharedParameters
from ident.estimation.all_joints.torques import rotor_inertia
from ident.estimation.problem import Problem
from ident.support.arrays import Array

RESONANCE_HZ = 25.0
"""Assumed resonance of a rotor on its transmission [Hz]; measured ones of geared drives are 20 to 31 Hz."""
LEAST_ROTOR = 0.1
"""Smallest share of a rotor in a joint's inertia; a smaller estimate is an error of the fit."""


def assumed_compliance(problem: Problem, shared: SharedParameters, theta: Array) -> Array:
    """Return the compliance of each joint [rad / (N m)] or [m / N], shape (n,); zero without an inertia."""
    stiffness = rotor_inertia(problem, shared, theta, least=LEAST_ROTOR) * (2.0 * np.pi * RESONANCE_HZ) ** 2
    return np.divide(1.0, stiffness, out=np.zeros_like(stiffness), where=stiffness > 0.0)
