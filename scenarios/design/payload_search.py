"""Search for a weight: the shape and dimensions that show the wanted gains best along a motion that stays as it is.

What the motion puts on the arm is sampled once, so that a candidate costs a few milliseconds; dimensions are whole
millimetres. Each kind of weight is searched by differential evolution.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize

from ident.payload.payload import Known, Payload
from ident.support.arrays import Array
from scenarios.design.excitation import EXCESS, FITTED_HZ, Design, Problem, objective
from scenarios.design.limits import CLEARANCE, TORQUE_SHARE
from scenarios.design.prediction import Deviations
from scenarios.design.rows import drawn
from scenarios.design.tolerances import payload_of
from scenarios.design.weights import MM, SHAPES, Weight, mass_properties
from sim.clearance import Clearance, Solid
from sim.flange import Flange
from sim.plant import PayloadBody
from sim.trajectory import FourierTrajectory

NEAR_HZ, TORQUE_HZ = 10.0, 50.0
"""Samples a second at which distances and torques are looked at during the search."""
ROOM = 1.3 * CLEARANCE
"""Distance that the search keeps, where a finer look will want `CLEARANCE` [m]."""
IMPOSSIBLE = 100.0
"""Cost of a candidate that breaks a bound, before it is said by how much."""
POPULATION, GENERATIONS = 8, 25
"""Candidates a dimension, and how often they are renewed."""
LOOKED_AT = 10
"""Of the best candidates that are left, how many are looked at on a fine grid until one may be mounted."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Carrying:
    """What a weight is designed for.

    Attributes:
        design: Robot, limits and wanted joints.
        motion: The motion.
        flange: Where weights are mounted.
        known: What identification is to be told of the weight.
        most: Largest mass [kg]; infinite if nobody says.
        density: Of the material [kg/m^3].
    """

    design: Design
    motion: FourierTrajectory
    flange: Flange
    known: Known
    most: float
    density: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Candidate:
    """A weight that was found.

    Attributes:
        weight: Its drawing.
        payload: What identification is told.
        deviations: Predicted.
        torque: Of the payload on each joint, rms [N m], shape (n,).
        cost: Objective of the wanted joints.
        refusal: Why it must not be mounted; empty if it may.
    """

    weight: Weight
    payload: Payload
    deviations: Deviations
    torque: Array
    cost: float
    refusal: str


class Judged:
    """The cost of weights along one motion."""

    def __init__(self, carrying: Carrying) -> None:
        """Sample the motion."""
        problem = carrying.design.problem
        self._carrying, self._problem = carrying, problem
        rows = carrying.design.rows(carrying.motion)
        self._rows = rows
        self._predict = problem.prediction(rows, problem.structure)
        self._fast = carrying.design.rows(carrying.motion, TORQUE_HZ)
        self._near = carrying.motion(np.arange(0.0, carrying.motion.duration, 1.0 / NEAR_HZ))[0]
        self._fine = carrying.motion(np.arange(0.0, carrying.motion.duration, 1.0 / FITTED_HZ))[0]

    def payload(self, weight: Weight) -> Payload:
        """A weight as identification is to be told of it."""
        return replace(payload_of(weight, self._carrying.flange), known=self._carrying.known)

    def cost(self, weight: Weight) -> float:
        """Objective of the wanted joints; of an impossible weight, `IMPOSSIBLE` and more the less possible it is."""
        missing = SHAPES[weight.shape].missing(weight.dimensions)
        mass = mass_properties(weight.parts, weight.density).mass
        over = max(missing, 0.0) / 10.0 + max(mass / self._carrying.most - 1.0, 0.0)
        if over > 0.0:
            return IMPOSSIBLE + 10.0 + over
        payload = self.payload(weight)
        over = self._torque_excess(payload)
        if over > 0.0:
            return IMPOSSIBLE + min(over, 10.0)
        value = objective(self._predict(drawn(payload)).total[self._problem.joints])
        near = max(ROOM - float(self._distance(weight, payload, self._near)), 0.0) / ROOM
        return value + 10.0 * near

    def candidate(self, weight: Weight) -> Candidate:
        """Everything about one weight, distances on a fine grid."""
        payload = self.payload(weight)
        what = drawn(payload)
        deviations = self._predict(what)
        return Candidate(
            weight=weight,
            payload=payload,
            deviations=deviations,
            torque=payload_torque(self._rows.Y, what.chi),
            cost=objective(deviations.total[self._problem.joints]),
            refusal=self._refusal(weight, payload),
        )

    def _refusal(self, weight: Weight, payload: Payload) -> str:
        if payload.mass > self._carrying.most:
            return f"weighs {payload.mass:.2f} kg, the robot may carry {self._carrying.most:g} kg"
        over = self._torque_excess(payload)
        if over > 0.0:
            return f"needs {100.0 * (over + TORQUE_SHARE + EXCESS):.0f} % of a drive's torque"
        near = float(self._distance(weight, payload, self._fine))
        if near < CLEARANCE * (1.0 - EXCESS):
            return f"has a clearance of {1e3 * near:.0f} mm to floor or arm"
        return ""

    def _torque_excess(self, payload: Payload) -> float:
        torques = self._fast.torques(drawn(payload).chi)
        return float((np.abs(torques).max(axis=(0, 1)) / self._problem.limits.torque).max()) - TORQUE_SHARE - EXCESS

    def _distance(self, weight: Weight, payload: Payload, q: Array) -> float:
        plant = replace(self._problem.plant, payload=payload_body(payload))
        return float(Clearance(plant, ROOM, solids(weight, self._carrying.flange))(q).min())


