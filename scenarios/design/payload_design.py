"""Design of a payload for a scenario: the best of each shape along the scenario's own motion, beside its own payload.

The motion is sampled once, so the evaluation of a payload takes a few milliseconds. Dimensions are whole millimetres.
Each shape is optimised by differential evolution, within the rated load, the torques of the drives and the distance to
floor and arm. All joints are to be identified.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from pydantic import Field
from scipy import optimize

from ident.payload.payload import Known, Payload, payload_to_table
from ident.support.arrays import Array
from scenarios.design.excitation import EXCESS, FITTED_HZ, SHARES, Design, Problem, design_problem, finite, objective
from scenarios.design.weights import MM, SHAPES, Weight, payload_of, solids
from scenarios.experiments.scenario import Setup, body_of
from scenarios.experiments.schema import mountings
from scenarios.prediction.deviations import RESIDUAL, Carried, Deviations, MotionRows
from scenarios.rendering.content import NONE, Cell, Mood, Paragraph, Part, Table, column, percent, table
from scenarios.rendering.result import ResultModel
from scenarios.support.errors import ScenarioError
from sim.shapes import CLEARANCE, Clearance, Flange, flange_of
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


class DesignedJoint(ResultModel):
    """Effect of a payload on a joint."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    wanted: bool = Field(description="Whether the payload is designed to identify its gain")
    payload_torque_rms: float = Field(description="Rms of the joint torque that the payload causes [N m or N]")
    std: float | None = Field(description="Relative standard deviation of the gain that is predicted from the residual")
    payload_std: float | None = Field(
        description="Relative standard deviation of the gain from the uncertainty of the payload"
    )
    shown: bool = Field(description="Whether the gain is expected to be identifiable")


class DesignedPayload(ResultModel):
    """A payload and its effect on the joints."""

    payload: dict[str, object] = Field(description="The payload, with the keys of a payload file")
    off_axis_mm: float | None = Field(description="Distance of the centre of mass from the flange's axis [mm]")
    joints: list[DesignedJoint] = Field(description="One entry per joint, in order")

    @property
    def worst(self) -> float:
        """Largest standard deviation of a gain with a fully known payload."""
        return max(np.inf if each.std is None else each.std for each in self.joints)

    @property
    def worst_as_made(self) -> float:
        """Largest standard deviation of a gain with the payload's uncertainty."""
        return max(float(np.hypot(each.std or np.inf, each.payload_std or 0.0)) for each in self.joints)


class DesignedWeight(DesignedPayload):
    """A designed payload and its effect on the joints."""

    shape: str = Field(description="Name of the shape")
    dimensions_mm: dict[str, float] = Field(description="Dimensions by name [mm]")
    turned_deg: int = Field(description="Angle about the flange's axis [degrees]")
    density: float = Field(description="Density of the material [kg/m^3]")
    refusal: str | None = Field(description="Why the payload must not be mounted, null if it may be")


