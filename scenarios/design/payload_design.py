"""Design of a payload for a scenario: the best of each shape along the scenario's own motion, beside its own payload.

Shapes are those that a workshop can make from bar, plate and block. Dimensions are whole millimetres; z points out of
the flange, and x is the direction of the offset. Screws and their holes are neglected. Each shape is optimised by
differential evolution for the objective of a motion, with all joints to be identified, within the rated load, the
torques of the drives and the distance to floor and arm.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from pydantic import Field
from scipy import optimize

from ident.payload.payload import Payload, payload_to_table
from ident.support.arrays import Array
from scenarios.design.excitation import EXCESS, FITTED_HZ, SEARCHED_HZ, Design, finite, objective
from scenarios.experiments.scenario import Setup, body_of
from scenarios.experiments.schema import mountings
from scenarios.prediction.deviations import RESIDUAL, ROWS_PER_SECOND, Carried
from scenarios.rendering.content import NONE, Cell, Mood, Paragraph, Part, column, percent, table
from scenarios.rendering.result import ResultModel
from scenarios.support.errors import ScenarioError
from sim.shapes import Flange, Solid, flange_of

FACE = 31.5
"""Radius of the flange's face [mm]: ISO 9409-1-50-4-M6, as on arms for 3 to 15 kg; assumed for all robots."""
BRACKET = 15.0
"""Thickness of a bracket [mm]."""
MM = 1e-3
MASS_STD = 0.025
"""Standard deviation of the paper's scale [kg]: +-0.050 kg as two standard deviations."""
MEDIUM = ((6.0, 0.1), (30.0, 0.2), (120.0, 0.3), (400.0, 0.5), (np.inf, 0.8))
"""Tolerance [mm] of dimensions up to a size [mm]: ISO 2768-1, class m."""
SEAT_MM = 0.1
"""Standard deviation of the mounting position across the flange's axis [mm]; assumed for dowel pins."""
TURN = np.deg2rad(0.1)
"""Standard deviation of the mounting angle about the flange's axis [rad]; assumed for dowel pins."""
IMPOSSIBLE = 100.0
"""Base cost of a payload that violates a bound."""
POPULATION, GENERATIONS = 8, 25
"""Population size per dimension, and number of generations."""
LOOKED_AT = 10
"""Largest number of the best candidates that are checked on a fine grid until one is feasible."""


class Block(NamedTuple):
    """A box, or a cylinder about z: its extent along x, y, z and its centre in the payload's axes [mm]."""

    cylinder: bool
    edges: tuple[float, ...]
    center: tuple[float, float, float]


SHAPES: Mapping[str, Mapping[str, tuple[int, int]]] = {
    "cylinder": {"diameter": (63, 300), "length": (10, 300), "offset": (0, 118)},
    "plate": {"length": (63, 600), "width": (63, 300), "thickness": (5, 60), "offset": (0, 268)},
    "bar": {"side": (20, 120), "length": (40, 300), "offset": (0, 250)},
}
"""Dimensions with bounds [mm]: a cylinder or a plate on the flange, a square bar on a bracket."""
STEPS = 100 * len(SHAPES)  # steps of a design for the progress display


