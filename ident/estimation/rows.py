"""Rows of all joints of a problem, one joint after the other, with the columns of the model of all joints."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ident.estimation.problem import Problem
from ident.model.parameters import INERTIAL
from ident.model.structure import BaseParameters, independent_columns
from ident.payload.payload import KnownPayload
from ident.support.arrays import Array, Indices

OWN = ("Fv", "Fc", "off")
"""Parameters that act on one joint only; they are estimated in drive units."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SharedParameters:
    """The parameters that joints share.

    Attributes:
        arm: Indices of the arm's shared parameters among its base parameters, shape (a,).
        free: Independent unknown parameters of each mounting, index arrays into `INERTIAL`.
        parts: Known part of each mounting's payload, with factors of its covariance.
        known: Values of each mounting's known parameters, zero for the others, shape (mountings, 10).
    """

    arm: Indices
    free: tuple[Indices, ...]
    parts: tuple[KnownPayload, ...]
    known: Array

    @classmethod
    def of(cls, problem: Problem) -> "SharedParameters":
        """Of a problem."""
        probes = np.vstack(list(problem.structure.payload_probes))
        known = [payload.known_part() for payload in problem.payloads]
        return cls(
            arm=shared_arm(problem.structure.base),
            free=tuple(np.sort(independent_columns(probes, [np.flatnonzero(~each.mask)])) for each in known),
            parts=tuple(known),
            known=np.array([np.where(each.mask, each.chi, 0.0) for each in known]).reshape(len(known), len(INERTIAL)),
        )

    @property
    def count(self) -> int:
        """Number of shared parameters, p."""
        return len(self.arm) + sum(len(each) for each in self.free)

    def payload_values(self, theta: Array) -> Array:
        """All parameters of each mounting, known and estimated, shape (mountings, 10)."""
        chi, first = self.known.copy(), len(self.arm)
        for each, free in zip(chi, self.free, strict=True):
            each[free] = theta[first : first + len(free)]
            first += len(free)
        return chi


def shared_arm(base: BaseParameters) -> Indices:
    """Indices of base parameters that joints share: all but friction and offset, shape (a,)."""
    return np.flatnonzero(~np.isin([name.rstrip("0123456789") for name in base.names], OWN))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Columns:
    """Rows of all joints, one joint after the other, then by motion.

    Attributes:
        joint: Joint of each row, from 0, shape (r,).
        motion: Motion of each row, shape (r,).
        position: Number of each row in its motion, including omitted rows, shape (r,).
        V: Currents [drive units], shape (r,).
        shared: A: columns of the parameters that joints share, shape (r, p).
        known: k: torque of the known payload parameters [N m], shape (r,).
        own: Columns of viscous friction, Coulomb friction and offset by name, each of shape (r,); zero for a joint with
            a shared parameter in their place.
        payload: Ten columns of each mounting, zero in the rows of other motions, shape (mountings, r, 10).
    """

    joint: Indices
    motion: Indices
    position: Indices
    V: Array
    shared: Array
    known: Array
    own: Mapping[str, Array]
    payload: Array

    @classmethod
    def of(cls, problem: Problem, shared: SharedParameters) -> "Columns":
        """Of a problem."""
        structure, payloads, names = problem.structure, problem.payloads, problem.structure.base.names
        parts = [
            (j, k, motion, motion.observation.joints[j])
            for j in range(structure.arm.n)
            for k, motion in enumerate(problem.motions)
        ]
        lengths = [len(part.V) for *_, part in parts]
        joint = np.repeat([j for j, *_ in parts], lengths)
        motion = np.repeat([k for _, k, *_ in parts], lengths)
        W = np.zeros((sum(lengths), len(structure.base.columns)))
        payload = np.zeros((len(payloads), len(W), len(INERTIAL)))
        starts = np.cumsum([0, *lengths]).tolist()
        for (_, _, carried, part), start, stop in zip(parts, starts, starts[1:], strict=False):
            W[start:stop, part.columns] = part.W
            for which, mounted in enumerate(payloads):
                if carried.payload is mounted:
                    payload[which, start:stop] = part.W_L
        own = {name: np.zeros(len(W)) for name in OWN}
        for name in OWN:
            for j in range(structure.arm.n):
                if (place := f"{name}{j + 1}") in names:
                    own[name][joint == j] = W[joint == j, names.index(place)]
        free = [columns[:, each] for columns, each in zip(payload, shared.free, strict=True)]
        return cls(
            joint=joint,
            motion=motion,
            position=np.concatenate([part.position for *_, part in parts]),
            V=np.concatenate([part.V for *_, part in parts]),
            shared=np.hstack([W[:, shared.arm], *free]),
            known=np.einsum("krp,kp->r", payload, shared.known),
            own=own,
            payload=payload,
        )

    def friction(self, *, per_motion: bool) -> tuple[tuple[tuple[str, int], ...], Array]:
        """Name and motion, -1 for all motions, of the columns of friction and offset, and the columns, shape (r, b)."""
        motions = np.unique(self.motion).tolist() if per_motion else [-1]
        names = [(name, which) for name in OWN for which in (motions if name != "off" else [-1])]
        columns = [np.where((self.motion == which) | (which < 0), self.own[name], 0.0) for name, which in names]
        return tuple(names), np.column_stack(columns)
