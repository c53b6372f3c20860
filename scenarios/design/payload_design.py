"""Design of a payload for a scenario: the best of each shape along the scenario's own motion, beside its own payload.

Shapes are those that a workshop can make from bar, plate and block. Dimensions are whole millimetres; z points out of
the flange, and x is the direction of the offset. Screws and their holes are neglected. Each shape is optimised by
differential evolution for the objective of a motion, with all joints to be identified, within the rated load, the
torques of the drives and the distance to floor and arm.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count

import numpy as np
import pinocchio as pin  # pyright: ignore[reportMissingImports]
from pydantic import Field
from scipy import optimize
from scipy.spatial.transform import Rotation

from ident.payload.payload import Payload, payload_to_table
from ident.support.arrays import Array
from scenarios.design.excitation import EXCESS, FITTED_HZ, SEARCHED_HZ, Design, finite, objective
from scenarios.experiments.scenario import Setup
from scenarios.experiments.schema import body_of, mountings
from scenarios.prediction.deviations import RESIDUAL, ROWS_PER_SECOND, Carried
from scenarios.rendering.content import Cell, Mood, Paragraph, Part, column, table
from scenarios.rendering.result import ResultModel
from scenarios.rendering.wording import NONE, percent
from scenarios.support.errors import ScenarioError
from sim.shapes import Flange, Solid, flange_of

FACE = 31.5
"""Radius of the flange's face [mm]: ISO 9409-1-50-4-M6, as on arms for 3 to 15 kg; assumed for all robots."""
BRACKET = 15.0
"""Thickness of a bracket [mm]."""
MM = 1e-3
COM_STD, INERTIA_STD = 2e-4, 3e-3
"""Standard deviations of a finished payload: of its centre along each axis [m], and of its inertia as a share of the
largest moment. Assumed: tolerances of ISO 2768-1 m and dowel pins give 0.1 to 0.2 mm and 0.2 to 0.4 %.
"""
IMPOSSIBLE = 100.0
"""Base cost of a payload that violates a bound."""
POPULATION, GENERATIONS = 8, 25
"""Population size per dimension, and number of generations."""


SHAPES: Mapping[str, Mapping[str, tuple[int, int]]] = {
    "cylinder": {"diameter": (63, 300), "length": (10, 300), "offset": (0, 118)},
    "plate": {"length": (63, 600), "width": (63, 300), "thickness": (5, 60), "offset": (0, 268)},
    "bar": {"side": (20, 120), "length": (40, 300), "offset": (0, 250)},
}
"""Dimensions with bounds [mm]: a cylinder or a plate on the flange, a square bar on a bracket."""
STEPS = 100 * len(SHAPES)  # steps of a design for the progress display
VERDICTS = {
    (True, True): Cell("as before", Mood.GOOD),
    (False, True): Cell("identified now", Mood.GOOD),
    (True, False): Cell("lost", Mood.BAD),
    (False, False): Cell("refused", Mood.DOUBTFUL),
}
"""Verdict of a gain that was identifiable before and is with the payload."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Weight:
    """A nominal payload."""

    shape: str  # a key of `SHAPES`
    dimensions: tuple[float, ...]  # [mm], in the shape's order
    quarter: int  # number of quarter turns about z from the flange's x to the payload's, as four screws allow
    density: float  # [kg/m^3]

    @property
    def blocks(self) -> Array:
        """Extents and centre of each block in the payload's axes [mm], (., 2, 3), first that on the flange."""
        first, *others, offset = self.dimensions
        if self.shape == "bar":
            reach = FACE + max(FACE, offset + first / 2.0)
            bracket = (reach, max(2.0 * FACE, first), BRACKET), (reach / 2.0 - FACE, 0.0, BRACKET / 2.0)
            return np.array([bracket, ((first, first, *others), (offset, 0.0, BRACKET + others[0] / 2.0))])
        across = [first] if self.shape == "cylinder" else []
        return np.array([((first, *across, *others), (offset, 0.0, others[-1] / 2.0))])

    @property
    def uncovered(self) -> float:
        """Width of the flange's face that the payload leaves free [mm]."""
        edges, center = self.blocks[0]
        return max(round(float(center[0] + FACE - edges[0] / 2.0), 6), 0.0)

    def solids(self, flange: Flange) -> tuple[Solid, ...]:
        """Return its blocks in the frame of the last link."""
        rotation = flange.rotation @ Rotation.from_euler("z", 90.0 * self.quarter, degrees=True).as_matrix()
        cylinder, solids = self.shape == "cylinder", list[Solid]()
        for edges, center in self.blocks:
            size, at = tuple((MM / 2.0 * edges[int(cylinder) :]).tolist()), flange.origin + MM * rotation @ center
            solids.append(Solid(cylinder=cylinder, size=size, center=at, rotation=rotation))
        return tuple(solids)