@dataclass(frozen=True, slots=True, kw_only=True)
class Weight:
    """A nominal payload.

    Attributes:
        shape: Name of the shape, a key of `SHAPES`.
        dimensions: Dimensions [mm], in the shape's order.
        quarter: Number of quarter turns about z from the flange's x to the payload's, as four screws allow.
        density: [kg/m^3].
    """

    shape: str
    dimensions: tuple[float, ...]
    quarter: int
    density: float

    @property
    def blocks(self) -> list[Block]:
        """Its blocks; the first is on the flange, and the bracket of a bar covers the flange's face."""
        first, *others, offset = self.dimensions
        if self.shape == "cylinder":
            return [Block(True, (first, first, others[0]), (offset, 0.0, others[0] / 2.0))]
        if self.shape == "plate":
            return [Block(False, (first, *others), (offset, 0.0, others[-1] / 2.0))]
        reach = FACE + max(FACE, offset + first / 2.0)
        bracket = Block(False, (reach, max(2.0 * FACE, first), BRACKET), (reach / 2.0 - FACE, 0.0, BRACKET / 2.0))
        return [bracket, Block(False, (first, first, others[0]), (offset, 0.0, BRACKET + others[0] / 2.0))]

    @property
    def uncovered(self) -> float:
        """Width of the flange's face that the payload leaves free [mm]."""
        on_flange = self.blocks[0]
        return max(round(on_flange.center[0] + FACE - on_flange.edges[0] / 2.0, 6), 0.0)

    def solids(self, flange: Flange, seat: Sequence[float] = (0.0, 0.0), turn: float = 0.0) -> tuple[Solid, ...]:
        """Return its blocks in the frame of the last link, mounted with errors of position [mm] and angle [rad]."""
        angle = turn + 0.5 * np.pi * self.quarter
        c, s = np.cos(angle), np.sin(angle)
        rotation = flange.rotation @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return tuple(
            Solid(
                cylinder=block.cylinder,
                size=tuple(MM / 2.0 * edge for edge in (block.edges[1:] if block.cylinder else block.edges)),
                center=flange.origin + MM * rotation @ np.add(block.center, (*seat, 0.0)),
                rotation=rotation,
            )
            for block in self.blocks
        )


def mass_properties(solids: Sequence[Solid], density: float) -> Array:
    """Return mass [kg], centre [m] and inertia xx, yy, zz, xy, xz, yz about it [kg m^2] (Huygens-Steiner), (10,)."""
    masses, squares = np.empty(len(solids)), np.empty((len(solids), 3))  # mean squares of x, y, z about the centre
    for k, solid in enumerate(solids):
        if solid.cylinder:
            radius, half = solid.size
            masses[k], squares[k] = 2.0 * np.pi * radius**2 * half, (radius**2 / 4.0, radius**2 / 4.0, half**2 / 3.0)
        else:
            masses[k], squares[k] = 8.0 * np.prod(solid.size), np.square(solid.size) / 3.0
    masses *= density
    com = masses @ np.array([solid.center for solid in solids]) / masses.sum()
    second = np.zeros((3, 3))  # moments of mass
    for m, solid, square in zip(masses, solids, squares, strict=True):
        r = solid.center - com
        second += m * (solid.rotation * square @ solid.rotation.T + np.outer(r, r))
    J = np.trace(second) * np.eye(3) - second
    return np.array([masses.sum(), *com, J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]])


def dimension_std(size_mm: float) -> float:
    """Return the standard deviation of a dimension [mm]: uniform within its tolerance."""
    return next(tolerance for most, tolerance in MEDIUM if size_mm <= most) / np.sqrt(3.0)


def payload_of(weight: Weight, flange: Flange) -> Payload:
    """Return the payload for identification, in the frame of the last link: weighed, other values nominal.

    Standard deviations are those of manufacture, for the weighed mass, and of mounting.
    """
    nominal = mass_properties(weight.solids(flange), weight.density)

    def off(solids: Sequence[Solid]) -> Array:
        """Return the change of centre and inertia, of the weighed mass."""
        made = mass_properties(solids, weight.density)
        made[4:] *= nominal[0] / made[0]
        return (made - nominal)[1:]

    steps = np.diag([dimension_std(size) for size in weight.dimensions])
    others = [replace(weight, dimensions=tuple((step + weight.dimensions).tolist())) for step in steps]
    changes = [off(other.solids(flange)) for other in others]
    changes += [off(weight.solids(flange, seat=seat)) for seat in (SEAT_MM * np.eye(2)).tolist()]
    changes.append(off(weight.solids(flange, turn=TURN)))
    mass, x, y, z, ixx, iyy, izz, ixy, ixz, iyz = nominal.tolist()
    x_std, y_std, z_std, *inertia_std = np.linalg.norm(changes, axis=0).tolist()
    return Payload(
        mass=mass,
        mass_std=MASS_STD,
        com=(x, y, z),
        com_std=(x_std, y_std, z_std),
        inertia=(ixx, iyy, izz, ixy, ixz, iyz),
        inertia_std=tuple(inertia_std),
        known="all",
    )


