"""Exact linear systems: what a recording would give with a perfect filter, for identities that hold to rounding."""

import numpy as np

from ident.observation import JointObservation, Observation
from ident.payload import Payload
from ident.regressor import regressor
from ident.structure import Structure


def exact_pair(
    structure: Structure,
    payload: Payload,
    gain: np.ndarray,
    rng: np.random.Generator,
    *,
    noise: float = 0.0,
    rows: int = 300,
) -> tuple[Observation, Observation]:
    """Observations of random states for a random arm of the structure's kinematics, bare and with the payload."""
    n = structure.arm.n
    chi = rng.uniform(0.5, 2.0, 14 * n)
    return (
        exact_observation(structure, chi, np.zeros(10), gain, rng, noise=noise, rows=rows),
        exact_observation(structure, chi, payload.known_part().chi, gain, rng, noise=noise, rows=rows),
    )


def exact_observation(
    structure: Structure,
    chi: np.ndarray,
    chi_payload: np.ndarray,
    gain: np.ndarray,
    rng: np.random.Generator,
    *,
    noise: float,
    rows: int,
) -> Observation:
    """Rows of random states with `V = (W chi + W_L chi_L) / g`, plus noise in proportion to each joint's rms."""
    q, dq, ddq = rng.uniform(-2.0, 2.0, (3, rows, structure.arm.n))
    W_st = regressor(structure.arm, q, dq, ddq)
    joints = []
    for j, columns in enumerate(structure.joint_columns):
        W_L = W_st[:, j, structure.payload_columns]
        V = (W_st[:, j] @ chi + W_L @ chi_payload) / gain[j]
        V = V + noise * np.sqrt(np.mean(V**2)) * rng.standard_normal(rows)
        joints.append(
            JointObservation(
                V, W_st[:, j, structure.base.columns[columns]], columns, W_L, np.arange(rows), np.arange(rows), 0.05
            )
        )
    return Observation(structure, tuple(joints), ())
