"""Weights that a workshop makes from bar, plate and block, by the dimensions on a drawing, and how well they are known.

Dimensions are in millimetres, as on a drawing; z points out of the flange and x to where the weight is offset. Screws
and their holes are left out.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.payload.payload import Payload
from ident.support.arrays import Array
from sim.clearance import Solid
from sim.flange import Flange

FACE = 31.5
"""Radius of the flange's face [mm]: ISO 9409-1-50-4-M6, as on arms that carry 3 to 15 kg; assumed of every robot."""
BRACKET = 15.0
"""Thickness of a bracket [mm]."""
MM = 1e-3
MASS_STD = 0.025
"""Of a weighing machine as the paper's [kg]: +-0.050 kg read as two standard deviations."""
MEDIUM = ((6.0, 0.1), (30.0, 0.2), (120.0, 0.3), (400.0, 0.5), (np.inf, 0.8))
"""Tolerance [mm] of dimensions up to a size [mm]: ISO 2768-1, class m."""
SEAT_MM = 0.1
"""Deviation of where a weight sits on the flange, across its axis, each way [mm]; assumed of dowel pins."""
TURN = np.deg2rad(0.1)
"""Deviation of its turn about the flange's axis [rad]; assumed of dowel pins."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """A box or a cylinder of one material, its axes those of the flange.

    Attributes:
        cylinder: Whether it is a cylinder about its z, else a box.
        size: Diameter and length, or edges along x, y, z [mm].
        center: [mm].
    """

    cylinder: bool
    size: tuple[float, ...]
    center: tuple[float, float, float]

    @property
    def edges(self) -> tuple[float, float, float]:
        """Extent along x, y and z [mm]."""
        a, b, c = (self.size[0], *self.size) if self.cylinder else self.size
        return a, b, c

    @property
    def volume(self) -> float:
        """[m^3]."""
        across = np.pi / 4.0 * self.size[0] ** 2 if self.cylinder else self.size[0] * self.size[1]
        return float(across * self.size[-1]) * MM**3

    @property
    def gyration(self) -> Array:
        """Moments of inertia about its own centre, a unit mass [m^2], shape (3,)."""
        if self.cylinder:
            diameter, length = self.size
            side = diameter**2 / 16.0 + length**2 / 12.0
            return MM**2 * np.array([side, side, diameter**2 / 8.0])
        a, b, c = (edge**2 / 12.0 for edge in self.size)
        return MM**2 * np.array([b + c, a + c, a + b])


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """A kind of weight.

    Attributes:
        dimensions: What a drawing states, with the least and the most [mm].
        parts: The parts, from the dimensions in their order [mm].
        missing: By how much the weight fails to cover the flange's face [mm], 0 or less where it does.
    """

    dimensions: Mapping[str, tuple[int, int]]
    parts: Callable[[Sequence[float]], tuple[Part, ...]]
    missing: Callable[[Sequence[float]], float]


def _cylinder(d: Sequence[float]) -> tuple[Part, ...]:
    diameter, length, offset = d
    return (Part(cylinder=True, size=(diameter, length), center=(offset, 0.0, length / 2.0)),)


def _plate(d: Sequence[float]) -> tuple[Part, ...]:
    length, width, thickness, offset = d
    return (Part(cylinder=False, size=(length, width, thickness), center=(offset, 0.0, thickness / 2.0)),)


def _bar(d: Sequence[float]) -> tuple[Part, ...]:
    side, length, offset = d
    reach = FACE + max(FACE, offset + side / 2.0)
    bracket = (reach, max(2.0 * FACE, side), BRACKET)
    return (
        Part(cylinder=False, size=bracket, center=(reach / 2.0 - FACE, 0.0, BRACKET / 2.0)),
        Part(cylinder=False, size=(side, side, length), center=(offset, 0.0, BRACKET + length / 2.0)),
    )


SHAPES: Mapping[str, Shape] = {
    "cylinder": Shape(
        dimensions={"diameter": (63, 300), "length": (10, 300), "offset": (0, 118)},
        parts=_cylinder,
        missing=lambda d: d[2] + FACE - d[0] / 2.0,
    ),
    "plate": Shape(
        dimensions={"length": (63, 600), "width": (63, 300), "thickness": (5, 60), "offset": (0, 268)},
        parts=_plate,
        missing=lambda d: d[3] + FACE - d[0] / 2.0,
    ),
    "bar": Shape(
        dimensions={"side": (20, 120), "length": (40, 300), "offset": (0, 250)}, parts=_bar, missing=lambda d: 0.0
    ),
}
"""Kinds of weights: a cylinder or a plate on the flange, a square bar standing on a bracket."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MassProperties:
    """Of a weight.

    Attributes:
        mass: [kg].
        com: Centre of mass [m], shape (3,).
        inertia: About the centre of mass [kg m^2], shape (3, 3).
    """

    mass: float
    com: Array
    inertia: Array

    def seen(self, rotation: Array, origin: Array) -> "MassProperties":
        """In another frame, where this one has its origin and its axes as columns."""
        return replace(self, com=origin + rotation @ self.com, inertia=rotation @ self.inertia @ rotation.T)


