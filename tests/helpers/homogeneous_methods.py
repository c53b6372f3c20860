"""`ols` and `tls-2014` with any weights, and noise for exact rows."""

from dataclasses import replace

import numpy as np

from ident.estimation.estimators import ols, tls_2014
from ident.estimation.gain_options import GainOptions
from ident.estimation.homogeneous import HomogeneousOptions
from ident.observation.observation import Observation

LOOSE = GainOptions(noise_floor=1e-12, max_rel_std=10.0)
METHODS = {
    "ols": lambda problem, weights: ols.homogeneous_gains(problem, HomogeneousOptions(weights=weights)),
    "tls-2014": lambda problem, weights: tls_2014.total_gains(problem, HomogeneousOptions(weights=weights)),
}


def moved(observation: Observation, noise: dict[int, np.ndarray]) -> Observation:
    """The same rows with something added to the currents of some joints."""
    joints = tuple(replace(each, V=each.V + noise.get(j, 0.0)) for j, each in enumerate(observation.joints))
    return replace(observation, joints=joints)


def noisy(clean, rng: np.random.Generator, share: np.ndarray) -> tuple[Observation, ...]:
    """White noise in proportion to each joint's rms current."""
    rms = [np.sqrt(np.mean(np.concatenate([o.joints[j].V for o in clean]) ** 2)) for j in range(6)]
    return tuple(
        moved(o, {j: share[j] * rms[j] * rng.standard_normal(len(o.joints[j].V)) for j in range(6)}) for o in clean
    )
