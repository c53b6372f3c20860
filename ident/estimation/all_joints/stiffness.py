"""How soft joints may be where nobody measured it: compliance of a transmission that its rotor swings on."""

import numpy as np

from ident.estimation.all_joints.columns import SharedParameters
from ident.estimation.all_joints.torques import inertia_matrices
from ident.estimation.problem import Problem
from ident.support.arrays import Array

RESONANCE_HZ = 25.0
"""Frequency of a rotor on its transmission, assumed; measured ones of geared drives are 20 to 31 Hz."""
ROTOR_SHARE = 0.5
"""Share of a rotor in a joint's inertia where the two cannot be told apart, assumed: gears match rotor and load."""
LEAST_ROTOR = 0.1
"""Share of a rotor in a joint's inertia at least: a smaller one that is found is an error of the fit."""


def assumed_compliance(problem: Problem, shared: SharedParameters, theta: Array) -> Array:
    """Compliance of each joint [rad / (N m)] or [m / N], shape (n,); zero where no inertia is seen.

    Args:
        problem: Motions from recordings.
        shared: Which parameters joints share.
        theta: Their values, shape (p,).
    """
    base = problem.structure.base
    value = dict(zip(shared.arm.tolist(), theta[: len(shared.arm)].tolist(), strict=True))
    whole = joint_inertia(problem, shared, theta)
    inertia = ROTOR_SHARE * whole
    alone = np.count_nonzero(base.regrouping, axis=1) == 1
    for joint in range(problem.structure.arm.n):
        name = f"Ia{joint + 1}"
        place = base.names.index(name) if name in base.names else -1
        if place >= 0 and alone[place] and place in value:
            inertia[joint] = max(value[place], LEAST_ROTOR * whole[joint])
    stiffness = inertia * (2.0 * np.pi * RESONANCE_HZ) ** 2
    return np.divide(1.0, stiffness, out=np.zeros_like(stiffness), where=stiffness > 0.0)


def joint_inertia(problem: Problem, shared: SharedParameters, theta: Array) -> Array:
    """Mean inertia of the arm about each joint, rotor included [kg m^2] or [kg], shape (n,)."""
    structure, behind = problem.structure, problem.motions[0].observation.full_rate
    assert behind is not None, "asked of recordings only"
    chi = np.zeros(structure.base.regrouping.shape[1])
    chi[structure.base.columns[shared.arm]] = theta[: len(shared.arm)]
    return np.mean(np.einsum("sjj->sj", inertia_matrices(structure.arm, chi, behind.q)), axis=0)
