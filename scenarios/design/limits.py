"""Limits of a motion: range, speed, acceleration and torque of every joint."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ident.model.arm import load_arm
from ident.support.arrays import Array
from sim.errors import RobotError
from sim.plant import Plant
from sim.trajectory import FourierTrajectory

SHARES = {"range": 0.9, "speed": 0.95, "acceleration": 0.95, "torque": 0.8}
"""Share of each joint's limits that a designed motion may use, except that of the torque, `Limits.torque_share`."""
HALF_TURN = np.pi
"""Range to either side for a joint without limits [rad]; assumed because of cables."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Limits:
    """Bounds of a motion; arrays have shape (n,), in rad or m, infinite if unbounded.

    Attributes:
        lower: Positions [rad].
        upper: Positions [rad].
        velocity: [rad/s].
        acceleration: [rad/s^2].
        torque: Joint torque at the current limit [N m].
        torque_share: Share of it that a designed motion may use.
    """

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    torque: Array
    torque_share: float = SHARES["torque"]

    @property
    def shares(self) -> dict[str, float]:
        """Usable shares of the limits: those of `SHARES`, except that of the torque."""
        return SHARES | {"torque": self.torque_share}

    def excess(self, motion: tuple[Array, Array, Array], torques: Array) -> Array:
        """Return the excess over the usable shares of the limits, relative to the limits, at least zero.

        Args:
            motion: q, dq, ddq, each (N, n).
            torques: Without and with payload [N m], shape (2, N, n).

        Returns:
            Excess in the order of `SHARES`, shape (4, N, n).
        """
        q, dq, ddq = motion
        center, half = 0.5 * (self.upper + self.lower), 0.5 * (self.upper - self.lower)
        used = (
            np.abs(q - center) / half,
            np.abs(dq) / self.velocity,
            np.abs(ddq) / self.acceleration,
            np.abs(torques).max(axis=0) / self.torque,
        )
        return np.maximum(np.stack(used) - np.array([*self.shares.values()])[:, None, None], 0.0)

    def largest_scale(self, trajectory: FourierTrajectory) -> Array:
        """Return the largest factor on each joint's motion within range, speed and acceleration, shape (n,)."""
        q, dq, ddq = trajectory(np.arange(0.0, trajectory.duration, 1.0 / 50.0))
        center = trajectory.center
        room = SHARES["range"] * np.minimum(self.upper - center, center - self.lower)
        return np.minimum.reduce(
            [
                room / np.abs(q - center).max(axis=0),
                SHARES["speed"] * self.velocity / np.abs(dq).max(axis=0),
                SHARES["acceleration"] * self.acceleration / np.abs(ddq).max(axis=0),
            ]
        )

    def broken_by(self, motion: tuple[Array, Array, Array]) -> tuple[str, ...]:
        """Return the exceeded limits except torque, a text per joint and limit."""
        q, dq, ddq = motion
        n = q.shape[1]
        used = (
            ("positions", np.where((q < self.lower) | (q > self.upper), np.inf, 0.0), np.ones(n)),
            ("speed", dq, self.velocity),
            ("acceleration", ddq, self.acceleration),
        )
        broken = [(what, np.abs(values).max(axis=0) > most) for what, values, most in used]
        return tuple(f"joint {j + 1}: {what}" for j in range(n) for what, over in broken if over[j])


def robot_limits(plant: Plant) -> Limits:
    """Return the limits of a plant's robot; half a turn to either side of home for unlimited joints.

    Raises:
        RobotError: If a prismatic joint has no range.
    """
    robot = plant.robot
    arm = load_arm(robot.model, flange=robot.flange)
    endless = ~np.isfinite(arm.upper - arm.lower)
    for j in np.flatnonzero(endless & (arm.revolute == 0)):
        raise RobotError(
            f"robot {robot.name}: prismatic joint {arm.joint_names[j]} has no range; state one in {robot.model}"
        )
    return Limits(
        lower=np.where(endless, robot.home - HALF_TURN, arm.lower),
        upper=np.where(endless, robot.home + HALF_TURN, arm.upper),
        velocity=robot.max_velocity,
        acceleration=robot.max_acceleration,
        torque=plant.drives.current_limit * np.abs(plant.drives.gain),
    )


def worst_of(excess: Array, names: tuple[str, ...], shares: Mapping[str, float] = SHARES) -> str:
    """Return the most exceeded limit, in words. `excess` is that of `Limits.excess`, shape (4, N, n)."""
    kind, _, joint = np.unravel_index(int(excess.argmax()), excess.shape)
    what, share = list(shares.items())[int(kind)]
    used = 100.0 * (float(excess.max()) + share)
    return f"takes {used:.0f} % of the {what} of joint {names[int(joint)]}, where {100.0 * share:g} % may be used"
