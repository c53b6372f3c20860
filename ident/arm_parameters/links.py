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

from ident.arm_parameters.parameter_values import Parameter
from ident.estimation.all_joints.pseudo_inertia import Bodies, nearest_possible
from ident.model.parameters import INERTIAL, STANDARD, pseudo_inertia
from ident.model.structure import BaseParameters
from ident.support.arrays import Array, Indices, Mask
from ident.support.errors import NoBody

LEFT = 1e-3
"""Smallest share of a model's link that remains: simulators cannot use a link with zero inertia about an axis."""
LEAST = 1e-10
"""Smallest relative eigenvalue of a correlation matrix that is used."""
UNIT = np.array([2.0, 0.0, 0.0, 2.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0])
"""Parameters of a pseudo-inertia with a fixed unit diagonal except the mass, which is any positive number.

It represents a motor's positive inertia as a body.
"""
SHOWN = 1e-9
"""Smallest share of a parameter in a base parameter above rounding."""
MASS = INERTIAL.index("M")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModelLinks:
    """Links of a model file, with parameters in the frames of an `Arm`.

    Attributes:
        own: Standard parameters of each moved link, shape (n, 10).
        carried: Standard parameters of the other bodies fixed to each link, shape (n, 10).
        motor: Inertias of the motors, joint side [kg m^2 or kg], shape (n,).
        offset: Origin of each frame in the link's frame of the file, with the same axes [m], shape (n, 3).
    """

    own: Array
    carried: Array
    motor: Array
    offset: Array

    @property
    def whole(self) -> Array:
        """Standard parameters of each link with the bodies fixed to it, shape (n, 10)."""
        return self.own + self.carried


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FoundLinks:
    """Physically consistent links.

    Attributes:
        own: Standard parameters of each link without the bodies fixed to it, shape (n, 10).
        motor: Inertias of the motors, shape (n,).
        motor_found: Mask of inertias that the base parameters contain; the others are the model's, shape (n,).
        moved: Change of each base parameter from its estimate, in standard deviations, shape (k,).
        names: Names of these base parameters.
    """

    own: Array
    motor: Array
    motor_found: Mask
    moved: Array
    names: tuple[str, ...]


def nearest_links(
    base: BaseParameters, found: Sequence[Parameter], covariance: Array, nominal: ModelLinks
) -> FoundLinks:
    """Return the physically consistent links nearest to the model's that the data allow.

    Args:
        base: Base parameters of the arm.
        found: Identified base parameters in SI, without friction and offsets.
        covariance: Covariance of their values, shape (k, k).
        nominal: The model's links.

    Raises:
        NoBody: If a link of the model is not physically consistent.
    """
    n = len(nominal.own)
    _check_bodies(nominal)
    rows = [base.names.index(each.name) for each in found]
    K, b, information = base.regrouping[rows], np.array([each.value for each in found]), _information(covariance)
    link = len(STANDARD) * np.arange(n)[:, None] + np.arange(len(INERTIAL))  # columns (n, 10)
    motors = _shown_motors(base, K)
    free, own = np.concatenate((link.ravel(), motors)), slice(10 * n)
    stated = np.array([nominal.motor[c // len(STANDARD)] if c < len(STANDARD) * n else 0.0 for c in motors])
    start = np.concatenate((nominal.own.ravel(), _positive(base, motors, found, nominal, stated)))
    centre = np.concatenate((nominal.own.ravel(), stated))
    M = K[:, free].T @ information @ K[:, free] + _prior(nominal.own, stated)
    known = K[:, link.ravel()] @ nominal.carried.ravel()
    wanted = centre + _solved(M, K[:, free].T @ (information @ (b - known - K[:, free] @ centre)))
    least = np.zeros(len(free))
    least[own] = LEFT * nominal.own.ravel()  # the excess must be physically consistent
    x = least + nearest_possible(_bodies(n, len(motors)), wanted - least, M, start - least)
    motor, motor_found = nominal.motor.copy(), np.isin(len(STANDARD) * np.arange(n) + len(INERTIAL), motors)
    motor[motor_found] = x[10 * n :][: int(motor_found.sum())]
    return FoundLinks(
        own=x[own].reshape(n, 10),
        motor=motor,
        motor_found=motor_found,
        moved=(known + K[:, free] @ x - b) / np.sqrt(np.diag(covariance)),
        names=tuple(each.name for each in found),
    )


def _check_bodies(nominal: ModelLinks) -> None:
    for j, chi in enumerate(nominal.own):
        if chi[MASS] <= 0.0 or np.linalg.eigvalsh(pseudo_inertia(chi))[0] <= 0.0:
            raise NoBody(
                f"link {j + 1} of the model is not physically consistent (its mass is {chi[MASS]:.3g} kg, "
                "or its moments of inertia are impossible); it cannot serve as a prior "
                "for parameters that the data do not determine; correct the model"
            )


def _shown_motors(base: BaseParameters, K: Array) -> Indices:
    """Return columns of motor inertias, coupled ones last, that are in base parameters with rows K."""
    motors = np.flatnonzero([name.startswith("Ia") for name in base.labels])
    return motors[np.abs(K[:, motors]).max(axis=0, initial=0.0) > SHOWN]


def _positive(
    base: BaseParameters, motors: Indices, found: Sequence[Parameter], nominal: ModelLinks, stated: Array
) -> Array:
    """Return positive initial motor inertias: estimates, values of the model, or typical ones."""
    value = {each.name: max(each.value, each.std) for each in found}
    usual = float(np.mean(nominal.own[:, [0, 3, 5]]))
    return np.array([value.get(base.labels[c], size or usual) for c, size in zip(motors, stated, strict=True)])


def _bodies(n: int, motors: int) -> Bodies:
    """Unknown links and motors."""
    return Bodies(
        known=np.vstack((np.zeros((n, 10)), np.tile(UNIT, (motors, 1)))),
        body=np.concatenate((np.repeat(np.arange(n), 10), n + np.arange(motors))),
        place=np.concatenate((np.tile(np.arange(10), n), np.full(motors, MASS, dtype=np.intp))),
    )


def _information(covariance: Array) -> Array:
    """Return the inverse of a covariance, from the eigenvalues of the correlation."""
    scale = np.sqrt(np.diag(covariance))
    size, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
    return (axes / np.maximum(size, LEAST * size[-1])) @ axes.T / np.outer(scale, scale)


def _prior(own: Array, motor: Array) -> Array:
    """Return the coordinate-invariant metric of links, and that of motors, zero if the model states none."""
    k = own.size
    G = np.zeros((k + len(motor), k + len(motor)))
    basis = [pseudo_inertia(unit) for unit in np.eye(len(INERTIAL))]
    for j, chi in enumerate(own):
        relative = [np.linalg.solve(pseudo_inertia(chi), each) for each in basis]
        block = slice(10 * j, 10 * j + 10)
        G[block, block] = [[0.5 * float(np.sum(a * b.T)) for b in relative] for a in relative]
    G[np.arange(k, len(G)), np.arange(k, len(G))] = np.divide(1.0, motor**2, out=np.zeros(len(motor)), where=motor > 0)
    return G


def _solved(M: Array, right: Array) -> Array:
    scale = 1.0 / np.sqrt(np.diag(M))
    return scale * np.linalg.solve(M * np.outer(scale, scale), scale * right)