def best_weight(carrying: Carrying, shape: str, seed: int, tell: Callable[[float], None]) -> Candidate:
    """The best weight of a shape.

    Args:
        carrying: What it is for.
        shape: Of `SHAPES`.
        seed: Of the random numbers.
        tell: Told the share of the search that is done, now and then.
    """
    judged = Judged(carrying)
    bounds = [(d.least, d.most) for d in SHAPES[shape].dimensions] + [(0, 3)]
    calls = 0

    def weight(x: Array) -> Weight:
        *dimensions, quarter = np.rint(x).tolist()
        return Weight(
            shape=shape, dimensions=tuple(map(float, dimensions)), quarter=int(quarter), density=carrying.density
        )

    def cost(x: Array) -> float:
        nonlocal calls
        calls += 1
        tell(min(calls / (POPULATION * len(bounds) * (GENERATIONS + 1)), 1.0))
        return judged.cost(weight(x))

    found = optimize.differential_evolution(
        cost,
        optimize.Bounds([float(low) for low, _ in bounds], [float(high) for _, high in bounds]),
        integrality=[True] * len(bounds),
        rng=np.random.default_rng(seed),
        popsize=POPULATION,
        maxiter=GENERATIONS,
        tol=1e-4,
        polish=False,
    )
    order = np.argsort(found.population_energies)[:LOOKED_AT]
    looked_at = [judged.candidate(weight(found.population[k])) for k in order]
    return next((candidate for candidate in looked_at if not candidate.refusal), looked_at[0])


def along(candidate: Candidate, design: Design, motion: FourierTrajectory) -> Candidate:
    """The same weight along another motion.

    Args:
        candidate: The weight.
        design: Of the problem with it.
        motion: Which that design allows.
    """
    rows = design.rows(motion)
    deviations = design.deviations(rows)
    return replace(
        candidate,
        deviations=deviations,
        torque=payload_torque(rows.Y, drawn(candidate.payload).chi),
        cost=objective(deviations.total[design.problem.joints]),
    )


def problem_with(problem: Problem, candidate: Candidate, flange: Flange) -> Problem:
    """The same problem with another weight on the flange."""
    return replace(
        problem,
        plant=replace(problem.plant, payload=payload_body(candidate.payload)),
        carried=drawn(candidate.payload),
        solids=solids(candidate.weight, flange),
    )


def payload_torque(Y: Array, chi: Array) -> Array:
    """Rms torque that a payload puts on each joint [N m], shape (n,); Y (N, n, 10)."""
    return np.sqrt(np.mean((Y @ chi) ** 2, axis=0))


def payload_body(payload: Payload) -> PayloadBody:
    """A payload that is as drawn."""
    assert payload.com is not None, "a weight is drawn in full"
    assert payload.inertia is not None, "a weight is drawn in full"
    return PayloadBody(mass=payload.mass, com=payload.com, inertia=payload.inertia)


def solids(weight: Weight, flange: Flange) -> tuple[Solid, ...]:
    """Its parts in the frame of the last link."""
    rotation = flange.rotation @ weight.turned
    return tuple(
        Solid(
            cylinder=part.cylinder,
            size=tuple(MM / 2.0 * edge for edge in part.size),
            center=flange.origin + rotation @ (MM * np.array(part.center)),
            rotation=rotation,
        )
        for part in weight.parts
    )
