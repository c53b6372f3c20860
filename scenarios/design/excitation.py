"""The design problem: accuracy of the gains to identify, limits of the robot, distance to floor and arm.

The cost of a motion is the logarithm of the predicted relative standard deviations of the gains to identify, mainly of
the largest, plus thirty times the mean squared violation of limits and clearance.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from math import isfinite

import numpy as np

from ident.model.arm import load_joints
from ident.model.structure import Structure
from ident.payload.payload import standard_parameters
from ident.support.arrays import Array, Indices
from scenarios.experiments.scenario import Setup
from scenarios.experiments.schema import mountings
from scenarios.prediction.deviations import ROWS_PER_SECOND, ArmModel, Carried, Deviations, MotionRows, predicted
from scenarios.support.errors import ScenarioError
from sim.errors import PlantError, TrajectoryError
from sim.plant import Plant
from sim.shapes import CLEARANCE, Clearance, Solid
from sim.trajectory import FourierTrajectory

SHARES = {"range": 0.9, "speed": 0.95, "acceleration": 0.95, "torque": 0.8}
"""Share of each joint's limits that a designed motion may use."""
HALF_TURN = np.pi
"""Range to either side for a joint without limits [rad]; assumed because of cables."""
EXCESS = 0.03
"""Largest relative violation of limits and clearance between samples of the search."""
SEARCHED_HZ, FITTED_HZ = 10.0, 200.0
"""Sampling rate during the search, and for the final check of limits [Hz]."""
SIZES = np.arange(1.0, 0.09, -0.01)
"""Factors on a motion, tried in this order until the limits are met."""


def objective(deviations: Array) -> float:
    """Return the objective for relative standard deviations of the gains to identify, shape (w,)."""
    return float(np.log(np.linalg.norm(deviations, ord=8)) + 0.2 * np.mean(np.log(deviations)))


def percents(deviations: Iterable[float]) -> str:
    """Return predicted standard deviations of gains as text in percent; a dash if not identifiable."""
    return ", ".join(f"{100.0 * std:.2g}" if isfinite(std) else "-" for std in deviations)


def finite(value: float) -> float | None:
    """Return the value, None if not finite."""
    return float(value) if isfinite(value) else None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Limits:
    """Bounds of a motion, infinite if unbounded; arrays have shape (n,), units rad or m, s, and N m or N."""

    lower: Array  # positions of joints
    upper: Array
    velocity: Array  # this and the following of motors
    acceleration: Array
    torque: Array  # at the current limit
    motors: Array | None = None  # q_motor = A q, `Robot.motors`

    @classmethod
    def of(cls, plant: Plant) -> "Limits":
        """Return the limits of a plant's robot, half a turn to either side of home for revolute joints without any."""
        robot, drives = plant.robot, plant.drives
        arm, _ = load_joints(robot.model, flange=robot.flange)
        endless = ~np.isfinite(arm.upper - arm.lower)
        for j in np.flatnonzero(endless & (arm.revolute == 0)):
            raise PlantError(
                f"robot {robot.name}: prismatic joint {arm.joint_names[j]} has no range; state one in {robot.model}"
            )
        return cls(
            lower=np.where(endless, robot.home - HALF_TURN, arm.lower),
            upper=np.where(endless, robot.home + HALF_TURN, arm.upper),
            velocity=robot.drives.max_velocity,
            acceleration=robot.drives.max_acceleration,
            torque=drives.current_limit * np.abs(drives.gain),
            motors=robot.motors,
        )

    @property
    def center(self) -> Array:
        """Middle of the ranges."""
        return 0.5 * (self.upper + self.lower)

    @property
    def half(self) -> Array:
        """Half of the ranges."""
        return 0.5 * (self.upper - self.lower)

    def of_joints(self, q: Array) -> Array:
        """Return the positions of the joints from those of their motors, both (N, n)."""
        return q if self.motors is None else np.asarray(np.linalg.solve(self.motors, q.T).T, np.float64)

    def largest_scale(self, trajectory: FourierTrajectory) -> Array:
        """Return the largest factor on each joint's motion within range, speed and acceleration, shape (n,)."""
        q, dq, ddq = trajectory(np.arange(0.0, trajectory.duration, 1.0 / 50.0))
        dq, ddq = (x if self.motors is None else x @ self.motors.T for x in (dq, ddq))
        center = trajectory.center
        room = SHARES["range"] * np.minimum(self.upper - center, center - self.lower)
        scales = (
            room / np.abs(q - center).max(axis=0),
            SHARES["speed"] * self.velocity / np.abs(dq).max(axis=0),
            SHARES["acceleration"] * self.acceleration / np.abs(ddq).max(axis=0),
        )
        return np.minimum.reduce(scales)


