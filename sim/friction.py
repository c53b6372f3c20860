"""Dry friction that varies in time: stronger near standstill, and with the torque that a drive transmits.

    Fc (1 + stribeck exp(-(dq / stribeck_speed)^2)) + load_friction |g (v - v0)|

The first part holds for the wrist coupling too, with the speed dq5 + dq6 of the motor; the second acts on the drive's
own joint.
"""

from dataclasses import dataclass

import numpy as np

from ident.arrays import Array
from sim.mechanisms import WRIST
from sim.plant import Plant


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrictionLaw:
    """Varying dry friction of one simulation, or with a leading axis B that of several.

    Attributes:
        constant: Dry friction at high speed and without load: n joints, then the wrist coupling [N m], shape (n + 1,).
        stribeck: Extra near standstill, as a share, shape (1,).
        stribeck_speed: Speed at which it has fallen to 37 % [rad/s], shape (1,).
        load_gain: Dry friction per unit of current [N m / drive unit], shape (n,).
        amplifier_offset: v0 [drive units], shape (n,).
    """

    constant: Array
    stribeck: Array
    stribeck_speed: Array
    load_gain: Array
    amplifier_offset: Array


def friction_law(plant: Plant, joints: Array, coupling: float) -> FrictionLaw | None:
    """How the dry friction of a plant varies, None if it is constant.

    Args:
        plant: The truth.
        joints: Its constant dry friction [N m], shape (n,).
        coupling: That of the wrist coupling, 0 if there is none [N m].
    """
    errors = plant.errors
    if not errors.stribeck and not errors.load_friction:
        return None
    return FrictionLaw(
        constant=np.append(joints, coupling),
        stribeck=np.array([errors.stribeck]),
        stribeck_speed=np.array([errors.stribeck_speed]),
        load_gain=errors.load_friction * np.abs(plant.drives.gain),
        amplifier_offset=np.array(plant.drives.amplifier_offset, dtype=np.float64),
    )


def dry_friction(law: FrictionLaw, dq: Array, v: Array) -> Array:
    """Dry friction of the joints and of the wrist coupling [N m], shape (B, n + 1).

    Args:
        law: Laws of B simulations.
        dq: Speeds of the driven joints [rad/s], shape (B, n).
        v: Currents [drive units], shape (B, n).
    """
    B, n = dq.shape
    speed = np.zeros((B, n + 1))
    speed[:, :n] = dq
    if n > max(WRIST):
        speed[:, n] = dq[:, WRIST].sum(axis=1)
    friction = law.constant * (1.0 + law.stribeck * np.exp(-((speed / law.stribeck_speed) ** 2)))
    friction[:, :n] += law.load_gain * np.abs(v - law.amplifier_offset)
    return friction
