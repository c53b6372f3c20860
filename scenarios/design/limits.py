"""What a motion must respect: range, speed, acceleration and torque of every joint, and distances."""

from dataclasses import dataclass

import numpy as np

from ident.arm import load_arm
from ident.arrays import Array
from sim.plant import Plant
from sim.trajectory import FourierTrajectory

SHARE = 0.95
"""Share of a velocity or acceleration limit that a motion may use."""
RANGE_SHARE = 0.9
"""Share of each joint's position range."""
TORQUE_SHARE = 0.8
"""Share of the torque at the current limit."""
CLEARANCE = 0.03
"""Smallest distance to the floor and to the arm itself [m]."""
UNLIMITED = np.pi
"""How far a joint without limits goes to either side [rad, m]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Limits:
    """Bounds on a motion; arrays are (n,), in rad for revolute and in m for prismatic joints.

    Attributes:
        lower: Positions [rad].
        upper: Positions [rad].
        velocity: [rad/s].
        acceleration: [rad/s^2].
        torque: Joint torque at the current limit [N m].
    """

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    torque: Array


def robot_limits(plant: Plant) -> Limits:
    """Limits of a plant's robot, with the plant's drives; a joint without range is kept within `UNLIMITED`."""
    robot, ranges = plant.robot, load_arm(plant.robot.model)
    return Limits(
        lower=np.where(np.isinf(ranges.lower), -UNLIMITED, ranges.lower),
        upper=np.where(np.isinf(ranges.upper), UNLIMITED, ranges.upper),
        velocity=robot.max_velocity,
        acceleration=robot.max_acceleration,
        torque=plant.drives.current_limit * np.abs(plant.drives.gain),
    )


def excess_of(limits: Limits, motion: tuple[Array, Array, Array], torques: Array) -> Array:
    """How far a motion breaks its limits, relative to them; all entries zero if it keeps them.

    Args:
        limits: The bounds.
        motion: q, dq, ddq, each (N, n).
        torques: Without and with payload [N m], shape (2, N, n).

    Returns:
        Positions, speeds, accelerations and torques, shape (4 N, n).
    """
    q, dq, ddq = motion
    center, half = 0.5 * (limits.upper + limits.lower), 0.5 * (limits.upper - limits.lower)
    over = [
        np.abs(q - center) / half - RANGE_SHARE,
        np.abs(dq) / limits.velocity - SHARE,
        np.abs(ddq) / limits.acceleration - SHARE,
        np.abs(torques).max(axis=0) / limits.torque - TORQUE_SHARE,
    ]
    return np.maximum(np.concatenate(over), 0.0)


def largest_scale(limits: Limits, trajectory: FourierTrajectory) -> Array:
    """Factor on each joint's motion about its centre that just keeps range, velocity and acceleration, (n,)."""
    q, dq, ddq = trajectory(np.arange(0.0, trajectory.duration, 1.0 / 50.0))
    center = trajectory.center
    room = RANGE_SHARE * np.minimum(limits.upper - center, center - limits.lower)
    return np.minimum.reduce(
        [
            room / np.abs(q - center).max(axis=0),
            SHARE * limits.velocity / np.abs(dq).max(axis=0),
            SHARE * limits.acceleration / np.abs(ddq).max(axis=0),
        ]
    )
