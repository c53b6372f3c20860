"""What a motion must respect: range, speed, acceleration and torque of every joint, and distances."""

from dataclasses import dataclass

import numpy as np

from ident.model.arm import load_arm
from ident.support.arrays import Array
from sim.errors import RobotError
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
KINDS = (("range", RANGE_SHARE), ("speed", SHARE), ("acceleration", SHARE), ("torque", TORQUE_SHARE))
"""Limits in the order of `excess_of`, and the share of each that a motion may use."""
HALF_TURN = np.pi
"""Way from home to either side of a joint that turns without end [rad]; assumed, cables are wound up."""


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
    """Limits of a plant's robot, with the plant's drives; half a turn to either side of home where a joint has no end.

    Raises:
        RobotError: If a joint slides without end.
    """
    robot = plant.robot
    arm = load_arm(robot.model, flange=robot.flange)
    endless = ~np.isfinite(arm.upper - arm.lower)
    for j in np.flatnonzero(endless & (arm.revolute == 0)):
        raise RobotError(
            f"robot {robot.name}: joint {arm.joint_names[j]} slides without a range; state one in {robot.model}"
        )
    return Limits(
        lower=np.where(endless, robot.home - HALF_TURN, arm.lower),
        upper=np.where(endless, robot.home + HALF_TURN, arm.upper),
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


def worst_of(excess: Array, names: tuple[str, ...]) -> str:
    """Which limit a motion breaks most, in words.

    Args:
        excess: That of `excess_of`, shape (4 N, n).
        names: Of the joints.
    """
    by_kind = excess.reshape(len(KINDS), -1, len(names))
    kind, _, joint = np.unravel_index(int(by_kind.argmax()), by_kind.shape)
    what, share = KINDS[int(kind)]
    used = 100.0 * (float(excess.max()) + share)
    return f"takes {used:.0f} % of the {what} of joint {names[int(joint)]}, where {100.0 * share:g} % may be used"


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
