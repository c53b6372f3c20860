"""Names and order of the standard dynamic parameters (paper, eq. 10).

Joint and link j have fourteen: the inertia matrix at the origin of frame j, the first moment, the
mass, the rotor inertia, and the friction and offset of the drive. Every regressor column, estimate
and label in this package follows this order. Inertial parameters are physically consistent if the pseudo-inertia is
positive definite.
"""

from collections.abc import Sequence

import numpy as np

from ident.support.arrays import Array, readonly

INERTIAL = ("XX", "XY", "XZ", "YY", "YZ", "ZZ", "MX", "MY", "MZ", "M")
DRIVE = ("Ia", "Fv", "Fc", "off")
STANDARD = INERTIAL + DRIVE
COUPLING = ("Iam", "Fvm", "Fcm")
"""Parameters of a motor that turns with the sum of two joints: inertia, viscous and Coulomb friction."""
UNITS = {
    **dict.fromkeys(("XX", "XY", "XZ", "YY", "YZ", "ZZ", "Ia", "Iam"), "kg m^2"),
    **dict.fromkeys(("MX", "MY", "MZ"), "kg m"),
    "M": "kg",
    **dict.fromkeys(("Fv", "Fvm"), "N m s/rad"),
    **dict.fromkeys(("Fc", "Fcm", "off"), "N m"),
}
"""Units by name, for a revolute joint."""
SLIDING = {
    **dict.fromkeys(("Ia", "Iam"), "kg"),
    **dict.fromkeys(("Fv", "Fvm"), "N s/m"),
    **dict.fromkeys(("Fc", "Fcm", "off"), "N"),
}
"""Units that differ for the drive of a prismatic joint."""


def unit_of(label: str, revolute: Sequence[bool]) -> str:
    """Return the unit of a parameter by its label, `Ia3`, for revolute and prismatic joints.

    Example:
        >>> unit_of("Ia2", (True, False)), unit_of("ZZ2", (True, False)), unit_of("Ia1", (True, False))
        ('kg', 'kg m^2', 'kg m^2')
    """
    name = label.rstrip("0123456789")
    turns = revolute[int(label[len(name) :]) - 1]
    return UNITS[name] if turns else SLIDING.get(name, UNITS[name])


def labels(n_joints: int, couplings: Sequence[tuple[int, int]] = ()) -> tuple[str, ...]:
    """Return column labels of the standard regressor: `XX1` to `offn`, then three per coupling; 14 n + 3 c strings.

    Example:
        >>> labels(1)[:3], len(labels(6))
        (('XX1', 'XY1', 'XZ1'), 84)
        >>> labels(6, [(4, 5)])[-3:]
        ('Iam6', 'Fvm6', 'Fcm6')
    """
    joints = tuple(f"{name}{j + 1}" for j in range(n_joints) for name in STANDARD)
    return joints + tuple(f"{name}{second + 1}" for _, second in couplings for name in COUPLING)


def pseudo_inertia(chi: Array) -> Array:
    """Pseudo-inertia [[tr(J)/2 - J, m c], [m c, m]], shape (..., 4, 4) (Wensing, Kim and Slotine 2018, eq. 7).

    The standard parameters `chi`, shape (..., 10), are in the order of `INERTIAL`.
    """
    return np.tensordot(chi, PSEUDO_INERTIAS, 1)


def _pseudo_inertias() -> Array:
    P = np.zeros((len(INERTIAL), 4, 4))
    for own, a, b in zip(P, *np.triu_indices(3), strict=False):
        own[a, b] = own[b, a] = -1.0
        own[:3, :3] += 0.5 * (a == b) * np.eye(3)
    k = np.arange(3)
    P[6 + k, k, 3] = P[6 + k, 3, k] = P[9, 3, 3] = 1.0
    return readonly(P)


PSEUDO_INERTIAS = _pseudo_inertias()
"""Pseudo-inertia of each of the standard parameters `INERTIAL`, shape (10, 4, 4)."""
