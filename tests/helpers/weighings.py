"""Exact currents with a payload to be weighed, and gains that are known."""

from dataclasses import replace

import numpy as np
from exact import GAIN, TRUSTING, exact_problem

from ident.estimation.estimate import GainEstimate
from ident.estimation.estimators.nls import AllJointsOptions, all_joints_gains
from ident.estimation.known_gains import KnownGains
from ident.estimation.problem import Problem
from ident.payload.payload import Payload

UNKNOWN = Payload(mass=2.0, known="none")
PLAIN = AllJointsOptions()
NAMES = tuple(f"joint{j}" for j in range(1, 7))


def weighed(structure, heavy: Payload, rng, *, noise: float, options=TRUSTING) -> Problem:
    chi = rng.uniform(0.5, 2.0, 84)
    motions = [(chi, None, None), (chi, heavy, UNKNOWN)]
    return exact_problem(structure, motions, GAIN, rng, noise=noise, options=options)


def estimated(problem: Problem, payload: Payload) -> GainEstimate:
    """The gains that the same motions give with the payload as stated."""
    loaded = (each if each.payload is None else replace(each, payload=payload) for each in problem.motions)
    return all_joints_gains(replace(problem, motions=tuple(loaded)), PLAIN)


def known(value=GAIN, rel_std=(0.0,) * 6, joints=range(6)) -> KnownGains:
    at = np.array(list(joints))
    value, std = np.asarray(value)[at], np.asarray(rel_std)[at] * np.abs(np.asarray(value)[at])
    return KnownGains(names=NAMES, joints=at, value=value, covariance=np.diag(std**2))
