"""Mass, centre and inertia of every link: the physically consistent links nearest to the model's that the data allow.

Data determine only the base parameters b = K chi, with a covariance C; the model determines the other combinations of
the standard parameters chi. With P_i0 the pseudo-inertia of link i in the model, chi is the minimum of

    (K chi - b)' C^-1 (K chi - b) + sum_i tr(P_i0^-1 (P_i - P_i0) P_i0^-1 (P_i - P_i0)) / 2,    P_i >= LEFT P_i0,

where the second term is the coordinate-invariant distance between bodies (Lee, Wensing and Park 2020, eq. 21) with unit
standard deviation, which acts where data have no information. Inertias of motors are any positive numbers, near to the
model's if stated. If only the sum with a link's inertia is identifiable, the motor has the remainder.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from ident.model.parameters import INERTIAL, PSEUDO_INERTIAS, STANDARD, pseudo_inertia
from ident.model.structure import BaseParameters
from ident.parameters.arm import Quantity
from ident.support.arrays import Array, Mask
from ident.support.errors import RobotModelError

LEFT = 1e-3
"""Smallest share of a model's link that remains: simulators cannot use a link with zero inertia about an axis."""
LEAST = 1e-10
"""Smallest relative eigenvalue of a correlation matrix that is used."""
SHOWN = 1e-9
"""Smallest share of a parameter in a base parameter above rounding."""
MASS = INERTIAL.index("M")
SMALLEST_BARRIER = 1e-11
"""Final weight of the barrier, in units of the squared distance."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModelLinks:
    """Links of a model file, with parameters in the frames of an `Arm`."""

    own: Array  # standard parameters of each moved link, shape (n, 10)
    carried: Array  # standard parameters of the other bodies fixed to each link, shape (n, 10)
    motor: Array  # inertias of the motors, joint side [kg m^2 or kg], shape (n,)
    offset: Array  # origin of each frame in the link's frame of the file, with the same axes [m], shape (n, 3)

    @property
    def whole(self) -> Array:
        """Standard parameters of each link with the bodies fixed to it, shape (n, 10)."""
        return self.own + self.carried


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FoundLinks:
    """Physically consistent links."""

    own: Array  # standard parameters of each link without the bodies fixed to it, shape (n, 10)
    motor: Array  # inertias of the motors, shape (n,)
    motor_found: Mask  # mask of inertias that the base parameters contain; the others are the model's, shape (n,)
    moved: Array  # change of each base parameter from its estimate, in standard deviations, shape (k,)
    names: tuple[str, ...]  # names of these base parameters


def nearest_links(
    base: BaseParameters, found: Sequence[Quantity], covariance: Array, nominal: ModelLinks
) -> FoundLinks:
    """Return the physically consistent links nearest to the model's that the data allow.

    `found` are identified base parameters in SI, without friction and offsets, with the covariance (k, k). Raises
    `RobotModelError` if a link of the model is not physically consistent.
    """
    n, p, size = len(nominal.own), len(STANDARD), len(INERTIAL)
    for j, chi in enumerate(nominal.own):
        if chi[MASS] <= 0.0 or np.linalg.eigvalsh(pseudo_inertia(chi))[0] <= 0.0:
            raise RobotModelError(
                f"link {j + 1} of the model is not physically consistent (its mass is {chi[MASS]:.3g} kg, "
                "or its moments of inertia are impossible); it cannot serve as a prior "
                "for parameters that the data do not determine; correct the model",
                joint=j,
                value=float(chi[MASS]),
            )
    K = base.regrouping[[base.names.index(each.name) for each in found]]
    b, information = np.array([each.value for each in found]), _information(covariance)
    link = (p * np.arange(n)[:, None] + np.arange(size)).ravel()  # columns of the links
    motors = np.flatnonzero([name.startswith("Ia") for name in base.labels])  # coupled ones last
    motors = motors[np.abs(K[:, motors]).max(axis=0, initial=0.0) > SHOWN]
    stated = np.array([nominal.motor[c // p] if c < p * n else 0.0 for c in motors])
    free, own, m = np.concatenate((link, motors)), nominal.own.ravel(), len(motors)
    # initial inertias of motors: estimates, values of the model, or typical ones
    value = {each.name: max(each.value, each.std) for each in found}
    usual = float(np.mean(nominal.own[:, [0, 3, 5]]))
    positive = [value.get(base.labels[c], inertia or usual) for c, inertia in zip(motors, stated.tolist(), strict=True)]
    start, centre = np.concatenate((own, positive)), np.concatenate((own, stated))
    M = K[:, free].T @ information @ K[:, free] + _prior(nominal.own, stated)
    known = K[:, link] @ nominal.carried.ravel()
    scale = 1.0 / np.sqrt(np.diag(M))
    right = scale * (K[:, free].T @ (information @ (b - known - K[:, free] @ centre)))
    wanted = centre + scale * np.linalg.solve(M * np.outer(scale, scale), right)
    least = np.concatenate((LEFT * own, np.zeros(m)))  # the excess must be physically consistent
    fixed, slopes = np.zeros((n + m, 4, 4)), np.zeros((size * n + m, n + m, 4, 4))
    for j in range(n):
        slopes[size * j : size * (j + 1), j] = PSEUDO_INERTIAS
    for k in range(m):  # a motor is a body with a unit diagonal, and its inertia as mass
        fixed[n + k, :3, :3], slopes[size * n + k, n + k] = np.eye(3), PSEUDO_INERTIAS[MASS]
    x = least + nearest_possible(fixed, slopes, wanted - least, M, start - least)
    motor, motor_found = nominal.motor.copy(), np.isin(p * np.arange(n) + size, motors)
    motor[motor_found] = x[size * n :][: np.count_nonzero(motor_found)]
    return FoundLinks(
        own=x[: size * n].reshape(n, size),
        motor=motor,
        motor_found=motor_found,
        moved=(known + K[:, free] @ x - b) / np.sqrt(np.diag(covariance)),
        names=tuple(each.name for each in found),
    )


def _information(covariance: Array) -> Array:
    """Return the inverse of a covariance, from the eigenvalues of the correlation."""
    scale = np.sqrt(np.diag(covariance))
    size, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
    return (axes / np.maximum(size, LEAST * size[-1])) @ axes.T / np.outer(scale, scale)


def _prior(own: Array, motor: Array) -> Array:
    """Return the coordinate-invariant metric of links, and that of motors, zero if the model states none."""
    relative = [np.linalg.solve(pseudo_inertia(chi), PSEUDO_INERTIAS) for chi in own]
    links = [0.5 * np.einsum("aij,bji->ab", each, each) for each in relative]
    motors = np.divide(1.0, motor**2, out=np.zeros(len(motor)), where=motor > 0)
    return block_diag(*links, *([np.diag(motors)] if len(motor) else []))


def nearest_possible(fixed: Array, slopes: Array, wanted: Array, information: Array, inside: Array) -> Array:
    """Return unknowns nearest to given ones with positive definite pseudo-inertias, by a log det barrier, (k,).

    Pseudo-inertias of bodies are `fixed`, (bodies, 4, 4), plus `slopes`, (k, bodies, 4, 4), times the unknowns, which
    start `inside`. The squared distance from `wanted` in the metric `information`, (k, k), exceeds its minimum by at
    most `SMALLEST_BARRIER` times the number of rows of all pseudo-inertias.
    """

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
        for _ in range(100):
            step, promised = step_from(x, weight)
            if promised < 1e-12:  # in units of the weight
                break
            length, before = 1.0, cost(x, weight)
            while np.linalg.eigvalsh(fixed + np.tensordot(x + length * step, slopes, 1)).min() <= 0.0 or (
                cost(x + length * step, weight) > before - 0.1 * length * promised and length > 1e-9
            ):
                length *= 0.5
            x = x + length * step
        weight *= 0.1
    return x
