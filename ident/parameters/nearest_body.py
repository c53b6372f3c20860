"""Physical consistency of inertial parameters: a positive semidefinite pseudo-inertia."""

from dataclasses import dataclass

import numpy as np

from ident.model.parameters import INERTIAL, pseudo_inertia
from ident.support.arrays import Array, Indices

SMALLEST_BARRIER, SMALLER = 1e-11, 0.1
"""Final weight of the barrier, in units of the squared distance, and the factor between successive weights."""
MOST_STEPS = 100
ENOUGH = 1e-12
"""Predicted decrease of a Newton step, in units of the weight, below which the next weight is used."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bodies:
    """Parameters of one or more bodies, some of them unknown.

    Attributes:
        known: Values of the known ones, zero for the unknown, shape (bodies, 10).
        body: Body of each unknown, shape (k,).
        place: Index of each unknown in `INERTIAL`, shape (k,).
    """

    known: Array
    body: Indices
    place: Indices

    @property
    def fixed(self) -> Array:
        """Pseudo-inertias of the known parameters, shape (bodies, 4, 4)."""
        return np.array([pseudo_inertia(chi) for chi in self.known])

    @property
    def slopes(self) -> Array:
        """Derivative of the pseudo-inertias by each unknown, shape (k, bodies, 4, 4)."""
        slopes = np.zeros((len(self.body), len(self.known), 4, 4))
        for k, (body, place) in enumerate(zip(self.body, self.place, strict=True)):
            slopes[k, body] = pseudo_inertia(np.eye(len(INERTIAL))[place])
        return slopes


def nearest_possible(bodies: Bodies, wanted: Array, information: Array, inside: Array) -> Array:
    """Return the physically consistent unknowns nearest to given ones: a convex problem, by a log det barrier.

    Args:
        bodies: The bodies.
        wanted: The given values, shape (k,).
        information: Metric, positive definite, shape (k, k).
        inside: Initial values with positive definite pseudo-inertia, shape (k,).

    Returns:
        Unknowns with positive definite pseudo-inertia; their squared distance exceeds the minimum by at most
        `SMALLEST_BARRIER` times the number of rows of all pseudo-inertias. Shape (k,).
    """
    fixed, slopes = bodies.fixed, bodies.slopes

    def cost(x: Array, weight: float) -> float:
        sign, size = np.linalg.slogdet(fixed + np.tensordot(x, slopes, 1))
        off = x - wanted
        return 0.5 * float(off @ information @ off) / weight - float(size.sum()) if (sign > 0.0).all() else np.inf

    def step_from(x: Array, weight: float) -> tuple[Array, float]:
        solved = np.linalg.solve(fixed + np.tensordot(x, slopes, 1), slopes)  # (k, bodies, 4, 4)
        gradient = information @ (x - wanted) / weight - np.einsum("kbii->k", solved)
        curvature = information / weight + np.einsum("kbij,lbji->kl", solved, solved)
        scale = 1.0 / np.sqrt(np.diag(curvature))
        step = -scale * np.linalg.solve(curvature * np.outer(scale, scale), scale * gradient)
        return step, float(-gradient @ step)

    x, weight = inside, 1.0
    while weight > SMALLEST_BARRIER:
        for _ in range(MOST_STEPS):
            step, promised = step_from(x, weight)
            if promised < ENOUGH:
                break
            length, before = 1.0, cost(x, weight)
            while np.linalg.eigvalsh(fixed + np.tensordot(x + length * step, slopes, 1)).min() <= 0.0 or (
                cost(x + length * step, weight) > before - 0.1 * length * promised and length > 1e-9
            ):
                length *= 0.5
            x = x + length * step
        weight *= SMALLER
    return x