def mass_properties(solids: Sequence[Solid], density: float) -> Array:
    """Return mass [kg], centre [m] and inertia xx, yy, zz, xy, xz, yz about it [kg m^2] (Huygens-Steiner), (10,)."""
    whole = pin.Inertia.Zero()
    for solid in solids:
        sides = 2.0 * np.array(solid.size)
        if solid.cylinder:
            diameter, length = sides
            own = pin.Inertia.FromCylinder(density * np.pi / 4.0 * diameter**2 * length, diameter / 2.0, length)
        else:
            own = pin.Inertia.FromBox(density * np.prod(sides), *sides)
        whole += pin.SE3(solid.rotation, solid.center).act(own)
    J = whole.inertia
    return np.array([whole.mass, *whole.lever, J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]])


def payload_of(weight: Weight, flange: Flange) -> Payload:
    """Return the payload for identification, in the frame of the last link: weighed, other values nominal."""
    mass, x, y, z, ixx, iyy, izz, ixy, ixz, iyz = mass_properties(weight.solids(flange), weight.density).tolist()
    return Payload(
        mass=mass,
        mass_std=0.025,  # of the paper's scale: +-0.050 kg as two standard deviations
        com=(x, y, z),
        com_std=(COM_STD, COM_STD, COM_STD),
        inertia=(ixx, iyy, izz, ixy, ixz, iyz),
        inertia_std=(INERTIA_STD * max(ixx, iyy, izz),) * 6,
        known="all",
    )


class DesignedJoint(ResultModel):
    """Effect of a payload on a joint."""

    joint: int = Field(ge=1)  # number of the joint, from 1
    payload_torque_rms: float  # rms of the joint torque that the payload causes [N m or N]
    std: float | None  # relative standard deviation of the gain that is predicted from the residual
    payload_std: float | None  # the same from the payload's uncertainty, relative
    shown: bool  # whether the gain is expected to be identifiable


class DesignedPayload(ResultModel):
    """A payload and its effect on the joints."""

    payload: dict[str, object]  # the payload, with the keys of a payload file
    off_axis_mm: float | None  # distance of the centre of mass from the flange's axis [mm]
    joints: list[DesignedJoint]  # one entry per joint, in order

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

    shape: str  # name of the shape
    dimensions_mm: dict[str, float]  # dimensions by name [mm]
    turned_deg: int  # angle about the flange's axis [degrees]
    refusal: str | None  # why the payload must not be mounted, null if it may be

    @property
    def sizes(self) -> str:
        """Dimensions and angle, in words."""
        sizes = ", ".join(f"{name} {size:g}" for name, size in self.dimensions_mm.items())
        return f"{sizes}, turned {self.turned_deg}°"