class PayloadDesign(ResultModel):
    """What `rx90 payload --json` prints."""

    scenario: str = Field(description="Name of the scenario")
    residual: float = Field(
        description="Expected standard deviation of the residual, as a share of each joint's rms torque"
    )
    rated_load: float | None = Field(description="Rated load of the arm, null if its file does not state one [kg]")
    own_is_better: bool = Field(description="Whether the scenario's own payload identifies the worst joint better")
    flange: str | None = Field(
        description="Frame of the model on which the payload is mounted, null for the axis of the last joint"
    )
    before: DesignedPayload = Field(description="The scenario's own payload")
    after: DesignedPayload = Field(description="The payload to be manufactured")
    candidates: list[DesignedWeight] = Field(
        description="The best payload of each shape: the best first, those that must not be mounted last"
    )

    def parts(self) -> Iterable[Part]:
        """Return conclusion, accuracy by joint before and after, shapes, limits."""
        own, new = self.before.worst, self.after.worst
        if self.own_is_better:
            words = f"The scenario's own payload already identifies the worst joint better: {percent(own, '.2f')} % "
            yield Paragraph(f"{words}against {percent(new, '.2f')} %; keep it.", Mood.DOUBTFUL, strong=True)
        missing = [str(each.joint) for each in self.after.joints if not each.shown]
        worst, shape = percent(self.after.worst_as_made, ".2f"), self.candidates[0].shape
        words = f"The {shape} identifies every joint; the worst gain's standard deviation is {worst} %."
        if missing:
            words = f"No payload within the limits identifies joint {', '.join(missing)}."
        yield Paragraph(words, Mood.BAD if missing else Mood.GOOD, strong=True)
        yield self._joints()
        yield self._shapes()
        for each in self.candidates:
            if each.refusal:
                yield Paragraph(f"The best {each.shape} {each.refusal}; it must not be mounted.", Mood.DOUBTFUL)
        limit = "" if self.rated_load is None else f"rated load {self.rated_load:g} kg, "
        yield Paragraph(
            f"Deviations for a residual of {100.0 * self.residual:g} % of each joint's rms torque; 'payload as made' "
            f"includes the tolerances of dimensions and scale. Limits: {limit}torque of the drives, distance to floor "
            f"and arm. Frame: {self.flange or 'axis of the last joint, as the robot has no flange'}."
        )
        if self.rated_load is None:
            yield Paragraph(
                "WARNING: no rated load is specified, so the payload may be heavier than the arm may carry: look the "
                "load up in the data sheet and state it as rated_load in robot.toml.",
                Mood.DOUBTFUL,
            )

    def _joints(self) -> Table:
        def verdict(before: DesignedJoint, after: DesignedJoint) -> Cell:
            if after.shown:
                return Cell("as before" if before.shown else "identified now", Mood.GOOD)
            return Cell("lost" if before.shown else "refused", Mood.BAD)

        return table(
            list(zip(self.before.joints, self.after.joints, strict=True)),
            column("Joint", lambda row: row[0].joint),
            column("Payload\nbefore [N m rms]", lambda row: f"{row[0].payload_torque_rms:.3g}"),
            column("Deviation\nbefore [%]", lambda row: percent(row[0].std, ".2f")),
            column("Payload\nafter [N m rms]", lambda row: f"{row[1].payload_torque_rms:.3g}"),
            column("Deviation\nafter [%]", lambda row: percent(row[1].std, ".2f")),
            column("Payload\nas made [%]", lambda row: percent(row[1].payload_std, ".2f")),
            column("Gain", lambda row: verdict(*row), words=True),
        )

    def _shapes(self) -> Table:
        rows: list[tuple[Cell, str, DesignedPayload]] = [(Cell("its own"), NONE, self.before)]
        for each in self.candidates:
            sizes = ", ".join(f"{name} {size:g}" for name, size in each.dimensions_mm.items())
            shape = Cell(each.shape, Mood.BAD if each.refusal else Mood.PLAIN)
            rows.append((shape, f"{sizes}, turned {each.turned_deg}\u00b0", each))
        return table(
            rows,
            column("Shape", lambda row: row[0], words=True),
            column("Dimensions [mm]", lambda row: row[1], words=True),
            column("Mass [kg]", lambda row: f"{row[2].payload['mass']:.3f}"),
            column("Off axis [mm]", lambda row: NONE if row[2].off_axis_mm is None else f"{row[2].off_axis_mm:.1f}"),
            column("Worst joint [%]", lambda row: percent(row[2].worst_as_made, ".2f")),
        )


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
        shown_below: Largest predicted relative standard deviation of an identifiable gain.
    """

    design: Design
    motion: FourierTrajectory
    flange: Flange
    known: Known
    most: float
    density: float
    shown_below: float

    @cached_property
    def rows(self) -> MotionRows:
        """The motion, sampled for predictions."""
        return self.design.rows(self.motion)

    @cached_property
    def predict(self) -> Callable[[Carried], Deviations]:
        """Predicts the standard deviations of the gains for a payload."""
        return self.design.problem.prediction(self.rows, self.design.problem.structure)

    @cached_property
    def _fast(self) -> MotionRows:
        return self.design.rows(self.motion, TORQUE_HZ)

    def payload(self, weight: Weight) -> Payload:
        """Return a designed payload as known to the identification."""
        return replace(payload_of(weight, self.flange), known=self.known)

    def problem_with(self, weight: Weight) -> Problem:
        """Return the same problem with a payload on the flange."""
        problem, payload = self.design.problem, self.payload(weight)
        plant = replace(problem.plant, payload=body_of(payload))
        return replace(problem, plant=plant, carried=Carried.nominal(payload), solids=solids(weight, self.flange))

    def cost(self, weight: Weight) -> float:
        """Return the objective; for an infeasible payload, `IMPOSSIBLE` plus its violation."""
        over = weight.uncovered / 10.0 + max(weight.mass / self.most - 1.0, 0.0)
        if over > 0.0:
            return IMPOSSIBLE + 10.0 + over
        what = Carried.nominal(self.payload(weight))
        over = self._torque_used(what) - SHARES["torque"] - EXCESS
        if over > 0.0:
            return IMPOSSIBLE + min(over, 10.0)
        near = max(ROOM - self._distance(weight, NEAR_HZ), 0.0) / ROOM
        return objective(self.predict(what).total) + 10.0 * near

    def refusal(self, weight: Weight) -> str:
        """Return why a payload must not be mounted, or an empty text; distances are checked on a fine grid."""
        if weight.mass > self.most:
            return f"weighs {weight.mass:.2f} kg, more than the robot's rated load of {self.most:g} kg"
        used, may = self._torque_used(Carried.nominal(self.payload(weight))), SHARES["torque"] + EXCESS
        if used > may:
            return f"needs {100.0 * used:.0f} % of a drive's torque, where {100.0 * may:.0f} % may be used"
        near = self._distance(weight, FITTED_HZ)
        if near < CLEARANCE * (1.0 - EXCESS):
            return f"comes within {1e3 * max(near, 0.0):.0f} mm of floor or arm (required {1e3 * CLEARANCE:g} mm)"
        return ""

    def _torque_used(self, what: Carried) -> float:
        """Return the largest torque of bare and loaded motion, as a share of a drive's."""
        used = np.abs(self._fast.torques(what.chi)).max(axis=(0, 1)) / self.design.problem.limits.torque
        return float(used.max())

    def _distance(self, weight: Weight, rate_hz: float) -> float:
        """Return the smallest distance to floor and arm at a sampling rate [m]."""
        problem = self.problem_with(weight)
        q, _, _ = self.motion(np.arange(0.0, self.motion.duration, 1.0 / rate_hz))
        return float(Clearance(problem.plant, ROOM, problem.solids)(q).min())

    def best(self, shape: str, seed: int, tell: Callable[[float], None]) -> Weight:
        """Return the best payload of a shape, a feasible one if any is found. `tell` receives the progress."""
        bounds = np.array([*SHAPES[shape][1].values(), (0, 3)], dtype=np.float64)
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
        looked_at = [weight(found.population[k]) for k in np.argsort(found.population_energies)[:LOOKED_AT]]
        return next((each for each in looked_at if not self.refusal(each)), looked_at[0])

    def effect(self, what: Carried, payload: Payload) -> DesignedPayload:
        """Return the effect of a payload on the gains."""
        deviations, torque = self.predict(what), np.sqrt(np.mean((self.rows.Y @ what.chi) ** 2, axis=0))
        joints = [
            DesignedJoint(
                joint=j + 1,
                wanted=True,
                payload_torque_rms=float(torque[j]),
                std=finite(std),
                payload_std=finite(deviations.payload[j]),
                shown=bool(std <= self.shown_below),
            )
            for j, std in enumerate(deviations.noise)
        ]
        off = None
        if payload.com is not None:
            off = float(np.linalg.norm((self.flange.rotation.T @ (payload.com - self.flange.origin))[:2])) / MM
        return DesignedPayload(payload=payload_to_table(payload), off_axis_mm=off, joints=joints)

    def candidate(self, weight: Weight) -> DesignedWeight:
        """Return a designed payload with its effect, and why it must not be mounted."""
        payload = self.payload(weight)
        return DesignedWeight(
            **self.effect(Carried.nominal(payload), payload).model_dump(),
            shape=weight.shape,
            dimensions_mm=weight.named,
            turned_deg=90 * weight.quarter,
            density=weight.density,
            refusal=self.refusal(weight) or None,
        )


