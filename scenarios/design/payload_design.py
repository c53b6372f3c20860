"""Design of a payload for a scenario: accuracy with its own payload and with the best payload of each shape.

The motion is sampled once, so the evaluation of a payload takes a few milliseconds. Dimensions are whole millimetres.
Each shape is optimised by differential evolution.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import optimize

from ident.payload.payload import Known, Payload
from ident.support.arrays import Array, Mask
from scenarios.design.excitation import EXCESS, FITTED_HZ, Design, Problem, design_problem, objective
from scenarios.design.limits import SHARES
from scenarios.design.weights import SHAPES, Weight, payload_of, solids
from scenarios.experiments.build import Setup, body_of
from scenarios.experiments.files.mountings import mountings
from scenarios.experiments.files.schema import Scenario
from scenarios.prediction.deviations import RESIDUAL, Carried, Deviations, MotionRows, drawn
from scenarios.support.errors import ScenarioError
from sim.clearance import CLEARANCE, Clearance
from sim.flange import Flange, flange_of
from sim.trajectory import FourierTrajectory

NEAR_HZ, TORQUE_HZ = 10.0, 50.0
"""Sampling rate for distances and torques during the search [Hz]."""
ROOM = 1.3 * CLEARANCE
"""Clearance in the search [m]; the final check on a fine grid requires `CLEARANCE`."""
IMPOSSIBLE = 100.0
"""Base cost of a payload that violates a bound."""
POPULATION, GENERATIONS = 8, 25
"""Population size per dimension, and number of generations."""
LOOKED_AT = 10
"""Largest number of the best candidates that are checked on a fine grid until one is feasible."""
STEPS = 100 * len(SHAPES)  # steps of a design for the progress display


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mounted:
    """Evaluation of a payload along a motion.

    Attributes:
        payload: Payload as known to the identification.
        deviations: Predicted standard deviations.
        torque: Rms torque of the payload on each joint [N m], shape (n,).
    """

    payload: Payload
    deviations: Deviations
    torque: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Candidate(Mounted):
    """A designed payload.

    Attributes:
        weight: The nominal payload.
        cost: Objective.
        refusal: Why it must not be mounted, or an empty text.
    """

    weight: Weight
    cost: float
    refusal: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Carrying:
    """The design problem of a payload.

    Attributes:
        design: Robot, limits and joints to identify.
        motion: The motion, sampled at first use.
        flange: Frame on which payloads are mounted.
        known: Known parameters of the payload.
        most: Largest mass [kg], infinite if not stated.
        density: Density of the material [kg/m^3].
    """

    design: Design
    motion: FourierTrajectory
    flange: Flange
    known: Known
    most: float
    density: float

    @cached_property
    def rows(self) -> MotionRows:
        """Return the motion, sampled for predictions."""
        return self.design.rows(self.motion)

    @cached_property
    def _predict(self) -> Callable[[Carried], Deviations]:
        return self.design.problem.prediction(self.rows, self.design.problem.structure)

    @cached_property
    def _fast(self) -> MotionRows:
        return self.design.rows(self.motion, TORQUE_HZ)

    def payload(self, weight: Weight) -> Payload:
        """Return a designed payload as known to the identification."""
        return replace(payload_of(weight, self.flange), known=self.known)

    def problem_with(self, weight: Weight, payload: Payload) -> Problem:
        """Return the same problem with a payload on the flange."""
        problem = self.design.problem
        plant = replace(problem.plant, payload=body_of(payload))
        return replace(problem, plant=plant, carried=drawn(payload), solids=solids(weight, self.flange))

    def cost(self, weight: Weight) -> float:
        """Return the objective; for an infeasible payload, `IMPOSSIBLE` plus its violation."""
        missing = SHAPES[weight.shape].missing(weight.dimensions)
        over = max(missing, 0.0) / 10.0 + max(weight.properties.mass / self.most - 1.0, 0.0)
        if over > 0.0:
            return IMPOSSIBLE + 10.0 + over
        payload = self.payload(weight)
        over = self._torque_excess(payload)
        if over > 0.0:
            return IMPOSSIBLE + min(over, 10.0)
        value = objective(self._predict(drawn(payload)).total[self.design.problem.joints])
        return value + 10.0 * max(ROOM - self._distance(weight, payload, NEAR_HZ), 0.0) / ROOM

    def candidate(self, weight: Weight) -> Candidate:
        """Return the full evaluation of a payload, with distances on a fine grid."""
        payload = self.payload(weight)
        deviations = self._predict(drawn(payload))
        return Candidate(
            weight=weight,
            payload=payload,
            deviations=deviations,
            torque=_payload_torque(self.rows.Y, drawn(payload).chi),
            cost=objective(deviations.total[self.design.problem.joints]),
            refusal=self._refusal(weight, payload),
        )

    def best(self, shape: str, seed: int, tell: Callable[[float], None]) -> Candidate:
        """Return the best payload of a shape. `tell` receives the progress of the search."""
        bounds = np.array([*SHAPES[shape].dimensions.values(), (0, 3)], dtype=np.float64)
        calls = 0

        def weight(x: Array) -> Weight:
            *dimensions, quarter = np.rint(x).tolist()
            return Weight(shape=shape, dimensions=tuple(dimensions), quarter=int(quarter), density=self.density)

        def cost(x: Array) -> float:
            nonlocal calls
            calls += 1
            tell(min(calls / (POPULATION * len(bounds) * (GENERATIONS + 1)), 1.0))
            return self.cost(weight(x))

        found = optimize.differential_evolution(
            cost,
            optimize.Bounds(bounds[:, 0], bounds[:, 1]),
            integrality=[True] * len(bounds),
            rng=np.random.default_rng(seed),
            popsize=POPULATION,
            maxiter=GENERATIONS,
            tol=1e-4,
            polish=False,
        )
        order = np.argsort(found.population_energies)[:LOOKED_AT]
        looked_at = [self.candidate(weight(found.population[k])) for k in order]
        return next((candidate for candidate in looked_at if not candidate.refusal), looked_at[0])

    def _refusal(self, weight: Weight, payload: Payload) -> str:
        if payload.mass > self.most:
            return f"weighs {payload.mass:.2f} kg, more than the robot's rated load of {self.most:g} kg"
        over = self._torque_excess(payload)
        if over > 0.0:
            used, may = over + SHARES["torque"] + EXCESS, SHARES["torque"] + EXCESS
            return f"needs {100.0 * used:.0f} % of a drive's torque, where {100.0 * may:.0f} % may be used"
        near = self._distance(weight, payload, FITTED_HZ)
        if near < CLEARANCE * (1.0 - EXCESS):
            return f"comes within {1e3 * max(near, 0.0):.0f} mm of floor or arm (required {1e3 * CLEARANCE:g} mm)"
        return ""

    def _torque_excess(self, payload: Payload) -> float:
        used = np.abs(self._fast.torques(drawn(payload).chi)).max(axis=(0, 1)) / self.design.problem.limits.torque
        return float(used.max()) - SHARES["torque"] - EXCESS

    def _distance(self, weight: Weight, payload: Payload, rate_hz: float) -> float:
        """Return the smallest distance to floor and arm at a sampling rate [m]."""
        problem = self.problem_with(weight, payload)
        q, _, _ = self.motion(np.arange(0.0, self.motion.duration, 1.0 / rate_hz))
        return float(Clearance(problem.plant, ROOM, problem.solids)(q).min())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PayloadDesign:
    """Result of a design.

    Attributes:
        scenario: The scenario.
        mounting: Name of the payload that is replaced.
        carrying: Robot, limits, the scenario's motion, the joints to identify.
        before: The scenario's own payload along its own motion.
        all_torque: Rms torque on each joint in bare and loaded motion with this payload [N m], shape (n,).
        candidates: The best payload of each shape: best first, infeasible ones last.
        again: The best one along a motion that was searched for it; None without such a search.
        shown_below: Largest predicted relative standard deviation of an identifiable gain.
    """

    scenario: Scenario
    mounting: str
    carrying: Carrying
    before: Mounted
    all_torque: Array
    candidates: tuple[Candidate, ...]
    again: Candidate | None
    shown_below: float

    @property
    def joints(self) -> list[int]:
        """Joints to identify, from 0."""
        return self.carrying.design.problem.joints.tolist()

    @property
    def best(self) -> Candidate:
        """The payload to be manufactured.

        Raises:
            ScenarioError: If none is feasible.
        """
        first = self.candidates[0]
        if first.refusal:
            raise ScenarioError(
                f"{self.scenario.name}: no payload meets the limits: the best {first.weight.shape} {first.refusal}"
            )
        return first

    @property
    def after(self) -> Candidate:
        """The best one, along the motion for its use."""
        return self.best if self.again is None else self.again

    def shows(self, deviations: Deviations) -> Mask:
        """Return a mask of joints with an identifiable gain, shape (n,)."""
        return deviations.noise <= self.shown_below

    def worst(self, deviations: Deviations) -> float:
        """Return the largest standard deviation of the gains to identify from noise, with a fully known payload."""
        return float(deviations.noise[self.joints].max())


def design_payload(
    setup: Setup, *, density: float, seed: int, tell: Callable[[int, Callable[[], str]], None]
) -> PayloadDesign:
    """Search for the best payload of every shape along a scenario's motion.

    `density` is that of the material [kg/m^3]; `tell` receives the completed number of `STEPS`, and the current shape.

    Raises:
        ScenarioError: If the scenario mounts no payload.
    """
    stated = design_problem(setup)
    design = Design(replace(stated, joints=np.arange(setup.structure.arm.n)))
    mounting, robot, gains = mountings(setup.protocol)[0], stated.plant.robot, setup.scenario.table.identification.gains
    believed, chi = setup.payloads[mounting], stated.carried.chi
    carrying = Carrying(
        design=design,
        motion=setup.experiments[0].trajectory,
        flange=flange_of(robot),
        known=believed.known,
        most=np.inf if robot.rated_load is None else robot.rated_load,
        density=density,
    )

    def best(number: int, shape: str) -> Candidate:
        return carrying.best(shape, seed, lambda share: tell(round(100 * (number + share)), lambda: shape))

    candidates, rows = [best(number, shape) for number, shape in enumerate(SHAPES)], carrying.rows
    return PayloadDesign(
        scenario=setup.scenario,
        mounting=mounting,
        carrying=carrying,
        before=Mounted(payload=believed, deviations=design.deviations(rows), torque=_payload_torque(rows.Y, chi)),
        all_torque=np.sqrt(np.mean(rows.torques(chi) ** 2, axis=(0, 1))),
        candidates=tuple(sorted(candidates, key=lambda each: (bool(each.refusal), each.cost))),
        again=None,
        shown_below=gains.max_rel_std * RESIDUAL / max(gains.noise_floor, RESIDUAL),
    )


def _payload_torque(Y: Array, chi: Array) -> Array:
    """Return the rms torque of a payload on each joint [N m], shape (n,); Y has shape (N, n, 10)."""
    return np.sqrt(np.mean((Y @ chi) ** 2, axis=0))
