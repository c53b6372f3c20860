"""Recordings of three axes with known friction, and the evidence of their estimates."""

import numpy as np
from ident.consistency.evidence import Evidence
from known_logs import BRICK
from real_friction import Truth, real_logs

from ident.estimators import ESTIMATORS
from ident.estimators.nls import AllJointsOptions, all_joints_gains
from ident.observation import ObserveOptions, observe
from ident.options import GainOptions
from ident.payload import Payload
from ident.problem import Motion, Problem
from ident.recording import Recording
from ident.structure import Structure

PAYLOADS = (None, BRICK)
LOOSE = GainOptions(max_rel_std=10.0)
PLAIN = AllJointsOptions(friction="viscous-coulomb")


def problem_of(axes: Structure, logs: list[Recording], payloads: tuple[Payload | None, ...] = PAYLOADS) -> Problem:
    motions = (Motion(observe(log, axes, ObserveOptions()), each) for log, each in zip(logs, payloads, strict=True))
    return Problem(axes, tuple(motions), LOOSE)


def logs_of(truth: Truth, seed: int = 5, payloads: tuple[Payload | None, ...] = PAYLOADS) -> list[Recording]:
    return real_logs(truth, payloads, np.random.default_rng(seed))


def evidence_of(problem: Problem, options: AllJointsOptions = PLAIN) -> Evidence:
    return Evidence(problem=problem, estimate=all_joints_gains(problem, options), drift=True)


def joint_by_joint(problem: Problem) -> Evidence:
    chosen = ESTIMATORS["ls-2011"]
    return Evidence(problem=problem, estimate=chosen.estimate(problem, chosen.options()), drift=False)


def with_current(log: Recording, joint: int, change) -> Recording:
    """The log with another current of a joint, given time from 0 to 1, position and speed."""
    v, time = log.v.copy(), (log.t - log.t[0]) / (log.t[-1] - log.t[0])
    speed = np.convolve(np.gradient(log.q[:, joint], log.t), np.ones(9) / 9.0, "same")
    v[:, joint] = change(v[:, joint], time, log.q[:, joint], speed)
    return Recording(log.t, log.q, v, log.name)
