"""Up to which frequency the compliance of a joint shows in measured positions: beyond it encoder noise does.

What compliance does is made of fourth derivatives of the positions. Noise of encoders in it grows with the fourth power
of the frequency and goes with the noise of the accelerations beside it, which it cancels: with all of it, compliances
come out too small, and those of stiff joints negative and sure (`docs/derivations.md`).
"""

import numpy as np

from ident.numerics.signals import FILTER_ORDER, low_passed, power_density
from ident.observation.full_rate import FullRate
from ident.support.arrays import Array

NOISE_SHARE = 1e-3
"""Share of encoder noise in the power of what a joint's compliance does to its own torque that is let in.

What tells compliance from inertia is a small part of that power, so that a small share of noise bends much: compliances
of an arm with 2e-5 rad of noise at 500 Hz are off by 2 to 7 % with this one, by 30 % with thrice the noise let in.
"""
AVERAGED_BLOCK = 60.0
"""Length of the stretches whose spectra are averaged, in periods of the cut-off of the positions."""


def without_encoder_noise(behind: FullRate, softened: Array, inertia: Array) -> Array:
    """Changes of torques by compliance, of each compliance those that are slower than its encoder noise.

    Args:
        behind: The motion, n joints.
        softened: Change of each joint's torque per compliance of each joint, shape (N, n, n), joint before compliance.
        inertia: Mean squares of the inertia matrix of the links, shape (n, n).

    Returns:
        Shape (N, n, n); what encoder noise does not reach is as it was.
    """
    limits = shown_hz(behind, np.einsum("skk->sk", softened), inertia)
    slow = softened.copy()
    for k in np.flatnonzero(limits < behind.cutoff_hz):
        slow[:, :, k] = low_passed(softened[:, :, k], behind.period, float(limits[k]))
    return slow


def shown_hz(behind: FullRate, own: Array, inertia: Array) -> Array:
    """Highest frequency up to which the noise in what each joint's compliance does to its own torque is little.

    White noise of density N_l in the positions gives M_kk^2 (sum over l of M_kl^2 N_l) (2 pi f)^8, less what the
    low-pass of the positions takes.

    Args:
        behind: The motion, n joints.
        own: Change of each joint's torque per compliance of itself, shape (N, n).
        inertia: Mean squares of the inertia matrix of the links, shape (n, n).

    Returns:
        Frequencies [Hz], shape (n,); the cut-off of the positions where noise is little up to it.
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
