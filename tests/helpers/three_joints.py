"""A problem of three joints in which something is believed of friction, gains and a shared column, and its fit."""

from dataclasses import dataclass, replace

import numpy as np
from exact import exact_problem

from ident.estimation.all_joints.columns import JointColumns, joint_columns, shared_parameters
from ident.estimation.all_joints.fit import AllJointsFit, fitted
from ident.estimation.all_joints.friction import OwnColumns, Term, own_columns
from ident.estimation.all_joints.reduction import reduced_joint
from ident.estimation.all_joints.search import Prior, search
from ident.estimation.all_joints.solution import widened
from ident.estimation.problem import Problem
from ident.model.structure import Structure
from ident.payload.payload import Payload

N = 3
TRUE = np.array([0.93, -4.1, 0.37])


@dataclass(frozen=True)
class Case:
    """A problem of three joints with a further column of friction that something is believed of."""

    problem: Problem
    columns: tuple[JointColumns, ...]
    own: tuple[OwnColumns, ...]
    prior: Prior

    def moved(self, joint: int, row: int, by: float) -> "Case":
        """The same with another current in one row."""
        each = self.columns[joint]
        V = each.V.copy()
        V[row] += by
        return replace(self, columns=tuple(replace(each, V=V) if j == joint else c for j, c in enumerate(self.columns)))

    def believing(self, joint: int, by: float) -> "Case":
        """The same with another belief about the further column of a joint, by some deviations."""
        each = self.own[joint]
        mean = np.where(each.believed, each.mean + by * np.where(each.believed, each.std, 0.0), each.mean)
        own = tuple(replace(each, mean=mean) if j == joint else F for j, F in enumerate(self.own))
        return replace(self, own=own)

    def fit(self) -> AllJointsFit:
        joints = [reduced_joint(each, F) for each, F in zip(self.columns, self.own, strict=True)]
        return fitted(self.columns, joints, search(joints, 1.0 / TRUE, self.prior), self.prior, 0.05)


BELIEVED_STD = 7e-4
"""Deviation of the coefficient of a shared column, about that which data leave."""


def case(small: Structure, unsure: Payload, noise: float, *, pull: float = 1.0) -> Case:
    """Beliefs that are off by some 15 and 30 deviations, times `pull`; one shared column is believed to be small."""
    rng = np.random.default_rng(11)
    chi = rng.uniform(0.5, 2.0, 14 * N)
    motions = [(chi, None, None), (chi, unsure, unsure), (chi, unsure, replace(unsure, known="mass"))]
    problem = exact_problem(small, motions, TRUE, rng, noise=noise, rows=60)
    shared = shared_parameters(problem)
    columns = joint_columns(problem, shared)
    bent = [Term(np.cbrt(each.own["Fv"]), mean=0.3 * pull, std=0.02) for each in columns]
    own = tuple(own_columns(each, {"cbrt": term}, per_motion=True) for each, term in zip(columns, bent, strict=True))
    shared_std = np.append(np.full(columns[0].shared.shape[1], np.inf), BELIEVED_STD)
    columns = widened(columns, [rng.normal(size=(len(each.V), 1)) for each in columns])
    prior = Prior(mean=np.log((1.0 + 0.07 * pull) / np.abs(TRUE)), std=np.array([0.03, 0.4, 0.002]), shared=shared_std)
    return Case(problem, columns, own, prior)
