"""The design problem of a motion: accuracy of the gains to identify, limits of the robot, distance to floor and arm.

The cost of a motion is the logarithm of the predicted relative standard deviations of the gains to identify, mainly of
the largest, plus thirty times the mean squared violation of limits and clearance.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite

import numpy as np
from scipy import linalg

from ident.model.arm import load_arm
from ident.model.parameters import INERTIAL, STANDARD, labels
from ident.model.regressor import regressor
from ident.model.structure import PROBE_SEED, Structure
from ident.support.arrays import Array, Indices
from scenarios.experiments.scenario import Setup
from scenarios.experiments.schema import mountings
from scenarios.prediction.deviations import (
    ROWS_PER_SECOND,
    ArmModel,
    Carried,
    Deviations,
    MotionRows,
    Prediction,
    prediction_of,
)
from scenarios.support.errors import ScenarioError
from sim.controller import inverse_dynamics
from sim.errors import RobotError, TrajectoryError
from sim.plant import Plant, bare_arm
from sim.shapes import CLEARANCE, Clearance, Solid
from sim.trajectory import FourierTrajectory

SHARES = {"range": 0.9, "speed": 0.95, "acceleration": 0.95, "torque": 0.8}
"""Share of each joint's limits that a designed motion may use, except that of the torque, `Limits.torque_share`."""
HALF_TURN = np.pi
"""Range to either side for a joint without limits [rad]; assumed because of cables."""
EXCESS = 0.03
"""Largest relative violation of limits and clearance between samples of the search."""
SAME_TORQUE = 1e-6
"""Largest difference between identification model and MuJoCo, relative to the torque; equal models give 1e-13."""
SEARCHED_HZ, FITTED_HZ = 10.0, 200.0
"""Sampling rate during the search, and for the final check of limits [Hz]."""
SIZES = np.arange(1.0, 0.9, -0.01)
"""Factors on the amplitude of a motion, tried in this order until the limits are met."""


def objective(deviations: Array) -> float:
    """Return the objective for relative standard deviations of the gains to identify, shape (w,)."""
    return float(np.log(np.linalg.norm(deviations, ord=8)) + 0.2 * np.mean(np.log(deviations)))


def percents(deviations: Array) -> str:
    """Return predicted standard deviations of gains, shape (n,), as text in percent; a dash if not identifiable."""
    return ", ".join(f"{100.0 * std:.2g}" if isfinite(std) else "-" for std in deviations)


