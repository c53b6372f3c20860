"""Dry friction that varies in time: stronger near standstill, and with the torque that a drive transmits.

    Fc (1 + stribeck exp(-(dq / stribeck_speed)^2)) + load_friction |g (v - v0)|

The first part holds for a coupled motor too, at the speed that it turns with; the second acts on the drive's own joint.
"""

from dataclasses import dataclass

import numpy as np

from ident.arrays import Array
from sim.plant import Plant


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrictionLaw:
    """Varying dry friction of one simulation, or with a leading axis B that of several.

    Attributes:
        constant: Dry friction at high speed and without load: n joints, then c coupled motors [N m], shape (n + c,).
        turns: Speeds that they rub at, as sums of joint speeds, shape (n + c, n).
        stribeck: Extra near standstill, as a share, shape (1,).
        stribeck_speed: Speed at which it has fallen to 37 % [rad/s], shape (1,).
        load_gain: Dry friction per unit of current [N m / drive unit], shape (n,).
        amplifier_offset: v0 [drive units], shape (n,).
    """

    constant: Array
    turns: Array
    stribeck: Array
    stribeck_speed: Array
    load_gain: Array
    amplifier_offset: Array


def friction_law(plant: Plant, constant: Array) -> FrictionLaw | None:
    """How the dry friction of a plant varies, None if it is constant.

    Args:
        plant: The truth.
        constant: Constant dry friction of its joints, then of its coupled motors [N m], shape (n + c,).
    """
    errors, n = plant.errors, plant.robot.n
    if not errors.stribeck and not errors.load_friction:
        return None
    turns = np.eye(len(constant), n)
    for row, coupling in zip(turns[n:], plant.robot.couplings, strict=False):  # no coupled motors: no row
        row[[coupling.motor, coupling.turns_with]] = 1.0
    return FrictionLaw(
        constant=constant,
        turns=turns,
        stribeck=np.array([errors.stribeck]),
        stribeck_speed=np.array([errors.stribeck_speed]),
        load_gain=errors.load_friction * np.abs(plant.drives.gain),
        amplifier_offset=np.array(plant.drives.amplifier_offset, dtype=np.float64),
    )


def dry_friction(law: FrictionLaw, dq: Array, v: Array) -> Array:
    """Dry friction of the joints and of the coupled motors [N m], shape (B, n + c).

    Args:
        law: Laws of B simulations.
        dq: Speeds of the driven joints [rad/s], shape (B, n).
        v: Currents [drive units], shape (B, n).
    """
    speed = (law.turns @ dq[:, :, None])[:, :, 0]
    friction = law.constant * (1.0 + law.stribeck * np.exp(-((speed / law.stribeck_speed) ** 2)))
    friction[:, : dq.shape[1]] += law.load_gain * np.abs(v - law.amplifier_offset)
    return friction