class DesignedJoint(ResultModel):
    """Effect of a payload on a joint."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    wanted: bool = Field(description="Whether the payload is designed to identify its gain")
    payload_torque_rms: float = Field(description="Rms of the joint torque that the payload causes [N m or N]")
    std: float | None = Field(description="Relative standard deviation of the gain that is predicted from the residual")
    payload_std: float | None = Field(description="The same from the payload's uncertainty, relative")
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
    residual: float = Field(description="Expected standard deviation of the residual, as a share of the rms torque")
    rated_load: float | None = Field(description="Rated load of the arm, null if its file does not state one [kg]")
    own_is_better: bool = Field(description="Whether the scenario's own payload identifies the worst joint better")
    flange: str | None = Field(description="Frame on which the payload is mounted, null for the last joint's axis")
    before: DesignedPayload = Field(description="The scenario's own payload")
    after: DesignedPayload = Field(description="The payload to be manufactured")
    candidates: list[DesignedWeight] = Field(description="The best of each shape: the best first, refused ones last")

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
        yield table(
            list(zip(self.before.joints, self.after.joints, strict=True)),
            column("Joint", lambda row: row[0].joint),
            column("Payload\nbefore [N m rms]", lambda row: f"{row[0].payload_torque_rms:.3g}"),
            column("Deviation\nbefore [%]", lambda row: percent(row[0].std, ".2f")),
            column("Payload\nafter [N m rms]", lambda row: f"{row[1].payload_torque_rms:.3g}"),
            column("Deviation\nafter [%]", lambda row: percent(row[1].std, ".2f")),
            column("Payload\nas made [%]", lambda row: percent(row[1].payload_std, ".2f")),
            column("Gain", lambda row: _verdict(*row), words=True),
        )
        yield table(
            [self.before, *self.candidates],
            column("Shape", lambda each: _shape(each)[0], words=True),
            column("Dimensions [mm]", lambda each: _shape(each)[1], words=True),
            column("Mass [kg]", lambda each: f"{each.payload['mass']:.3f}"),
            column("Off axis [mm]", lambda each: NONE if each.off_axis_mm is None else f"{each.off_axis_mm:.1f}"),
            column("Worst joint [%]", lambda each: percent(each.worst_as_made, ".2f")),
        )
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


def _verdict(before: DesignedJoint, after: DesignedJoint) -> Cell:
    if after.shown:
        return Cell("as before" if before.shown else "identified now", Mood.GOOD)
    return Cell("lost" if before.shown else "refused", Mood.BAD)


def _shape(each: DesignedPayload) -> tuple[Cell, str]:
    """Return name and dimensions of a shape."""
    if not isinstance(each, DesignedWeight):
        return Cell("its own"), NONE
    sizes = ", ".join(f"{name} {size:g}" for name, size in each.dimensions_mm.items())
    return Cell(each.shape, Mood.BAD if each.refusal else Mood.PLAIN), f"{sizes}, turned {each.turned_deg}\u00b0"


class PayloadSearch:
    """The search for a payload along the motion of a scenario, for the gains of all joints."""

    def __init__(self, setup: Setup, density: float) -> None:
        """Sample the motion, for a material's density [kg/m^3]; a `ScenarioError` if no payload is mounted."""
        stated, motion = Design.of(setup), setup.experiments[0].trajectory
        free = dict.fromkeys(("velocity", "acceleration", "upper"), np.full(motion.n, 1e9))  # the motion is given
        self.design = replace(stated, limits=replace(stated.limits, **free, lower=-free["upper"]))
        robot, gains = self.design.plant.robot, setup.scenario.table.identification.gains
        self.flange, self.density = flange_of(robot), density
        self.own = setup.payloads[mountings(setup.protocol)[0]]
        self.most = np.inf if robot.rated_load is None else robot.rated_load
        self.rows, self._coarse, self._fine = (
            self.design.rows(motion, hz) for hz in (ROWS_PER_SECOND, SEARCHED_HZ, FITTED_HZ)
        )
        self.predict = self.design.prediction(self.rows, setup.structure)
        self._shown_below = gains.max_rel_std * RESIDUAL / max(gains.noise_floor, RESIDUAL)

    def payload(self, weight: Weight) -> Payload:
        """Return a designed payload as known to the identification."""
        return replace(payload_of(weight, self.flange), known=self.own.known)

    def loaded(self, payload: Payload, weight: Weight) -> Design:
        """Return the design problem with a payload on the flange."""
        plant, solids = replace(self.design.plant, payload=body_of(payload)), weight.solids(self.flange)
        return replace(self.design, plant=plant, carried=Carried.nominal(payload), solids=solids)

    def cost(self, weight: Weight) -> float:
        """Return the objective; for an infeasible payload, `IMPOSSIBLE` plus its violation."""
        payload = self.payload(weight)
        over = weight.uncovered / 10.0 + max(payload.mass / self.most - 1.0, 0.0)
        if over > 0.0:
            return IMPOSSIBLE + 10.0 + over
        loaded = self.loaded(payload, weight)
        over = loaded.largest_excess(self._coarse)
        return IMPOSSIBLE + min(over, 10.0) if over > EXCESS else objective(self.predict(loaded.carried).total)

    def refusal(self, weight: Weight) -> str:
        """Return why a payload must not be mounted, or an empty text; limits are checked on a fine grid."""
        payload = self.payload(weight)
        if payload.mass > self.most:
            return f"weighs {payload.mass:.2f} kg, more than the robot's rated load of {self.most:g} kg"
        loaded = self.loaded(payload, weight)
        return loaded.broken(self._fine) if loaded.largest_excess(self._fine) > EXCESS else ""

    def best(self, shape: str, seed: int, tell: Callable[[float], None]) -> Weight:
        """Return the best payload of a shape, a feasible one if any is found. `tell` receives the progress."""
        bounds = np.array([*SHAPES[shape].values(), (0, 3)], dtype=np.float64)
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
                shown=bool(std <= self._shown_below),
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
            dimensions_mm=dict(zip(SHAPES[weight.shape], weight.dimensions, strict=True)),
            turned_deg=90 * weight.quarter,
            density=weight.density,
            refusal=self.refusal(weight) or None,
        )


