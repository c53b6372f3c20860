"""The drives of an arm: gains, offsets, inertias and friction."""

from dataclasses import dataclass, fields

import numpy as np

from ident.support.arrays import Array
from sim.errors import DriveError

LARGEST = 1e9
"""Largest absolute value of any parameter of a drive, in SI units or drive units."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriveTruth:
    """True parameters of the drives, joint side; every array has shape (n,).

    Attributes:
        gain: g [N m / drive unit]; negative for a drive wired backwards, never zero.
        amplifier_offset: v0 [drive units].
        rotor_inertia: Ia [kg m^2].
        viscous_friction: Fv [N m s/rad].
        coulomb_friction: Fc [N m].
        coulomb_asymmetry: Fcoff [N m].
        current_limit: Saturation of the current reference [drive units].

    Raises:
        DriveError: If shapes differ, or a value is impossible.
    """

    gain: Array
    amplifier_offset: Array
    rotor_inertia: Array
    viscous_friction: Array
    coulomb_friction: Array
    coulomb_asymmetry: Array
    current_limit: Array

    def __post_init__(self) -> None:
        """Check shapes and signs."""
        n = len(self.gain)
        for name in (drive.name for drive in fields(self)):
            values = np.asarray(getattr(self, name), dtype=np.float64)
            if values.shape != (n,) or not np.isfinite(values).all():
                raise DriveError(f"drives: {name} {values.tolist()}: expected {n} finite numbers")
            if (np.abs(values) > LARGEST).any():
                raise DriveError(f"drives: {name} {values.tolist()}: expected {LARGEST:g} at most")
            if name not in ("gain", "amplifier_offset", "coulomb_asymmetry") and (values < 0.0).any():
                raise DriveError(f"drives: {name} {values.tolist()} has a negative value")
        if not np.asarray(self.gain).all():
            raise DriveError(f"drives: gain {np.asarray(self.gain).tolist()} has a zero")