def carrying_of(setup: Setup, density: float) -> Carrying:
    """Return the design problem of a scenario's first payload, of a material's density [kg/m^3].

    Raises:
        ScenarioError: If the scenario mounts no payload.
    """
    stated = design_problem(setup)
    robot, gains = stated.plant.robot, setup.scenario.table.identification.gains
    return Carrying(
        design=Design(replace(stated, joints=np.arange(setup.structure.arm.n))),
        motion=setup.experiments[0].trajectory,
        flange=flange_of(robot),
        known=setup.payloads[mountings(setup.protocol)[0]].known,
        most=np.inf if robot.rated_load is None else robot.rated_load,
        density=density,
        shown_below=gains.max_rel_std * RESIDUAL / max(gains.noise_floor, RESIDUAL),
    )


def design_payload(
    setup: Setup, *, density: float, seed: int, tell: Callable[[int, Callable[[], str]], None]
) -> PayloadDesign:
    """Search for the best payload of every shape along a scenario's motion.

    Args:
        setup: The scenario.
        density: Density of the material [kg/m^3].
        seed: Seed of the search.
        tell: Receives the completed number of `STEPS`, and the current shape.

    Raises:
        ScenarioError: If the scenario mounts no payload; if no payload is feasible.
    """
    carrying = carrying_of(setup, density)

    def best(number: int, shape: str) -> tuple[float, DesignedWeight]:
        weight = carrying.best(shape, seed, lambda share: tell(round(100 * (number + share)), lambda: shape))
        return objective(carrying.predict(Carried.nominal(carrying.payload(weight))).total), carrying.candidate(weight)

    found = [best(number, shape) for number, shape in enumerate(SHAPES)]
    candidates = [each for _, each in sorted(found, key=lambda pair: (pair[1].refusal is not None, pair[0]))]
    first = candidates[0]
    if first.refusal is not None:
        raise ScenarioError(
            f"{setup.scenario.name}: no payload meets the limits: the best {first.shape} {first.refusal}"
        )
    before = carrying.effect(carrying.design.problem.carried, setup.payloads[mountings(setup.protocol)[0]])
    return PayloadDesign(
        scenario=setup.scenario.name,
        residual=RESIDUAL,
        rated_load=finite(carrying.most),
        own_is_better=before.worst <= first.worst,
        flange=carrying.flange.name or None,
        before=before,
        after=DesignedPayload.model_validate(first.model_dump(include=set(DesignedPayload.model_fields))),
        candidates=candidates,
    )
