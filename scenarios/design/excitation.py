"""The design problem of a motion: accuracy of the gains to identify, and constraints."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from ident.model.parameters import INERTIAL, STANDARD, labels
from ident.model.regressor import regressor
from ident.model.structure import PROBE_SEED, Structure
from ident.support.arrays import Array, Indices
from scenarios.design.limits import SHARES, Limits, robot_limits, worst_of
from scenarios.experiments.build import Setup
from scenarios.experiments.files.mountings import mountings
from scenarios.prediction.deviations import (
    ROWS_PER_SECOND,
    ArmModel,
    Carried,
    Deviations,
    MotionRows,
    Prediction,
    carried,
    prediction_of,
)
from scenarios.support.errors import ScenarioError
from sim.clearance import CLEARANCE, Clearance
from sim.compile import bare_arm
from sim.controller import inverse_dynamics
from sim.errors import TrajectoryError
from sim.plant import Plant
from sim.shapes import Solid
from sim.trajectory import FourierTrajectory

EXCESS = 0.03
"""Largest relative violation of limits and clearance between samples of the search."""
SAME_TORQUE = 1e-6
"""Largest difference between identification model and MuJoCo, relative to the torque; equal models give 1e-13."""
SEARCHED_HZ = 10.0
"""Sampling rate during the search [Hz]."""
FITTED_HZ = 200.0
"""Sampling rate for the final check of limits [Hz]."""
SIZES = np.arange(1.0, 0.9, -0.01)
"""Factors on the amplitude of a motion, tried in this order until the limits are met."""
SMALL_SIZES = np.arange(0.9, 0.3, -0.02)
"""Further factors if these are not enough; smaller motions give little information."""


def objective(deviations: Array) -> float:
    """Return the objective: logarithms of the standard deviations of the gains to identify, mainly of the largest.

    `deviations` are relative standard deviations of the gains to identify, shape (w,).
    """
    return float(np.log(np.linalg.norm(deviations, ord=8)) + 0.2 * np.mean(np.log(deviations)))


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
        carried=carried(plant.payload, setup.payloads[names[0]]),
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

    def fitted(self, trajectory: FourierTrajectory, sizes: Array = SIZES) -> FourierTrajectory:
        """Return the motion, scaled about its centre until it meets all limits on a fine grid.

        Factors `sizes` are tried in this order.

        Raises:
            TrajectoryError: If no factor is enough.
        """
        smaller = trajectory
        for size in sizes:
            sine, cosine = size * trajectory.sine, size * trajectory.cosine
            smaller = FourierTrajectory(trajectory.center, sine, cosine, trajectory.duration)
            if self.keeps_limits(smaller):
                return smaller
        broken = self.broken(self.rows(smaller, FITTED_HZ))
        raise TrajectoryError(f"even scaled to {100.0 * sizes[-1]:.0f} %, the motion {broken}")

    def keeps_limits(self, trajectory: FourierTrajectory) -> bool:
        """Return whether limits are met on a fine grid; a coarse grid rejects most others at lower cost."""
        return all(
            self.excess(self.rows(trajectory, hz)).max() <= EXCESS for hz in (self.problem.searched_hz, FITTED_HZ)
        )


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
