"""Names and order of the standard dynamic parameters (paper, eq. 10).

Joint and link j carry fourteen: the inertia matrix at the origin of frame j, the first moment, the
mass, the rotor inertia, and the friction and offset of the drive. Every regressor column, estimate
and label in this package follows this order.
"""

INERTIAL = ("XX", "XY", "XZ", "YY", "YZ", "ZZ", "MX", "MY", "MZ", "M")
DRIVE = ("Ia", "Fv", "Fc", "off")
STANDARD = INERTIAL + DRIVE
UNITS = {
    **dict.fromkeys(("XX", "XY", "XZ", "YY", "YZ", "ZZ", "Ia"), "kg m^2"),
    **dict.fromkeys(("MX", "MY", "MZ"), "kg m"),
    "M": "kg",
    "Fv": "N m s/rad",
    "Fc": "N m",
    "off": "N m",
}


def labels(n_joints: int) -> tuple[str, ...]:
    """Column labels of the standard regressor, `XX1` to `offn`, shape (14 n,).

    Example:
        >>> labels(1)[:3], len(labels(6))
        (('XX1', 'XY1', 'XZ1'), 84)
    """
    return tuple(f"{name}{j + 1}" for j in range(n_joints) for name in STANDARD)
