"""Recordings of three axes with known friction, observed as they are or with something wrong."""

from collections.abc import Sequence
from functools import cache, lru_cache

import numpy as np
from known_logs import BRICK, mounted
from real_friction import Truth, real_logs

from ident.diagnosis.diagnosis import Diagnosis
from ident.diagnosis.hypothesis import Logs
from ident.estimation.estimate import GainEstimate
from ident.estimation.estimators.nls import AllJointsOptions, all_joints_gains
from ident.estimation.joint_by_joint import joint_by_joint_gains
from ident.estimation.problem import GainOptions, ObservedMotion, Problem
from ident.estimation.setting import Setting, setting
from ident.identification import Identification, identify
from ident.model.structure import Structure
from ident.observation.observation import ObserveOptions, observe
from ident.payload.payload import Payload
from ident.recordings.recording import Recording

PAYLOADS = (None, BRICK)
LOOSE = GainOptions(max_rel_std=10.0)
PLAIN = AllJointsOptions(friction="viscous-coulomb", zero_std=0.0, tilt_std=0.0)


def problem_of(
    axes: Structure, logs: Sequence[Recording], payloads: Sequence[Payload | None] = PAYLOADS, **observing: float
) -> Problem:
    observed = (_seen(log, axes, ObserveOptions(**observing)) for log in logs)
    return Problem(axes, tuple(map(ObservedMotion, observed, payloads)), LOOSE)


_seen = lru_cache(maxsize=32)(observe)
"""Of the same log: many problems differ in what is stated alone."""


def ready_of(problem: Problem) -> Setting:
    """The setting of a fit of all joints in which nothing else is chosen."""
    return setting(problem, per_motion=True, prior_std=1.0)


def logs_of(
    truth: Truth, seed: int = 5, payloads: Sequence[Payload | None] = PAYLOADS, **noise: float
) -> list[Recording]:
    return list(_made(truth, seed, tuple(payloads), **noise))


@cache
def _made(truth: Truth, seed: int, payloads: tuple[Payload | None, ...], **noise: float) -> list[Recording]:
    """Once a process: arrays of recordings are read-only."""
    return real_logs(truth, payloads, np.random.default_rng(seed), **noise)


def doubted(axes: Structure, logs: Sequence[Recording], payloads: Sequence[Payload | None] = PAYLOADS) -> Logs:
    """Logs as the engine sees them."""
    return Logs(tuple(logs), problem_of(axes, logs, payloads), ObserveOptions(), (None,) * len(logs))


def all_joints(problem: Problem) -> GainEstimate:
    return all_joints_gains(problem, PLAIN)


def joint_by_joint(problem: Problem) -> GainEstimate:
    return joint_by_joint_gains(problem)


def changed(log: Recording, *, t=None, q=None, v=None) -> Recording:
    return Recording(log.t if t is None else t, log.q if q is None else q, log.v if v is None else v, log.name)


def late(log: Recording, rows: int) -> Recording:
    """Currents some rows later."""
    return changed(log, v=np.vstack((log.v[[0] * rows], log.v[:-rows])))


def exchanged(x: np.ndarray, i: int, j: int) -> np.ndarray:
    order = np.arange(x.shape[1])
    order[[i, j]] = j, i
    return x[:, order]


def at(joint: int, value: float, otherwise: float, n: int = 6) -> np.ndarray:
    return np.where(np.arange(n) == joint, value, otherwise)


def without(log: Recording, rows: Sequence[int] | np.ndarray, *, even: bool = False) -> Recording:
    """The log without some rows, by stamps that show it, or that do not."""
    kept = np.setdiff1d(np.arange(len(log.t)), rows)
    return Recording(log.t[: len(kept)] if even else log.t[kept], log.q[kept], log.v[kept], log.name)


def identified(axes: Structure, logs: Sequence[Recording], **asked: object) -> Identification:
    """What is found of a bare and a loaded log by the method for all joints, of plain friction unless it is asked."""
    given = {"options": PLAIN, "gains": LOOSE, "observing": ObserveOptions()} | asked
    return identify(axes, mounted(logs[0], logs[1], BRICK), **given)


def named(diagnoses: Sequence[Diagnosis], name: str) -> Diagnosis:
    """The diagnosis of a name."""
    (found,) = [each for each in diagnoses if each.name == name]
    return found
