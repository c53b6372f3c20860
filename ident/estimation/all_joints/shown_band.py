"""Frequency up to which the effect of a joint's compliance exceeds encoder noise in measured positions.

The effect of compliance depends on fourth derivatives of the positions, whose encoder noise grows with the fourth power
of frequency. This noise is correlated with that of the accelerations and partly cancels it, so that without a limit
compliances are estimated too small, and those of rigid joints significantly negative (`docs/derivations.md`).
"""

import numpy as np

from ident.numerics.signals import FILTER_ORDER, low_passed, power_density
from ident.observation.full_rate import FullRate
from ident.support.arrays import Array

NOISE_SHARE = 1e-3
"""Largest share of encoder noise in the power of the effect of a joint's compliance on its own torque.

Only a small part of that power separates compliance from inertia, so a small share of noise causes a large bias:
compliances of an arm with 2e-5 rad of noise at 500 Hz have errors of 2 to 7 % with this share, of 30 % with three times
as much.
"""
AVERAGED_BLOCK = 60.0
"""Length of the segments whose spectra are averaged, in periods of the cut-off of the positions."""


def without_encoder_noise(behind: FullRate, softened: Array, inertia: Array) -> Array:
    """Return the changes of torques by compliance, low-passed below the frequencies dominated by encoder noise.

    Args:
        behind: The motion, n joints.
        softened: Change of each joint's torque per compliance of each joint, shape (N, n, n), joint before compliance.
        inertia: Mean squares of the inertia matrix of the links, shape (n, n).

    Returns:
        Shape (N, n, n); unchanged where encoder noise is small.
    """
    limits = shown_hz(behind, np.einsum("skk->sk", softened), inertia)
    slow = softened.copy()
    for k in np.flatnonzero(limits < behind.cutoff_hz):
        slow[:, :, k] = low_passed(softened[:, :, k], behind.period, float(limits[k]))
    return slow


def shown_hz(behind: FullRate, own: Array, inertia: Array) -> Array:
    """Return the frequency up to which noise in the effect of each joint's compliance on its own torque is small.

    White noise of density N_l in the positions gives M_kk^2 (sum over l of M_kl^2 N_l) (2 pi f)^8, reduced by the
    low-pass of the positions.

    Args:
        behind: The motion, n joints.
        own: Change of each joint's torque per compliance of itself, shape (N, n).
        inertia: Mean squares of the inertia matrix of the links, shape (n, n).

    Returns:
        Frequencies [Hz], shape (n,); the cut-off of the positions if noise is small up to it.
    """
    length = min(len(own), round(AVERAGED_BLOCK / (behind.cutoff_hz * behind.period)))
    f, power = power_density(own, behind.period, length)
    inside = (f > 0.0) & (f <= behind.cutoff_hz)
    f, power = f[inside], power[inside]
    kept = (1.0 + (f / behind.cutoff_hz) ** (2 * FILTER_ORDER)) ** -2
    density = np.diag(inertia) * (inertia @ behind.noise)
    noise = ((2.0 * np.pi * f) ** 8 * kept)[:, None] * density
    little = np.cumsum(noise, axis=0) <= NOISE_SHARE * np.cumsum(power, axis=0)
    last = len(f) - 1 - np.argmax(little[::-1], axis=0)
    highest = np.where(little.any(axis=0), f[last], f[0])
    return np.where(little[-1], behind.cutoff_hz, highest)
