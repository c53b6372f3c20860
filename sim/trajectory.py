"""Exciting motions as finite Fourier series that start and end at rest, in closed form."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ident.support.arrays import Array


@dataclass(frozen=True, slots=True, eq=False)
class FourierTrajectory:
    """Reference motion of n joints with H harmonics.

    `q_j(t) = center_j + sum_k sine_jk sin(k w t) + cosine_jk cos(k w t)`, w = 2 pi / duration. The coefficients
    satisfy `sum_k k sine_jk = 0` and `sum_k k^2 cosine_jk = 0`, so velocity and acceleration vanish at both ends.
    """

    center: Array  # mean positions [rad], shape (n,)
    sine: Array  # sine coefficients [rad], shape (n, H)
    cosine: Array  # cosine coefficients [rad], shape (n, H)
    duration: float  # one period [s]

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.center)

    def __call__(self, t: Array) -> tuple[Array, Array, Array]:
        """Return q, dq, ddq [rad, rad/s, rad/s^2], each (N, n), at times [s], shape (N,)."""
        rate = 2.0 * np.pi / self.duration * np.arange(1, self.sine.shape[1] + 1)  # (H,) rad/s
        s, c = _waves(rate.tobytes(), np.asarray(t, dtype=np.float64).tobytes())
        q = self.center + s @ self.sine.T + c @ self.cosine.T
        dq = c @ (rate * self.sine).T - s @ (rate * self.cosine).T
        ddq = -s @ (rate**2 * self.sine).T - c @ (rate**2 * self.cosine).T
        return q, dq, ddq


@lru_cache(maxsize=2)
def _waves(rate: bytes, t: bytes) -> tuple[Array, Array]:
    """Return sines and cosines of all harmonics, each (N, H), cached: a search always uses the same two grids."""
    angle = np.outer(np.frombuffer(t), np.frombuffer(rate))
    s, c = np.sin(angle), np.cos(angle)
    s.flags.writeable = c.flags.writeable = False
    return s, c


def at_rest(center: Array, sine: Array, cosine: Array, duration: float) -> FourierTrajectory:
    """Return the trajectory nearest to the given coefficients that starts and ends at rest."""
    k = np.arange(1, sine.shape[1] + 1, dtype=np.float64)
    return FourierTrajectory(center, _without(sine, k), _without(cosine, k**2), duration)


def _without(rows: Array, direction: Array) -> Array:
    """Return rows minus their component along `direction`."""
    unit = direction / np.linalg.norm(direction)
    return rows - np.outer(rows @ unit, unit)