@dataclass(frozen=True, slots=True, kw_only=True)
class Weight:
    """A weight as drawn.

    Attributes:
        shape: Of `SHAPES`.
        dimensions: [mm], in the shape's order.
        quarter: Quarter turns about z from the flange's x to the weight's: its four screws allow no others.
        density: [kg/m^3].
    """

    shape: str
    dimensions: tuple[float, ...]
    quarter: int
    density: float

    @property
    def named(self) -> dict[str, float]:
        """Dimensions by their names [mm]."""
        return dict(zip(SHAPES[self.shape].dimensions, self.dimensions, strict=True))

    @property
    def stated(self) -> str:
        """Dimensions as a drawing states them, in words."""
        return ", ".join(f"{name} {size:g}" for name, size in self.named.items())

    @property
    def parts(self) -> tuple[Part, ...]:
        """In the weight's own axes."""
        return SHAPES[self.shape].parts(self.dimensions)

    @property
    def turned(self) -> Array:
        """The weight's axes as columns in the flange's, shape (3, 3)."""
        c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[self.quarter % 4]
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    @property
    def properties(self) -> MassProperties:
        """In the weight's own axes (Huygens-Steiner)."""
        masses = np.array([self.density * part.volume for part in self.parts])
        centers = MM * np.array([part.center for part in self.parts])
        mass = float(masses.sum())
        com = masses @ centers / mass
        inertia = np.zeros((3, 3))
        for m, part, center in zip(masses, self.parts, centers - com, strict=True):
            inertia += m * (np.diag(part.gyration) + center @ center * np.eye(3) - np.outer(center, center))
        return MassProperties(mass=mass, com=com, inertia=inertia)


def dimension_std(size_mm: float) -> float:
    """Standard deviation of a dimension [mm]: its tolerance, any value within being as likely."""
    return next(tolerance for most, tolerance in MEDIUM if size_mm <= most) / np.sqrt(3.0)


def payload_of(weight: Weight, flange: Flange) -> Payload:
    """A weight as identification may be told of it: weighed, its centre and inertia from the drawing.

    Deviations are those of making it within tolerances, where what is weighed sets the mass, and of mounting it.
    """

    def made(change: Array, seat: Sequence[float] = (0.0, 0.0), turn: float = 0.0) -> MassProperties:
        """In the frame of the last link, made and mounted a little off."""
        off = replace(weight, dimensions=tuple((np.array(weight.dimensions) + change).tolist()))
        c, s = np.cos(turn), np.sin(turn)
        rotation = weight.turned @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return off.properties.seen(rotation, MM * np.array([*seat, 0.0])).seen(flange.rotation, flange.origin)

    def numbers(found: MassProperties) -> Array:
        """Centre, then ixx, iyy, izz, ixy, ixz, iyz, shape (9,)."""
        J = found.inertia
        return np.array([*found.com, J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]])

    none = np.zeros(len(weight.dimensions))
    nominal = made(none)
    as_made = [made(step) for step in np.diag([dimension_std(size) for size in weight.dimensions])]
    others = [replace(each, inertia=each.inertia * nominal.mass / each.mass) for each in as_made]
    others += [*(made(none, seat) for seat in (SEAT_MM * np.eye(2)).tolist()), made(none, turn=TURN)]
    values = numbers(nominal)
    std = np.linalg.norm([numbers(each) - values for each in others], axis=0)
    x, y, z, ixx, iyy, izz, ixy, ixz, iyz = values.tolist()
    return Payload(
        mass=nominal.mass,
        mass_std=MASS_STD,
        com=(x, y, z),
        com_std=(float(std[0]), float(std[1]), float(std[2])),
        inertia=(ixx, iyy, izz, ixy, ixz, iyz),
        inertia_std=tuple(std[3:].tolist()),
        known="all",
    )


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
