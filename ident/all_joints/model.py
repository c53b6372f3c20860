"""What the model of all joints holds besides rigid links, viscous and Coulomb friction."""

from dataclasses import dataclass

FRICTIONS: dict[str, tuple[str, ...]] = {
    "viscous-coulomb": (),
    "cbrt": ("cbrt",),
    "load": ("load",),
    "load-motor": ("load-motor",),
    "load+cbrt": ("load", "cbrt"),
}
"""Further friction columns of every joint by name.

`cbrt`: the cube root of the velocity; `load`: |torque of links and payload| sign(dq); `load-motor`: |motor torque|
sign(dq).
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnModel:
    """Choices of the model.

    Attributes:
        friction: Further friction columns of every joint.
        per_motion: Whether viscous and Coulomb friction differ between motions.
        compliance: Whether joints yield, one compliance each.
        prior_std: Deviation of log|h| that is allowed around the start.
    """

    friction: tuple[str, ...]
    per_motion: bool
    compliance: bool
    prior_std: float