def finite(value: float) -> float | None:
    """Return the value, None if not finite."""
    return float(value) if isfinite(value) else None


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
    def center(self) -> Array:
        """Middle of the ranges."""
        return 0.5 * (self.upper + self.lower)

    @property
    def half(self) -> Array:
        """Half of the ranges."""
        return 0.5 * (self.upper - self.lower)

    @property
    def shares(self) -> dict[str, float]:
        """Usable shares of the limits."""
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
        used = (
            np.abs(q - self.center) / self.half,
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
        scales = (
            room / np.abs(q - center).max(axis=0),
            SHARES["speed"] * self.velocity / np.abs(dq).max(axis=0),
            SHARES["acceleration"] * self.acceleration / np.abs(ddq).max(axis=0),
        )
        return np.minimum.reduce(scales)


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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Problem:
    """Definition of a design problem; picklable.

    Attributes:
        plant: The assumed robot, with the payload for the distances.
        structure: Its identifiable structure.
        limits: Limits of the motion.
        joints: Joints whose gains are to be identified, from 0.
        carried: The payload and its known parameters.
        prediction: Model that predicts the standard deviations.
        solids: Shapes of the payload, None for a cylinder with its inertia.
        added: Further errors in the objective: root mean square relative error of every gain along a motion at a
            sampling rate, shape (n,).
        searched_hz: Sampling rate during the search [Hz].
    """

    plant: Plant
    structure: Structure
    limits: Limits
    joints: Indices
    carried: Carried
    prediction: Prediction
    solids: tuple[Solid, ...] | None = None
    added: Callable[[FourierTrajectory, float], Array] | None = None
    searched_hz: float = SEARCHED_HZ


def design_problem(setup: Setup) -> Problem:
    """Return the problem of a scenario, with its first payload and the joints to identify.

    Raises:
        ScenarioError: If there is no joint to identify, or no payload.
    """
    scenario = setup.scenario
    wanted, names = np.flatnonzero(scenario.table.tolerance.identifiable), mountings(setup.protocol)
    if not wanted.size:
        raise ScenarioError(f"{scenario.name}: tolerance.identifiable lists no joint, so there is no gain to optimise")
    if not names:
        raise ScenarioError(
            f'{scenario.name}: experiment.protocol mounts no payload; a design needs one, such as ["bare", "loaded"]'
        )
    plant = setup.plants.get(names[0], setup.plant)
    return Problem(
        plant=plant,
        structure=setup.structure,
        limits=robot_limits(plant),
        joints=wanted,
        carried=Carried.of(plant.payload, setup.payloads[names[0]]),
        prediction=prediction_of(scenario.table.identification.method),
    )


class Design:
    """A prepared design problem, which evaluates motions."""

    def __init__(self, problem: Problem) -> None:
        """Prepare the problem.

        Raises:
            TrajectoryError: If identification model and MuJoCo model differ.
        """
        self.problem = problem
        self.arm = arm_model(problem.plant, problem.structure)
        self._clearance = Clearance(problem.plant, margin=2.0 * CLEARANCE, solids=problem.solids)

    def rows(self, trajectory: FourierTrajectory, rate_hz: float = ROWS_PER_SECOND) -> MotionRows:
        """Return the motion, sampled."""
        return self.arm.rows(trajectory, rate_hz)

    def deviations(self, rows: MotionRows) -> Deviations:
        """Return the predicted relative standard deviations of all gains."""
        return self.problem.prediction(rows, self.problem.structure)(self.problem.carried)

    def worst(self, trajectory: FourierTrajectory) -> float:
        """Return the largest predicted relative standard deviation of the gains to identify."""
        return float(self.deviations(self.rows(trajectory)).total[self.problem.joints].max())

    def excess(self, rows: MotionRows) -> Array:
        """Return the relative violations of limits and distances; all zero if met."""
        return np.append(self._over_limits(rows).ravel(), self._too_near(rows))

    def broken(self, rows: MotionRows) -> str:
        """Return the largest violation of a motion, in words."""
        over = self._over_limits(rows)
        if over.max() >= self._too_near(rows).max():
            return worst_of(over, self.problem.structure.arm.joint_names, self.problem.limits.shares)
        near = near_words(float(self._clearance(rows.motion[0]).min()))
        return f"{near} floor or arm (required clearance {1e3 * CLEARANCE:g} mm)"

    def obstacles(self, positions: Array) -> str:
        """Return why most of some positions (k, n) cannot be held, in words, with the share."""
        near, heavy = Counter[str](), Counter[str]()
        names = self.problem.structure.arm.joint_names
        for q in positions:
            rows = self.rows(resting(q), 1.0)
            pair = self._clearance.nearest(q) if self._too_near(rows).any() else None
            near.update([] if pair is None else [f"{pair[0]} is within {1e3 * CLEARANCE:g} mm of {pair[1]}"])
            over = self._over_limits(rows)[list(SHARES).index("torque")].any(axis=0)
            heavy.update(f"arm and payload are too heavy for joint {names[j]}" for j in np.flatnonzero(over))
        found = (near.most_common(1) + heavy.most_common(1)) or [
            ("the position is outside the range of a joint", len(positions))
        ]
        return "; ".join(f"at {100.0 * count / len(positions):.0f} % of them, {what}" for what, count in found)

    def _over_limits(self, rows: MotionRows) -> Array:
        return self.problem.limits.excess(rows.motion, rows.torques(self.problem.carried.chi))

    def _too_near(self, rows: MotionRows) -> Array:
        """Return the relative shortfall of the clearance at each position, shape (N,)."""
        return np.maximum((CLEARANCE - self._clearance(rows.motion[0])) / CLEARANCE, 0.0)

    def cost(self, trajectory: FourierTrajectory) -> float:
        """Return the objective plus a penalty on violations."""
        searched_hz, added = self.problem.searched_hz, self.problem.added
        rows = self.rows(trajectory, searched_hz)
        over, errors = self.excess(rows), self.deviations(rows).total
        if added is not None:
            errors = np.hypot(errors, added(trajectory, searched_hz))
        return objective(errors[self.problem.joints]) + 30.0 * float(over @ over) / searched_hz

    def can_hold(self, q: Array) -> bool:
        """Return whether a position (n,) meets all limits at rest."""
        return not self.excess(self.rows(resting(q), 1.0)).any()

    def keeps_limits(self, trajectory: FourierTrajectory) -> bool:
        """Return whether limits are met on a fine grid; a coarse grid rejects most others at lower cost."""
        return all(
            self.excess(self.rows(trajectory, hz)).max() <= EXCESS for hz in (self.problem.searched_hz, FITTED_HZ)
        )

    def fitted(self, trajectory: FourierTrajectory, sizes: Array = SIZES) -> FourierTrajectory:
        """Return the motion, scaled about its centre by the first of some factors that meets all limits on a fine grid.

        Raises:
            TrajectoryError: If no factor is enough.
        """
        smaller = trajectory
        for size in sizes:
            smaller = scaled(trajectory, size)
            if self.keeps_limits(smaller):
                return smaller
        broken = self.broken(self.rows(smaller, FITTED_HZ))
        raise TrajectoryError(f"even scaled to {100.0 * sizes[-1]:.0f} %, the motion {broken}")


def scaled(motion: FourierTrajectory, size: float, about: Array | None = None) -> FourierTrajectory:
    """Return a motion scaled about a position (n,), its centre by default."""
    center = motion.center if about is None else about + size * (motion.center - about)
    return FourierTrajectory(center, size * motion.sine, size * motion.cosine, motion.duration)


def resting(q: Array) -> FourierTrajectory:
    """Return one second at rest at a position (n,)."""
    none = np.zeros((len(q), 1))
    return FourierTrajectory(q, none, none, 1.0)


def near_words(distance: float) -> str:
    """Return a text for a distance [m] that is too small; the name of the obstacle follows."""
    return f"comes within {1e3 * distance:.0f} mm of" if distance > 0.0 else f"reaches {-1e3 * distance:.0f} mm into"


def arm_model(plant: Plant, structure: Structure) -> ArmModel:
    """Return the bare arm of a plant with its drives, as columns and standard parameters.

    The inertial parameters are the minimum-norm solution for MuJoCo's inverse dynamics at random states. Parameters
    without effect on torques are irrelevant here, and frame conventions of the models do not matter.

    Raises:
        TrajectoryError: If the identification model cannot reproduce these torques.
    """
    arm, drives = structure.arm, plant.drives
    q, dq, ddq = np.random.default_rng(PROBE_SEED).uniform(-2.0, 2.0, (3, 10 * arm.n, arm.n))
    torque = inverse_dynamics(bare_arm(plant.robot.model, drives.rotor_inertia, plant.robot.flange), q, dq, ddq)
    columns = [
        k for k, name in enumerate(labels(arm.n, arm.couplings)) if name.rstrip("0123456789") in (*INERTIAL, "Ia")
    ]
    W = regressor(arm, q, dq, ddq)
    inertial = np.zeros(W.shape[2])
    inertial[columns] = linalg.lstsq(W[..., columns].reshape(-1, len(columns)), torque.ravel())[0]
    left = np.abs(W @ inertial - torque).max() / np.abs(torque).max()
    if left > SAME_TORQUE:
        raise TrajectoryError(
            f"robot {plant.robot.name}: identification and simulation read {plant.robot.model} differently: "
            f"torques differ by {100.0 * left:.2g} %"
        )
    chi, p = inertial.copy(), len(STANDARD)
    for name, values in (("Fv", drives.viscous_friction), ("Fc", drives.coulomb_friction)):
        chi[p * np.arange(arm.n) + STANDARD.index(name)] = values
    bias = drives.gain * drives.amplifier_offset + drives.coulomb_asymmetry
    return ArmModel(structure=structure, chi=chi, inertial=inertial, bias=bias)
