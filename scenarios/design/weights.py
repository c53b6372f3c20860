"""Weights that a workshop makes from bar, plate and block, by the dimensions on a drawing.

Dimensions are in millimetres, as on a drawing; z points out of the flange and x to where the weight is offset. Screws
and their holes are left out.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ident.support.arrays import Array

FACE = 31.5
"""Radius of the flange's face [mm]: ISO 9409-1-50-4-M6, as on arms that carry 3 to 15 kg; assumed of every robot."""
BRACKET = 15.0
"""Thickness of a bracket [mm]."""
MM = 1e-3


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
class Dimension:
    """A dimension of a drawing.

    Attributes:
        name: What it is.
        least: [mm].
        most: [mm].
    """

    name: str
    least: int
    most: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """A kind of weight.

    Attributes:
        dimensions: What a drawing states.
        parts: The parts, from the dimensions in their order [mm].
        missing: By how much the weight fails to cover the flange's face [mm], 0 or less where it does.
    """

    dimensions: tuple[Dimension, ...]
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
        dimensions=(
            Dimension(name="diameter", least=63, most=300),
            Dimension(name="length", least=10, most=300),
            Dimension(name="offset", least=0, most=118),
        ),
        parts=_cylinder,
        missing=lambda d: d[2] + FACE - d[0] / 2.0,
    ),
    "plate": Shape(
        dimensions=(
            Dimension(name="length", least=63, most=600),
            Dimension(name="width", least=63, most=300),
            Dimension(name="thickness", least=5, most=60),
            Dimension(name="offset", least=0, most=268),
        ),
        parts=_plate,
        missing=lambda d: d[3] + FACE - d[0] / 2.0,
    ),
    "bar": Shape(
        dimensions=(
            Dimension(name="side", least=20, most=120),
            Dimension(name="length", least=40, most=300),
            Dimension(name="offset", least=0, most=250),
        ),
        parts=_bar,
        missing=lambda d: 0.0,
    ),
}
"""Kinds of weights: a cylinder or a plate on the flange, a square bar standing on a bracket."""


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
    def parts(self) -> tuple[Part, ...]:
        """In the weight's own axes."""
        return SHAPES[self.shape].parts(self.dimensions)

    @property
    def turned(self) -> Array:
        """The weight's axes as columns in the flange's, shape (3, 3)."""
        c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[self.quarter % 4]
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


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
        return MassProperties(
            mass=self.mass, com=origin + rotation @ self.com, inertia=rotation @ self.inertia @ rotation.T
        )


def mass_properties(parts: Sequence[Part], density: float) -> MassProperties:
    """Of parts of one material, in the axes that they are drawn in (Huygens-Steiner)."""
    masses = np.array([density * part.volume for part in parts])
    centers = MM * np.array([part.center for part in parts])
    mass = float(masses.sum())
    com = masses @ centers / mass
    inertia = np.zeros((3, 3))
    for m, part, center in zip(masses, parts, centers - com, strict=True):
        inertia += m * (np.diag(part.gyration) + center @ center * np.eye(3) - np.outer(center, center))
    return MassProperties(mass=mass, com=com, inertia=inertia)