def design_payload(
    setup: Setup, *, density: float, seed: int, tell: Callable[[int, Callable[[], str]], None]
) -> PayloadDesign:
    """Search for the best payload of every shape along a scenario's motion.

    `density` is that of the material [kg/m^3], `seed` that of the search; `tell` receives the completed number of
    `STEPS`, and the current shape.

    Raises:
        ScenarioError: If the scenario mounts no payload; if no payload is feasible.
    """
    payloads = PayloadSearch(setup, density)

    def best(number: int, shape: str) -> tuple[float, DesignedWeight]:
        weight = payloads.best(shape, seed, lambda share: tell(round(100 * (number + share)), lambda: shape))
        return objective(payloads.predict(Carried.nominal(payloads.payload(weight))).total), payloads.candidate(weight)

    found = [best(number, shape) for number, shape in enumerate(SHAPES)]
    candidates = [each for _, each in sorted(found, key=lambda pair: (pair[1].refusal is not None, pair[0]))]
    first = candidates[0]
    if first.refusal is not None:
        raise ScenarioError(
            f"{setup.scenario.name}: no payload meets the limits: the best {first.shape} {first.refusal}"
        )
    before = payloads.effect(payloads.design.carried, payloads.own)
    return PayloadDesign(
        scenario=setup.scenario.name,
        residual=RESIDUAL,
        rated_load=finite(payloads.most),
        own_is_better=before.worst <= first.worst,
        flange=payloads.flange.name or None,
        before=before,
        after=DesignedPayload.model_validate(first.model_dump(include=set(DesignedPayload.model_fields))),
        candidates=candidates,
    )
