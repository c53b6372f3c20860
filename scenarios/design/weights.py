"""Payloads that a workshop can manufacture from bar, plate and block, and their uncertainty.

Dimensions are in millimetres; z points out of the flange, and x is the direction of the offset. Screws and their holes
are neglected.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.payload.payload import Payload
from ident.support.arrays import Array
from sim.clearance import Solid
from sim.flange import Flange

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """A box or a cylinder with axes parallel to those of the flange.

    Attributes:
        cylinder: Whether the shape is a cylinder about its z axis, otherwise a box.
        size: Diameter and length, or edges along x, y, z [mm].
        center: Centre [mm].
    """

    cylinder: bool
    size: tuple[float, ...]
    center: tuple[float, float, float]

    @property
    def edges(self) -> tuple[float, float, float]:
        """Return the extent along x, y and z [mm]."""
        a, b, c = (self.size[0], *self.size) if self.cylinder else self.size
        return a, b, c

    @property
    def volume(self) -> float:
        """[m^3]."""
        across = np.pi / 4.0 * self.size[0] ** 2 if self.cylinder else self.size[0] * self.size[1]
        return float(across * self.size[-1]) * MM**3

    @property
    def gyration(self) -> Array:
        """Moments of inertia about its centre per unit mass [m^2], shape (3,)."""
        if self.cylinder:
            diameter, length = self.size
            side = diameter**2 / 16.0 + length**2 / 12.0
            return MM**2 * np.array([side, side, diameter**2 / 8.0])
        a, b, c = (edge**2 / 12.0 for edge in self.size)
        return MM**2 * np.array([b + c, a + c, a + b])


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """A shape of payload.

    Attributes:
        dimensions: Dimensions with lower and upper bounds [mm].
        parts: Returns the parts, from the dimensions in order [mm].
        missing: Returns the width by which the payload does not cover the flange's face [mm], at most 0 if it does.
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
"""Shapes: a cylinder or a plate on the flange, a square bar on a bracket."""


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
        """Return the mass properties in another frame; `rotation` has this frame's axes as columns."""
        return replace(self, com=origin + rotation @ self.com, inertia=rotation @ self.inertia @ rotation.T)


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
    def named(self) -> dict[str, float]:
        """Dimensions by name [mm]."""
        return dict(zip(SHAPES[self.shape].dimensions, self.dimensions, strict=True))

    @property
    def stated(self) -> str:
        """Dimensions as text."""
        return ", ".join(f"{name} {size:g}" for name, size in self.named.items())

    @property
    def parts(self) -> tuple[Part, ...]:
        """Parts in the payload's axes."""
        return SHAPES[self.shape].parts(self.dimensions)

    @property
    def turned(self) -> Array:
        """Rotation matrix from the payload's to the flange's axes, shape (3, 3)."""
        c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[self.quarter % 4]
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    @property
    def properties(self) -> MassProperties:
        """Mass moments in the payload's axes (Huygens-Steiner)."""
        masses = np.array([self.density * part.volume for part in self.parts])
        centers = MM * np.array([part.center for part in self.parts])
        mass = float(masses.sum())
        com = masses @ centers / mass
        inertia = np.zeros((3, 3))
        for m, part, center in zip(masses, self.parts, centers - com, strict=True):
            inertia += m * (np.diag(part.gyration) + center @ center * np.eye(3) - np.outer(center, center))
        return MassProperties(mass=mass, com=com, inertia=inertia)


def dimension_std(size_mm: float) -> float:
    """Return the standard deviation of a dimension [mm]: uniform within its tolerance."""
    return next(tolerance for most, tolerance in MEDIUM if size_mm <= most) / np.sqrt(3.0)


def payload_of(weight: Weight, flange: Flange) -> Payload:
    """Return the payload for identification: weighed, with centre and inertia from the drawing.

    Standard deviations include tolerances of manufacture, for the weighed mass, and of mounting.
    """

    def made(change: Array, seat: Sequence[float] = (0.0, 0.0), turn: float = 0.0) -> MassProperties:
        """Return the payload in the frame of the last link, with deviations of manufacture and mounting."""
        off = replace(weight, dimensions=tuple((np.array(weight.dimensions) + change).tolist()))
        c, s = np.cos(turn), np.sin(turn)
        rotation = weight.turned @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return off.properties.seen(rotation, MM * np.array([*seat, 0.0])).seen(flange.rotation, flange.origin)

    def numbers(found: MassProperties) -> Array:
        """Return centre, then ixx, iyy, izz, ixy, ixz, iyz, shape (9,)."""
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
    """Return its parts in the frame of the last link."""
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
