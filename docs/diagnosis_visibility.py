"""What a fault does where nothing else is wrong: residual and gains of logs that the model explains exactly.

The twin of a case has its motions, smooth, and the currents that the model fitted to it predicts. With a fault in the
twin each joint is solved alone (paper, eq. 27), friction and offset of each log its own. A residual of rounding says
that no diagnosis can see the fault in one joint; a gain that stays says that none needs to. Of faults in single samples
it says less: nothing is filtered here.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from diagnosis_cases import SoundCase
from diagnosis_fault import Fault, Motions
from scipy import signal

from ident.model.parameters import INERTIAL, STANDARD
from ident.model.regressor import regressor
from ident.model.structure import Structure
from ident.payload.payload import Payload, standard_parameters
from ident.recordings.recording import Recording
from ident.support.arrays import Array

RATE, CUTOFF = 125.0, 5.0
"""Of twins [Hz]."""
HELD = 1e-6
"""Share of the column of 1/g that nothing else explains, below which there is no gain."""

ROUNDING = 1e-6
"""Shares below which nothing changed."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Effect:
    """What a fault does to logs without noise.

    Attributes:
        residual: Root mean square of what each joint's fit leaves, as a share of its current, shape (n,).
        gain: Change of each gain, as a share of it; NaN where the logs do not show it, shape (n,).
    """

    residual: Array
    gain: Array

    @property
    def seen(self) -> bool:
        """Whether a joint alone shows the fault, however little."""
        return bool(self.residual.max() > ROUNDING)

    @property
    def harmful(self) -> bool:
        """Whether a gain changes or is lost."""
        return bool(np.isnan(self.gain).any() or np.abs(self.gain).max() > ROUNDING)


def effect(fault: Fault, twin: Motions, structure: Structure) -> Effect:
    """What a fault does to the twin of a case.

    Raises:
        IdentificationError: If no recording can be made of it.
    """
    inverse, _ = solved(twin, structure)
    other, residual = solved(*fault.apply(twin, structure))
    return Effect(residual=residual, gain=inverse / other - 1.0)


def twin_of(case: SoundCase) -> Motions:
    """A case's motions below a cut-off, with the currents that the model explains exactly."""
    logs = [_smooth(each.recording) for each in case.motions]
    arm, columns, n = case.structure.arm, case.structure.base.columns, case.structure.arm.n
    gain = np.ones(n) if case.gain is None else case.gain
    W = [regressor(arm, *_states(log)) for log in logs]
    loads = [
        w[..., case.structure.payload_columns] @ _chi(each.payload) for w, each in zip(W, case.motions, strict=True)
    ]
    torque = [log.v * gain - load for log, load in zip(logs, loads, strict=True)]
    stacked = np.concatenate(W).reshape(-1, W[0].shape[2])[:, columns]
    chi = np.linalg.lstsq(stacked, np.concatenate(torque).ravel(), rcond=None)[0]
    return tuple(
        replace(each, recording=Recording(log.t, log.q, (w[..., columns] @ chi + load) / gain, log.name))
        for each, log, w, load in zip(case.motions, logs, W, loads, strict=True)
    )


def solved(motions: Motions, structure: Structure) -> tuple[Array, Array]:
    """1/g of each joint alone, NaN where nothing holds it, and its residual as a share of the current."""
    n = structure.arm.n
    W = [regressor(structure.arm, *_states(each.recording)) for each in motions]
    inverse, residual = np.full(n, np.nan), np.empty(n)
    for j in range(n):
        V = np.concatenate([each.recording.v[:, j] for each in motions])
        A = _unknown([w[:, j] for w in W], motions, structure, j)
        known = np.concatenate([_known(w[:, j], each.payload, structure) for w, each in zip(W, motions, strict=True)])
        A = A / np.maximum(np.linalg.norm(A, axis=0), 1e-12)
        U, size, _ = np.linalg.svd(A, full_matrices=False)
        Q = U[:, size > 1e-9 * size[0]]
        alone, rest = known - Q @ (Q.T @ known), V - Q @ (Q.T @ V)
        if alone @ alone > HELD**2 * max(known @ known, 1e-12):
            inverse[j] = alone @ rest / (alone @ alone)
            rest = rest - inverse[j] * alone
        residual[j] = np.linalg.norm(rest) / np.linalg.norm(V)
    return inverse, residual


def _unknown(rows: Sequence[Array], motions: Motions, structure: Structure, j: int) -> Array:
    """Columns of what joint j does not know: its base parameters, drive of each log, the rest of a payload."""
    mountings = list({id(each.payload): each.payload for each in motions if each.payload is not None})
    drive = len(STANDARD) * j + np.arange(len(INERTIAL), len(STANDARD))
    blocks: list[Array] = []
    for k, (row, each) in enumerate(zip(rows, motions, strict=True)):
        own = np.zeros((len(row), len(motions), len(drive)))
        own[:, k] = row[:, drive]
        more = np.zeros((len(row), len(mountings), len(INERTIAL)))
        if each.payload is not None:
            unknown = ~each.payload.known_part().mask
            more[:, mountings.index(id(each.payload))] = row[:, structure.payload_columns] * unknown
        blocks.append(
            np.hstack((row[:, structure.base.columns], own.reshape(len(row), -1), more.reshape(len(row), -1)))
        )
    return np.concatenate(blocks)


def _known(row: Array, payload: Payload | None, structure: Structure) -> Array:
    """Torque of what is known of a payload [N m], shape (N,)."""
    if payload is None:
        return np.zeros(len(row))
    part = payload.known_part()
    return row[:, structure.payload_columns] @ np.where(part.mask, part.chi, 0.0)


def _chi(payload: Payload | None) -> Array:
    """All ten parameters; zero where nothing is stated."""
    if payload is None:
        return np.zeros(len(INERTIAL))
    return standard_parameters(payload.mass, payload.com or (0.0,) * 3, payload.inertia or (0.0,) * 6)


def _smooth(log: Recording) -> Recording:
    rate = (len(log.t) - 1) / (log.t[-1] - log.t[0])
    sos = signal.butter(3, CUTOFF, fs=rate, output="sos")
    every = max(1, round(rate / RATE))
    q, v = (signal.sosfiltfilt(sos, x, axis=0)[::every] for x in (log.q, log.v))
    t = np.linspace(log.t[0], log.t[-1], len(log.t))[::every]
    return Recording(t, q, v, log.name)


def _states(log: Recording) -> tuple[Array, Array, Array]:
    dq = np.gradient(log.q, log.t, axis=0)
    return log.q, dq, np.gradient(dq, log.t, axis=0)
