"""A problem with closed-form motions and torques from inverse dynamics, with known gains and only rounding errors.

With its options (slow harmonics, a cut-off far above them, no decimation), differentiation and filters cause a relative
error of 1e-9.
"""

from dataclasses import dataclass

import numpy as np

from ident.estimation.gain_options import GainOptions
from ident.model.arm import Arm
from ident.model.inverse_dynamics import inverse_dynamics
from ident.model.structure import Structure
from ident.observation.observation import ObserveOptions
from ident.payload.payload import Payload
from ident.recordings.motion import Motion
from ident.recordings.recording import Recording
from ident.support.arrays import Array

RATE = 1000.0
"""Samples a second."""
PERIOD = 20.0
"""Period of the slowest harmonic, and duration of each motion [s]."""
HARMONICS = 8
SIZE = 0.6
"""Largest amplitude of the first harmonic [rad or m]; that of the k-th is 1/k of it."""
OBSERVING = ObserveOptions(cutoff_hz=35.0, reversal_speed=0.1)
TRUSTING = GainOptions(noise_floor=1e-12, max_rel_std=10.0)
"""Limits that refuse only unidentifiable gains."""
GAINS = (0.94, -1.3, 25.0, 0.31, 7.1, -0.045)
"""Gains of the joints [N m / drive unit], repeated cyclically."""
PAYLOAD = Payload(
    mass=4.3, com=(0.07, -0.05, 0.11), inertia=(0.021, 0.017, 0.012, 0.002, -0.001, 0.003), mass_std=0.005
)
"""Asymmetric payload, which loads every joint."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Exact:
    """Motions with known gains.

    Attributes:
        motions: A bare one, and one with a specified payload.
        gain: The gains [N m / drive unit], shape (n,).
    """

    motions: tuple[Motion, ...]
    gain: Array


def exact_motions(structure: Structure, seed: int, *, noise: float, mounted: bool = True) -> Exact:
    """Return a bare and a loaded motion of an arm with random links and friction.

    `noise` is white noise of the currents, a share of each joint's rms current; without `mounted` the payload is only
    specified.
    """
    arm, rng = structure.arm, np.random.default_rng(seed)
    chi = rng.uniform(0.5, 2.0, structure.base.regrouping.shape[1])
    gain = np.resize(np.array(GAINS), arm.n)
    motions: list[Motion] = []
    for carried, payload in ((False, None), (mounted, PAYLOAD)):
        load = chi.copy()
        if carried:
            load[structure.payload_columns] += PAYLOAD.known_part().chi
        t, q, tau = _moved(arm, load, rng)
        v = tau / gain
        v += noise * np.sqrt(np.mean(v**2, axis=0)) * rng.standard_normal(v.shape)
        motions.append(Motion(Recording(t, q, v, "loaded" if payload else "bare"), payload))
    return Exact(motions=tuple(motions), gain=gain)


def _moved(arm: Arm, chi: Array, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Return times (N,), positions (N, n) and torques (N, n) of a random motion.

    Sines are odd about both ends, like the padding of the filter, so the filter has no transient.
    """
    t = np.arange(int(PERIOD * RATE)) / RATE
    k = np.arange(1, HARMONICS + 1)
    w = 2.0 * np.pi * k / PERIOD
    size = rng.uniform(0.5, 1.0, (arm.n, HARMONICS)) * rng.choice([-1.0, 1.0], (arm.n, HARMONICS)) * SIZE / k
    angle = t[:, None, None] * w
    q = rng.uniform(-1.0, 1.0, arm.n) + (size * np.sin(angle)).sum(axis=2)
    dq = (size * w * np.cos(angle)).sum(axis=2)
    ddq = -(size * w**2 * np.sin(angle)).sum(axis=2)
    return t, q, inverse_dynamics(arm, chi, q, dq, ddq)
