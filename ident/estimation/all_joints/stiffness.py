"""How soft joints may be where nobody measured it: compliance of a transmission that its rotor swings on."""

import numpy as np

from ident.estimation.all_joints.columns import SharedParameters
from ident.estimation.all_joints.torques import rotor_inertia
from ident.estimation.problem import Problem
from ident.support.arrays import Array

RESONANCE_HZ = 25.0
"""Frequency of a rotor on its transmission, assumed; measured ones of geared drives are 20 to 31 Hz."""
LEAST_ROTOR = 0.1
"""Share of a rotor in a joint's inertia at least: a smaller one that is found is an error of the fit."""


def assumed_compliance(problem: Problem, shared: SharedParameters, theta: Array) -> Array:
    """Compliance of each joint [rad / (N m)] or [m / N], shape (n,); zero where no inertia is seen.

    Args:
        problem: Motions from recordings.
        shared: Which parameters joints share.
        theta: Their values, shape (p,).
    """
    stiffness = rotor_inertia(problem, shared, theta, least=LEAST_ROTOR) * (2.0 * np.pi * RESONANCE_HZ) ** 2
    return np.divide(1.0, stiffness, out=np.zeros_like(stiffness), where=stiffness > 0.0)
