"""Search for a motion that shows the drive gains: the largest predicted standard deviation is made small.

With the same motion q for both recordings, the loaded rows carry y, the payload's torque on joint j, over the
arm's columns W. Information on 1/g_j is what the columns cannot imitate in both motions at once
(`docs/derivations.md`):

    std(g_j) / g_j = sigma_j / sqrt(|y|^2 - |P y|^2 / 2),    P the projection onto the columns of W

with sigma_j in proportion to the joint's rms torque, as a real drive's residual is.
"""

from collections.abc import Callable
from dataclasses import dataclass

import cma
import numpy as np
from scipy import linalg, special

from ident.arm import load_arm
from ident.arrays import Array, Indices
from ident.parameters import INERTIAL, STANDARD, labels
from ident.payload import standard_parameters
from ident.regressor import regressor
from ident.structure import PROBE_SEED, Structure
from scenarios.design.against import Added, nothing_added
from sim.clearance import Clearance
from sim.compile import bare_arm
from sim.controller import inverse_dynamics
from sim.errors import RobotError, TrajectoryError
from sim.plant import Plant
from sim.trajectory import FourierTrajectory, at_rest

RESIDUAL = 0.02
"""Residual of a decimated row, as a share of the joint's rms torque; a common factor of all predictions."""
ROWS_PER_SECOND = 20.0
SHARE = 0.95
"""Share of a velocity or acceleration limit that a motion may use."""
RANGE_SHARE = 0.9
"""Share of each joint's position range."""
TORQUE_SHARE = 0.8
"""Share of the torque at the current limit."""
LEAST_SHARE = 0.25
"""Least share of its largest motion that a joint moves: one that rests shows none of its own parameters."""
EXCESS = 0.03
"""Excess over these shares and over the clearance that a found motion may have between the samples of the search."""
HALF_TURN = np.pi
"""Way from home to either side of a joint that turns without end [rad]; assumed, cables are wound up."""
SAME_TORQUE = 1e-6
"""Share of the largest torque by which identification model and MuJoCo may differ; equal models leave 1e-13."""
CLEARANCE = 0.03
"""Smallest distance to the floor and to the arm itself [m]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Limits:
    """Bounds on a motion; arrays are (n,).

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