class PayloadDesign(ResultModel):
    """What `rx90 payload --json` prints."""

    scenario: str  # name of the scenario
    residual: float  # expected standard deviation of the residual, as a share of the rms torque
    rated_load: float | None  # rated load of the arm, null if its file does not state one [kg]
    own_is_better: bool  # whether the scenario's own payload identifies the worst joint better
    flange: str | None  # frame on which the payload is mounted, null for the last joint's axis
    before: DesignedPayload  # the scenario's own payload
    candidates: list[DesignedWeight]  # the best of each shape: first the one to be manufactured, refused ones last

    @property
    def after(self) -> DesignedWeight:
        """The payload to be manufactured."""
        return self.candidates[0]

    def parts(self) -> Iterable[Part]:
        """Return conclusion, accuracy by joint before and after, shapes, limits."""
        own, new, made = (
            percent(std, ".2f") for std in (self.before.worst, self.after.worst, self.after.worst_as_made)
        )
        if self.own_is_better:
            words = f"The scenario's own payload already identifies the worst joint better: {own} % against {new} %"
            yield Paragraph(f"{words}; keep it.", Mood.DOUBTFUL, strong=True)
        words = f"The {self.after.shape} identifies every joint; the worst gain's standard deviation is {made} %."
        if missing := [str(each.joint) for each in self.after.joints if not each.shown]:
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
            column("Gain", lambda row: VERDICTS[row[0].shown, row[1].shown], words=True),
        )
        yield table(
            [("its own", NONE, self.before), *((each.shape, each.sizes, each) for each in self.candidates)],
            column("Shape", lambda row: row[0], words=True),
            column("Dimensions [mm]", lambda row: row[1], words=True),
            column("Mass [kg]", lambda row: f"{row[2].payload['mass']:.3f}"),
            column("Off axis [mm]", lambda row: NONE if row[2].off_axis_mm is None else f"{row[2].off_axis_mm:.1f}"),
            column("Worst joint [%]", lambda row: percent(row[2].worst_as_made, ".2f")),
        )
        for each in self.candidates:
            if each.refusal:
                yield Paragraph(f"The best {each.shape} {each.refusal}; it must not be mounted.", Mood.DOUBTFUL)
        rated = "no rated load (WARNING: look it up in the data sheet and state it as rated_load in robot.toml)"
        if self.rated_load is not None:
            rated = f"rated load {self.rated_load:g} kg"
        yield Paragraph(
            f"Deviations for a residual of {100.0 * self.residual:g} % of each joint's rms torque; 'payload as made' "
            "includes the tolerances of dimensions and scale. Limits: torque of the drives, distance to floor and arm, "
            f"{rated}. Frame: {self.flange or 'axis of the last joint, as the robot has no flange'}.",
            Mood.DOUBTFUL if self.rated_load is None else Mood.PLAIN,
        )


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
        self.predict = self.design.predicted(self.rows)
        self._shown_below = gains.max_rel_std * RESIDUAL / max(gains.noise_floor, RESIDUAL)

    def payload(self, weight: Weight) -> Payload:
        """Return a designed payload as known to the identification."""
        return replace(payload_of(weight, self.flange), known=self.own.known)

    def loaded(self, weight: Weight) -> Design:
        """Return the design problem with a payload on the flange."""
        payload, solids = self.payload(weight), weight.solids(self.flange)
        plant = replace(self.design.plant, payload=body_of(payload))
        return replace(self.design, plant=plant, carried=Carried.nominal(payload), solids=solids)

    def cost(self, weight: Weight) -> float:
        """Return the objective; for an infeasible payload, `IMPOSSIBLE` plus its violation."""
        loaded = self.loaded(weight)
        over = weight.uncovered / 10.0 + max(loaded.plant.payload.mass / self.most - 1.0, 0.0)
        if over > 0.0:
            return IMPOSSIBLE + 10.0 + over
        over = float(loaded.excess(self._coarse).max())
        return IMPOSSIBLE + min(over, 10.0) if over > EXCESS else objective(self.predict(loaded.carried).total)

    def refusal(self, weight: Weight) -> str | None:
        """Return why a payload must not be mounted, None if it may be; limits are checked on a fine grid."""
        loaded = self.loaded(weight)
        if (mass := loaded.plant.payload.mass) > self.most:
            return f"weighs {mass:.2f} kg, more than the robot's rated load of {self.most:g} kg"
        return loaded.broken(self._fine) if loaded.excess(self._fine).max() > EXCESS else None

    def best(self, shape: str, seed: int, tell: Callable[[float], None]) -> Weight:
        """Return the best payload of a shape, a feasible one if any is found. `tell` receives the progress."""
        bounds, calls = np.array([*SHAPES[shape].values(), (0, 3)], dtype=np.float64), count(1)

        def weight(x: Array) -> Weight:
            *dimensions, quarter = np.rint(x).tolist()
            return Weight(shape=shape, dimensions=tuple(dimensions), quarter=int(quarter), density=self.density)

        def cost(x: Array) -> float:
            tell(min(next(calls) / (POPULATION * len(bounds) * (GENERATIONS + 1)), 1.0))
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
        looked_at = [weight(found.population[k]) for k in np.argsort(found.population_energies)[:10]]
        return next((each for each in looked_at if not self.refusal(each)), looked_at[0])

    def effect(self, what: Carried, payload: Payload) -> DesignedPayload:
        """Return the effect of a payload on the gains."""
        deviations, torque = self.predict(what), np.sqrt(np.mean((self.rows.Y @ what.chi) ** 2, axis=0))
        joints = [
            DesignedJoint(
                joint=j + 1,
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
        payload, sizes = self.payload(weight), dict(zip(SHAPES[weight.shape], weight.dimensions, strict=True))
        made = {"shape": weight.shape, "dimensions_mm": sizes, "turned_deg": 90 * weight.quarter}
        effect = dict(self.effect(Carried.nominal(payload), payload))
        return DesignedWeight.model_validate({**effect, **made, "refusal": self.refusal(weight)})


def design_payload(
    setup: Setup, *, density: float, seed: int, tell: Callable[[int, Callable[[], str]], None]
) -> PayloadDesign:
    """Search for the best payload of every shape along a scenario's motion, of a density [kg/m^3].

    `tell` receives the completed number of `STEPS`, and the current shape. Raises `ScenarioError` if the scenario
    mounts no payload, or none is feasible.
    """
    payloads = PayloadSearch(setup, density)
    found = list[tuple[bool, float, DesignedWeight]]()
    for number, shape in enumerate(SHAPES):
        weight = payloads.best(
            shape, seed, lambda share, at=number, of=shape: tell(round(100 * (at + share)), lambda: of)
        )
        deviations, each = payloads.predict(Carried.nominal(payloads.payload(weight))), payloads.candidate(weight)
        found.append((each.refusal is not None, objective(deviations.total), each))
    first, *_ = candidates = [each for *_, each in sorted(found, key=lambda row: row[:2])]
    if first.refusal is not None:
        said = f"no payload meets the limits: the best {first.shape} {first.refusal}"
        raise ScenarioError(f"{setup.scenario.name}: {said}")
    before = payloads.effect(payloads.design.carried, payloads.own)
    return PayloadDesign(
        scenario=setup.scenario.name,
        residual=RESIDUAL,
        rated_load=finite(payloads.most),
        own_is_better=before.worst <= first.worst,
        flange=payloads.flange.name or None,
        before=before,
        candidates=candidates,
    )
