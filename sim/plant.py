"""The plant: everything that is true of the simulated robot, and that identification must not see."""

from dataclasses import dataclass, field, fields
from pathlib import Path

import numpy as np

from ident.arrays import Array
from sim.errors import PlantError
from sim.model_errors import ModelErrors


@dataclass(frozen=True, slots=True, kw_only=True)
class PayloadBody:
    """A rigid body on the flange, in the frame of the last link.

    Attributes:
        mass: [kg].
        com: Centre of mass [m].
        inertia: ixx, iyy, izz, ixy, ixz, iyz about the centre of mass [kg m^2].
    """

    mass: float
    com: tuple[float, float, float]
    inertia: tuple[float, float, float, float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriveTruth:
    """The drives as they are, joint side; every array has shape (n,).

    Attributes:
        gain: g [N m / drive unit]; negative for a drive wired backwards, never zero.
        amplifier_offset: v0 [drive units].
        rotor_inertia: Ia [kg m^2].
        viscous_friction: Fv [N m s/rad].
        coulomb_friction: Fc [N m].
        coulomb_asymmetry: Fcoff [N m].
        current_limit: Saturation of the current reference [drive units].
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
                raise PlantError(f"drives: {name} {values.tolist()}: expected {n} finite numbers")
            if name not in ("gain", "amplifier_offset", "coulomb_asymmetry") and (values < 0.0).any():
                raise PlantError(f"drives: {name} {values.tolist()} has a negative value")
        if not np.asarray(self.gain).all():
            raise PlantError(f"drives: gain {np.asarray(self.gain).tolist()} has a zero")


@dataclass(frozen=True, slots=True, kw_only=True)
class Plant:
    """The whole truth of one robot.

    Attributes:
        mjcf: Model file of the bare arm; bodies, joints and actuators from base to flange.
        drives: Its drives.
        payload: What the loaded motions carry.
        errors: What it has and the identification model has not.

    Raises:
        PlantError: If compliances do not fit the drives.
    """

    mjcf: Path
    drives: DriveTruth
    payload: PayloadBody
    errors: ModelErrors = field(default_factory=ModelErrors)

    def __post_init__(self) -> None:
        """Check that the errors fit the drives."""
        compliance, n = self.errors.joint_compliance, len(self.drives.gain)
        if compliance is not None and len(compliance) != n:
            raise PlantError(
                f"errors: joint_compliance: {len(compliance)} values [rad/(N m)], expected {n}, one a joint"
            )
