"""Parts of the model of all joints: each joint's currents, shared columns, known torque and own columns."""

from dataclasses import dataclass

import numpy as np

from ident.estimation.problem import Problem
from ident.model.parameters import INERTIAL
from ident.model.structure import BaseParameters, Structure, independent_columns
from ident.support.arrays import Array, Indices

OWN = ("Fv", "Fc", "off")
"""Parameters that act on one joint only; they are estimated in drive units."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Base:
    """Orthonormal basis of the columns from positions that all fits of a joint have, and their coordinates in it.

    Attributes:
        Q: The basis, shape (r, m).
        own: Friction and offset, by name and motion, -1 for all motions, each of shape (m,).
        A: The first of the shared columns, shape (m, p).
        k: Known torque, shape (m,).
        payload: Ten columns of each mounting, shape (m, 10 mountings).
    """

    Q: Array
    own: dict[tuple[str, int], Array]
    A: Array
    k: Array
    payload: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointColumns:
    """Rows of one joint, the motions one after the other.

    Attributes:
        joint: The joint, from 0.
        V: Currents [drive units], shape (r,).
        shared: A: columns of the parameters that joints share, shape (r, p).
        known: k: torque of the known payload parameters [N m], shape (r,).
        own: Columns of viscous friction, Coulomb friction and offset by name, those of `OWN` that no shared parameter
            replaces, each of shape (r,).
        payload: Ten columns of each mounting, zero in the rows of other motions, shape (mountings, r, 10).
        motion: Motion of each row, shape (r,).
        position: Number of each row in its motion, including omitted rows, shape (r,).
        base: Basis of the columns common to all fits, None if not prepared.
    """

    joint: int
    V: Array
    shared: Array
    known: Array
    own: dict[str, Array]
    payload: Array
    motion: Indices
    position: Indices
    base: Base | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SharedParameters:
    """The parameters that joints share.

    Attributes:
        arm: Indices of the arm's shared parameters among its base parameters, shape (a,).
        free: Independent unknown parameters of each mounting, index arrays into `INERTIAL`.
        known: Values of each mounting's known parameters, zero for the others, shape (mountings, 10).
        spread: Factor F of the covariance F F^T of each mounting's known parameters, shape (mountings, 10, 10).
    """

    arm: Indices
    free: tuple[Indices, ...]
    known: Array
    spread: Array

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


def shared_parameters(problem: Problem) -> SharedParameters:
    """Return the shared parameters of a problem."""
    probes = np.vstack(list(problem.structure.payload_probes))
    known = [payload.known_part() for payload in problem.payloads]
    return SharedParameters(
        arm=shared_arm(problem.structure.base),
        free=tuple(np.sort(independent_columns(probes, [np.flatnonzero(~each.mask)])) for each in known),
        known=np.array([np.where(each.mask, each.chi, 0.0) for each in known]).reshape(len(known), len(INERTIAL)),
        spread=np.array([each.spread for each in known]).reshape(len(known), len(INERTIAL), len(INERTIAL)),
    )


def joint_columns(problem: Problem, shared: SharedParameters) -> tuple[JointColumns, ...]:
    """Rows of every joint."""
    return tuple(_of_joint(problem, shared, joint) for joint in range(problem.structure.arm.n))


def _of_joint(problem: Problem, shared: SharedParameters, joint: int) -> JointColumns:
    structure, payloads = problem.structure, problem.payloads
    parts = [motion.observation.joints[joint] for motion in problem.motions]
    lengths = [len(part.V) for part in parts]
    W = np.zeros((sum(lengths), len(structure.base.columns)))
    W[:, parts[0].columns] = np.vstack([part.W for part in parts])
    payload = np.zeros((len(payloads), sum(lengths), len(INERTIAL)))
    starts = np.cumsum([0, *lengths])
    for k, (motion, part) in enumerate(zip(problem.motions, parts, strict=True)):
        for which, mounted in enumerate(payloads):
            if motion.payload is mounted:
                payload[which, starts[k] : starts[k + 1]] = part.W_L
    free = [columns[:, each] for columns, each in zip(payload, shared.free, strict=True)]
    return JointColumns(
        joint=joint,
        V=np.concatenate([part.V for part in parts]),
        shared=np.hstack([W[:, shared.arm], *free]),
        known=np.einsum("krp,kp->r", payload, shared.known),
        own=_own_columns(structure, joint, W),
        payload=payload,
        motion=np.repeat(np.arange(len(parts)), lengths),
        position=np.concatenate([part.position for part in parts]),
    )


def _own_columns(structure: Structure, joint: int, W: Array) -> dict[str, Array]:
    places = {name: f"{name}{joint + 1}" for name in OWN}
    names = structure.base.names
    return {name: W[:, names.index(place)] for name, place in places.items() if place in names}