class Design:
    """A design problem: plant, limits and which joints' gains are wanted."""

    def __init__(
        self, plant: Plant, structure: Structure, limits: Limits, joints: Indices, added: Added = nothing_added
    ) -> None:
        """Prepare the problem.

        Args:
            plant: The robot as believed when the motion is designed.
            structure: Its identifiable structure.
            limits: What the motion must respect.
            joints: Joints whose gains are wanted, from 0.
            added: Errors besides noise that the motion is designed against.
        """
        self._added = added
        self._structure, self._limits, self._joints = structure, limits, joints
        self._clearance = Clearance(plant, margin=2.0 * CLEARANCE)
        body, drives = plant.payload, plant.drives
        self._chi_payload = standard_parameters(body.mass, body.com, body.inertia)
        self._chi_arm = arm_parameters(plant, structure)
        self._bias = drives.gain * drives.amplifier_offset + drives.coulomb_asymmetry

    def sampled(self, trajectory: FourierTrajectory, rate_hz: float) -> tuple[Array, Array, Array]:
        """q, dq, ddq of the motion at a rate, each (N, n)."""
        return trajectory(np.arange(0.0, trajectory.duration, 1.0 / rate_hz))

    def predicted_std(self, trajectory: FourierTrajectory, rate_hz: float = ROWS_PER_SECOND) -> tuple[Array, Array]:
        """Predicted relative standard deviation of every gain, and joint torques of both motions.

        Returns:
            Relative standard deviations, shape (n,); torques without and with payload [N m], shape (2, N, n).
        """
        q, dq, ddq = self.sampled(trajectory, rate_hz)
        W = regressor(self._structure.arm, q, dq, ddq)  # (N, n, 14 n)
        y = W[:, :, self._structure.payload_columns] @ self._chi_payload
        torque = W @ self._chi_arm + self._bias
        both = np.stack((torque, torque + y))
        rel = np.empty(q.shape[1])
        for j, columns in enumerate(self._structure.joint_independent):
            basis = linalg.qr(W[:, j, self._structure.base.columns[columns]], mode="economic")[0]
            information = y[:, j] @ y[:, j] - 0.5 * np.sum((basis.T @ y[:, j]) ** 2)
            sigma = RESIDUAL * np.sqrt(np.mean(both[:, :, j] ** 2))
            rel[j] = sigma / np.sqrt(information * ROWS_PER_SECOND / rate_hz)
        return rel, both

    def excess(self, motion: tuple[Array, Array, Array], torques: Array) -> Array:
        """How far a motion breaks its limits, relative to them; all entries zero if it keeps them."""
        (q, dq, ddq), limits = motion, self._limits
        center, half = 0.5 * (limits.upper + limits.lower), 0.5 * (limits.upper - limits.lower)
        over = [
            np.abs(q - center) / half - RANGE_SHARE,
            np.abs(dq) / limits.velocity - SHARE,
            np.abs(ddq) / limits.acceleration - SHARE,
            np.abs(torques).max(axis=0) / limits.torque - TORQUE_SHARE,
        ]
        apart = (CLEARANCE - self._clearance(q)) / CLEARANCE
        return np.concatenate([np.maximum(o, 0.0).ravel() for o in over] + [np.maximum(apart, 0.0)])

    def largest_scale(self, trajectory: FourierTrajectory) -> Array:
        """Factor on each joint's motion about its centre that just keeps range, velocity and acceleration, (n,)."""
        q, dq, ddq = self.sampled(trajectory, 50.0)
        limits, center = self._limits, trajectory.center
        room = RANGE_SHARE * np.minimum(limits.upper - center, center - limits.lower)
        return np.minimum.reduce(
            [
                room / np.abs(q - center).max(axis=0),
                SHARE * limits.velocity / np.abs(dq).max(axis=0),
                SHARE * limits.acceleration / np.abs(ddq).max(axis=0),
            ]
        )

    def cost(self, trajectory: FourierTrajectory) -> float:
        """Logarithm of the wanted joints' standard deviations, mostly of the worst, plus a penalty on excess."""
        rate_hz = 10.0
        noise, torques = self.predicted_std(trajectory, rate_hz)
        rel = np.hypot(noise, self._added(trajectory, rate_hz))
        worst = float(np.log(np.linalg.norm(rel[self._joints], ord=8)))
        mean = float(np.mean(np.log(rel[self._joints])))
        over = self.excess(self.sampled(trajectory, rate_hz), torques)
        return worst + 0.2 * mean + 30.0 * float(over @ over) / rate_hz

    def fitted(self, trajectory: FourierTrajectory) -> FourierTrajectory:
        """The motion, shrunk about its centre until it keeps every limit on a fine grid.

        Raises:
            TrajectoryError: If a tenth less is not enough.
        """
        worst = np.inf
        for scale in np.arange(1.0, 0.9, -0.01):
            sine, cosine = scale * trajectory.sine, scale * trajectory.cosine
            smaller = FourierTrajectory(trajectory.center, sine, cosine, trajectory.duration)
            worst = self.excess(self.sampled(smaller, 200.0), self.predicted_std(smaller, 200.0)[1]).max()
            if worst <= EXCESS:
                return smaller
        raise TrajectoryError(f"the motion exceeds a limit or comes too near by {100 * worst:.0f} %")