@dataclass(frozen=True, kw_only=True, eq=False)
class Design:
    """A design problem, which evaluates motions and payloads."""

    plant: Plant  # the assumed robot, with the payload for the distances
    structure: Structure
    limits: Limits
    joints: Indices  # joints whose gains are to be identified, from 0
    carried: Carried
    method: str
    # Joint speeds at which a row has half its weight [rad/s], shape (n,); None for rows of equal weight:
    slow: Array | None = None
    solids: tuple[Solid, ...] | None = None  # shapes of the payload, None for a cylinder with its inertia
    searched_hz: float = SEARCHED_HZ  # sampling rate during the search [Hz]

    @classmethod
    def of(cls, setup: Setup) -> "Design":
        """Return the problem of a scenario's first payload; raises `ScenarioError` without one, or no gain to find."""
        scenario = setup.scenario
        wanted, names = np.flatnonzero(scenario.table.tolerance.identifiable), mountings(setup.protocol)
        if not wanted.size:
            said = "tolerance.identifiable lists no joint, so there is no gain to optimise"
            raise ScenarioError(f"{scenario.name}: {said}")
        if not names:
            said = 'experiment.protocol mounts no payload; a design needs one, such as ["bare", "loaded"]'
            raise ScenarioError(f"{scenario.name}: {said}")
        plant, believed = setup.plants.get(names[0], setup.plant), setup.payloads[names[0]]
        body = plant.payload
        return cls(
            plant=plant,
            structure=setup.structure,
            limits=Limits.of(plant),
            joints=wanted,
            carried=Carried(chi=standard_parameters(body.mass, body.com, body.inertia), known=believed.known_part()),
            method=scenario.table.identification.method,
        )

    @cached_property
    def arm(self) -> ArmModel:
        """The bare arm."""
        return ArmModel.of(self.plant, self.structure)

    @cached_property
    def clearance(self) -> Clearance:
        """Distances to floor and arm, up to twice the required one."""
        return Clearance(self.plant, margin=2.0 * CLEARANCE, solids=self.solids)

    def rows(self, trajectory: FourierTrajectory, rate_hz: float = ROWS_PER_SECOND) -> MotionRows:
        """Return the motion, sampled."""
        return self.arm.rows(trajectory(np.arange(0.0, trajectory.duration, 1.0 / rate_hz)), rate_hz)

    def predicted(self, rows: MotionRows) -> Callable[[Carried], Deviations]:
        """Return a function that predicts the relative standard deviations of all gains for a payload."""
        return predicted(rows if self.slow is None else rows.weighted(self.slow), self.structure, self.method)

    def deviations(self, trajectory: FourierTrajectory, rate_hz: float = ROWS_PER_SECOND) -> Array:
        """Return the predicted relative standard deviations of all gains, shape (n,)."""
        return self.predicted(self.rows(trajectory, rate_hz))(self.carried).total

    def worst(self, trajectory: FourierTrajectory) -> float:
        """Return the largest predicted relative standard deviation of the gains to identify."""
        return float(self.deviations(trajectory)[self.joints].max())

    def excess(self, rows: MotionRows) -> Array:
        """Return relative violations of `SHARES` by joint, torques of both motions, and of clearance, (4 n + 1, N)."""
        (q, dq, ddq), limits, torques = rows.motion, self.limits, rows.torques(self.carried.chi)
        q = limits.of_joints(q)
        used = (
            np.abs(q - limits.center) / limits.half,
            np.abs(dq) / limits.velocity,
            np.abs(ddq) / limits.acceleration,
            np.abs(torques).max(axis=0) / limits.torque,
        )
        over = [(each - share).T for each, share in zip(used, SHARES.values(), strict=True)]
        return np.maximum(np.concatenate((*over, [1.0 - self.clearance(q) / CLEARANCE])), 0.0)

    def broken(self, rows: MotionRows) -> str:
        """Return the largest violation, in words."""
        over = self.excess(rows).max(axis=1)
        kind, joint = divmod(int(over.argmax()), self.plant.robot.n)
        if kind == len(SHARES):
            distance = float(self.clearance(self.limits.of_joints(rows.motion[0])).min())
            return f"{near_words(distance)} floor or arm (required clearance {1e3 * CLEARANCE:g} mm)"
        what, share = list(SHARES.items())[kind]
        used, name = 100.0 * (over.max() + share), self.structure.arm.joint_names[joint]
        return f"takes {used:.0f} % of the {what} of joint {name}, where {100.0 * share:g} % may be used"

    def cost(self, trajectory: FourierTrajectory) -> float:
        """Return the objective plus a penalty on violations."""
        rows = self.rows(trajectory, self.searched_hz)
        errors, over = self.predicted(rows)(self.carried).total, self.excess(rows).ravel()
        return objective(errors[self.joints]) + 30.0 * float(over @ over) / self.searched_hz

    def resting(self, q: Array) -> MotionRows:
        """Return the arm at rest at positions (k, n)."""
        return self.arm.rows((q, np.zeros_like(q), np.zeros_like(q)), 1.0)

    def at_rest(self, q: Array) -> Array:
        """Return the largest violation at rest at each position (k, n), shape (k,); zero where all limits are met."""
        return self.excess(self.resting(q)).max(axis=0)

    def keeps_limits(self, trajectory: FourierTrajectory) -> bool:
        """Return whether limits are met on a fine grid; a coarse grid rejects most others at lower cost."""
        rates = (self.searched_hz, FITTED_HZ)
        return all(self.excess(self.rows(trajectory, hz)).max() <= EXCESS for hz in rates)

    def fitted(self, trajectory: FourierTrajectory) -> FourierTrajectory:
        """Return the motion scaled by the first of `SIZES` that meets all limits; `TrajectoryError` if none does.

        It is scaled about its centre, or the middle one of its positions that can be held if the centre cannot.
        """
        center, about = trajectory.center, trajectory.center
        if self.at_rest(center[None])[0] > 0.0:
            path = trajectory(np.arange(0.0, trajectory.duration, 1.0 / self.searched_hz))[0]
            held = path[self.at_rest(path) == 0.0]
            about = held[len(held) // 2] if len(held) else center
        smaller = trajectory
        for size in SIZES:
            sine, cosine = size * trajectory.sine, size * trajectory.cosine
            smaller = FourierTrajectory(about + size * (center - about), sine, cosine, trajectory.duration)
            if self.keeps_limits(smaller):
                return smaller
        broken = self.broken(self.rows(smaller, FITTED_HZ))
        raise TrajectoryError(f"even scaled to {100.0 * SIZES[-1]:.0f} %, the motion {broken}")


def near_words(distance: float) -> str:
    """Return a text for a distance [m] that is too small; the name of the obstacle follows."""
    return f"comes within {1e3 * distance:.0f} mm of" if distance > 0.0 else f"reaches {-1e3 * distance:.0f} mm into"
