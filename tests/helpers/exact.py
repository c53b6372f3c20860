"""Exact linear systems: what a recording would give with a perfect filter, for identities that hold to rounding."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ident.estimation.estimate import GainEstimate, IdentifiedGain
from ident.estimation.estimators import ESTIMATORS
from ident.estimation.problem import GainOptions, ObservedMotion, Problem, pair
from ident.estimation.setting import Setting
from ident.model.regressor import regressor
from ident.model.structure import Structure
from ident.numerics.signals import decimator
from ident.observation.full_rate import FullRate
from ident.observation.observation import JointObservation, Observation
from ident.payload.payload import Payload
from ident.recordings.recording import Recording

GAIN = np.array([0.9401, -0.9619, 1.1148, 0.9146, 25.0, -0.04])
TRUSTING = GainOptions(noise_floor=1e-12)
# Exact data: the only error is rounding, amplified by the condition number of the scaled system, below 1e4.
EXACT = 1e4 * np.finfo(float).eps


def values(estimate: GainEstimate) -> np.ndarray:
    return np.array([joint.value if isinstance(joint, IdentifiedGain) else np.nan for joint in estimate.joints])


def shared_columns(ready: Setting) -> np.ndarray:
    """Columns of the shared parameters, with appended ones, of all rows."""
    blocks = ready.blocks
    whole = np.array([blocks.joint(j) + blocks.own.Q[j] @ blocks.C[j] for j in range(ready.n)])
    return blocks.layout.rows(whole[..., :-2])


def estimated(
    method: str, unloaded: Observation, loaded: Observation, payload: Payload, options: GainOptions = TRUSTING
) -> GainEstimate:
    """The estimate of a method with its default options."""
    estimator = ESTIMATORS[method]
    return estimator.estimate(pair(unloaded, loaded, payload, options), estimator.options())


drive_gains, sequential_gains = partial(estimated, "ls-2011"), partial(estimated, "sequential-2011")


def lopsided(payload: Payload) -> Payload:
    """The same payload with its centre of mass off the flange axis, so that it loads joint 6."""
    return replace(payload, com=(0.1, -0.05, 0.14))


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
    chi = rng.uniform(0.5, 2.0, 14 * structure.arm.n)
    motions = [(chi, None, None), (chi, payload, payload)]
    bare, loaded = exact_problem(structure, motions, gain, rng, noise=noise, rows=rows).motions
    return bare.observation, loaded.observation


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
        W, count = W_st[:, j, structure.base.columns[columns]], np.arange(rows)
        joints.append(
            JointObservation(
                V=V, W=W, columns=columns, W_L=W_L, weight=np.ones(rows), t=count, position=count, row_period=0.05
            )
        )
    return Observation(structure, tuple(joints), ())


def exact_problem(
    structure: Structure,
    motions: Sequence[tuple[np.ndarray, Payload | None, Payload | None]],
    gain: np.ndarray,
    rng: np.random.Generator,
    *,
    noise: float = 0.0,
    rows: int = 150,
    options: GainOptions = TRUSTING,
) -> Problem:
    """A problem of motions on random states, each of standard parameters, the payload that is there, and its belief."""
    observed = list[ObservedMotion]()
    for chi, true, believed in motions:
        load = np.zeros(10) if true is None else true.known_part().chi
        seen = exact_observation(structure, chi, load, gain, rng, noise=noise, rows=rows)
        observed.append(ObservedMotion(seen, believed))
    return Problem(structure, tuple(observed), options)


def full_rate(q: np.ndarray, noise: np.ndarray, *, period: float, cutoff_hz: float = 15.0) -> FullRate:
    """A motion that its positions (N, n) alone describe, with the density of their white noise, shape (n,)."""
    nothing, count = np.zeros_like(q), np.arange(q.size, dtype=float).reshape(q.shape)
    return FullRate(
        q=q, dq=nothing, ddq=nothing, moving=np.ones(q.shape, dtype=bool), period=period, cutoff_hz=cutoff_hz,
        decimator=decimator(period, 10.0, 10), edge=0, group=1, noise=noise,
        recording=Recording(period * np.arange(len(q)), count, count), current_delay=0.0,
    )  # fmt: skip