def arm_parameters(plant: Plant, structure: Structure) -> Array:
    """Standard parameters of the bare arm and its drives, shape (14 n + 3 c,); offsets are left to the bias.

    The inertial ones are those of least norm that give MuJoCo's inverse dynamics on random states: what a torque
    cannot show does not matter here, and no convention of frames stands between both models.

    Raises:
        TrajectoryError: If the identification model cannot give these torques.
    """
    arm, drives = structure.arm, plant.drives
    q, dq, ddq = np.random.default_rng(PROBE_SEED).uniform(-2.0, 2.0, (3, 10 * arm.n, arm.n))
    torque = inverse_dynamics(bare_arm(plant.robot.model, drives.rotor_inertia, plant.robot.flange), q, dq, ddq)
    inertial = [
        k for k, name in enumerate(labels(arm.n, arm.couplings)) if name.rstrip("0123456789") in (*INERTIAL, "Ia")
    ]
    W = regressor(arm, q, dq, ddq)
    chi = np.zeros(W.shape[2])
    chi[inertial] = linalg.lstsq(W[..., inertial].reshape(-1, len(inertial)), torque.ravel())[0]
    left = np.abs(W @ chi - torque).max() / np.abs(torque).max()
    if left > SAME_TORQUE:
        raise TrajectoryError(
            f"robot {plant.robot.name}: identification and simulation read {plant.robot.model} differently: "
            f"torques differ by {100.0 * left:.2g} %"
        )
    p = len(STANDARD)
    for name, values in (("Fv", drives.viscous_friction), ("Fc", drives.coulomb_friction)):
        chi[p * np.arange(arm.n) + STANDARD.index(name)] = values
    return chi


def search(
    design: Design,
    start: Array,
    seed: int,
    *,
    harmonics: int,
    duration: float,
    evaluations: int,
    progress: Callable[[str], None],
) -> FourierTrajectory:
    """Best of 300 random motions, then CMA-ES from there.

    The cost has kinks wherever another sample becomes the one that meets a limit; gradient descent stops at them
    with deviations half as large again.

    Args:
        design: The problem.
        start: Positions the motions move about at first [rad], shape (n,).
        seed: Of the random numbers; the same seed finds the same motion.
        harmonics: Harmonics of the series.
        duration: Period [s].
        evaluations: Motions to try.
        progress: Told of the best so far, now and then.

    Returns:
        The best motion found, fitted to its limits.

    Raises:
        TrajectoryError: If it cannot be fitted.
    """
    n, shape = len(start), (2, len(start), harmonics)

    def trajectory(x: Array) -> FourierTrajectory:
        """Centres, shares of the largest admissible motion, coefficients up to scale."""
        sine, cosine = x[2 * n :].reshape(shape)
        drawn = at_rest(x[:n], sine, cosine, duration)
        share = LEAST_SHARE + (1.0 - LEAST_SHARE) * special.expit(x[n : 2 * n])
        scale = (share * design.largest_scale(drawn))[:, None]
        return FourierTrajectory(drawn.center, scale * drawn.sine, scale * drawn.cosine, duration)

    def cost(x: Array) -> float:
        return design.cost(trajectory(x))

    rng = np.random.default_rng(seed)
    fade = 1.0 / np.sqrt(np.arange(1, harmonics + 1))
    first = min(
        (
            np.concatenate((start, rng.uniform(-1.0, 2.0, n), (fade * rng.standard_normal(shape)).ravel()))
            for _ in range(300)
        ),
        key=cost,
    )
    options = {"seed": seed + 1, "maxfevals": evaluations, "verbose": -9}
    strategy = cma.CMAEvolutionStrategy(first, 0.2, options)
    while not strategy.stop():
        tried = strategy.ask()
        strategy.tell(tried, [cost(np.asarray(x)) for x in tried])
        if strategy.countiter % 100 == 0:
            progress(f"{strategy.countevals} motions tried, cost {strategy.best.f:.4f}")
    best = min((first, np.asarray(strategy.best.x)), key=cost)  # of a short search the start may be the best
    progress(f"cost of the start {cost(first):.4f}, of the motion found {cost(best):.4f}")
    return design.fitted(trajectory(best))
