"""Payloads that a workshop can make from bar, plate and block, with the uncertainty of manufacture and mounting.

Dimensions are in millimetres; z points out of the flange, and x is the direction of the offset. Screws and their holes
are neglected.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.payload.payload import Payload
from ident.support.arrays import Array
from sim.shapes import Flange, Solid

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


@dataclass(frozen=True, slots=True)
class Part:
    """A box, or a cylinder about z: its extent along x, y, z and its centre [mm]."""

    cylinder: bool
    edges: tuple[float, float, float]
    center: tuple[float, float, float]

    @property
    def volume(self) -> float:
        """[m^3]."""
        return float(np.prod(self.edges)) * (np.pi / 4.0 if self.cylinder else 1.0) * MM**3

    @property
    def gyration(self) -> Array:
        """Moments of inertia about its centre per unit mass [m^2], shape (3,)."""
        square = (MM * np.array(self.edges)) ** 2 / np.array((16.0, 16.0, 12.0) if self.cylinder else (12.0,) * 3)
        return square.sum() - square


def _cylinder(d: Sequence[float]) -> tuple[Part, ...]:
    diameter, length, offset = d
    return (Part(True, (diameter, diameter, length), (offset, 0.0, length / 2.0)),)


def _plate(d: Sequence[float]) -> tuple[Part, ...]:
    length, width, thickness, offset = d
    return (Part(False, (length, width, thickness), (offset, 0.0, thickness / 2.0)),)


def _bar(d: Sequence[float]) -> tuple[Part, ...]:
    side, length, offset = d
    reach = FACE + max(FACE, offset + side / 2.0)
    return (
        Part(False, (reach, max(2.0 * FACE, side), BRACKET), (reach / 2.0 - FACE, 0.0, BRACKET / 2.0)),
        Part(False, (side, side, length), (offset, 0.0, BRACKET + length / 2.0)),
    )


SHAPES: Mapping[str, tuple[Callable[[Sequence[float]], tuple[Part, ...]], Mapping[str, tuple[int, int]]]] = {
    "cylinder": (_cylinder, {"diameter": (63, 300), "length": (10, 300), "offset": (0, 118)}),
    "plate": (_plate, {"length": (63, 600), "width": (63, 300), "thickness": (5, 60), "offset": (0, 268)}),
    "bar": (_bar, {"side": (20, 120), "length": (40, 300), "offset": (0, 250)}),
}
"""A cylinder or a plate on the flange, a square bar on a bracket: parts, and dimensions with bounds [mm]."""


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
        return dict(zip(SHAPES[self.shape][1], self.dimensions, strict=True))

    @property
    def parts(self) -> tuple[Part, ...]:
        """Parts in the payload's axes; the first is on the flange."""
        return SHAPES[self.shape][0](self.dimensions)

    @property
    def uncovered(self) -> float:
        """Width of the flange's face that the payload leaves free [mm]."""
        part = self.parts[0]
        return max(round(part.center[0] + FACE - part.edges[0] / 2.0, 6), 0.0)

    @property
    def mass(self) -> float:
        """[kg]."""
        return self.density * sum(part.volume for part in self.parts)

    @property
    def turned(self) -> Array:
        """Rotation matrix from the payload's to the flange's axes, shape (3, 3)."""
        c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[self.quarter % 4]
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    def moments(self, rotation: Array, origin: Array) -> Array:
        """Return centre of mass and inertia in another frame (Huygens-Steiner).

        Args:
            rotation: Rotation matrix from the payload's axes to those of the frame, shape (3, 3).
            origin: Centre of the flange's face [m], shape (3,).

        Returns:
            Centre [m], then ixx, iyy, izz, ixy, ixz, iyz about it [kg m^2], shape (9,).
        """
        masses = self.density * np.array([part.volume for part in self.parts])
        centers = MM * np.array([part.center for part in self.parts])
        com = masses @ centers / masses.sum()
        inertia = np.zeros((3, 3))
        for m, part, r in zip(masses, self.parts, centers - com, strict=True):
            inertia += m * (np.diag(part.gyration) + r @ r * np.eye(3) - np.outer(r, r))
        J = rotation @ inertia @ rotation.T
        return np.array([*(origin + rotation @ com), J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]])


def dimension_std(size_mm: float) -> float:
    """Return the standard deviation of a dimension [mm]: uniform within its tolerance."""
    return next(tolerance for most, tolerance in MEDIUM if size_mm <= most) / np.sqrt(3.0)


def payload_of(weight: Weight, flange: Flange) -> Payload:
    """Return the payload for identification, in the frame of the last link: weighed, other values nominal.

    Standard deviations are those of manufacture, for the weighed mass, and of mounting.
    """

    def made(change: Array, seat: Sequence[float] = (0.0, 0.0), turn: float = 0.0) -> Array:
        """Return the numbers of a payload with deviations of dimensions and mounting, of the nominal mass."""
        off = replace(weight, dimensions=tuple((np.array(weight.dimensions) + change).tolist()))
        c, s = np.cos(turn), np.sin(turn)
        across = weight.turned @ np.array([*seat, 0.0])
        rotation = flange.rotation @ weight.turned @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        moments = off.moments(rotation, flange.origin + MM * flange.rotation @ across)
        moments[3:] *= weight.mass / off.mass
        return moments

    none = np.zeros(len(weight.dimensions))
    values = made(none)
    others = [made(step) for step in np.diag([dimension_std(size) for size in weight.dimensions])]
    others += [*(made(none, seat) for seat in (SEAT_MM * np.eye(2)).tolist()), made(none, turn=TURN)]
    std = np.linalg.norm(np.array(others) - values, axis=0).tolist()
    x, y, z, *inertia = values.tolist()
    ixx, iyy, izz, ixy, ixz, iyz = inertia
    return Payload(
        mass=weight.mass,
        mass_std=MASS_STD,
        com=(x, y, z),
        com_std=(std[0], std[1], std[2]),
        inertia=(ixx, iyy, izz, ixy, ixz, iyz),
        inertia_std=tuple(std[3:]),
        known="all",
    )


def solids(weight: Weight, flange: Flange) -> tuple[Solid, ...]:
    """Return its parts in the frame of the last link."""
    rotation = flange.rotation @ weight.turned
    return tuple(
        Solid(
            cylinder=part.cylinder,
            size=tuple(MM / 2.0 * edge for edge in (part.edges[1:] if part.cylinder else part.edges)),
            center=flange.origin + rotation @ (MM * np.array(part.center)),
            rotation=rotation,
        )
        for part in weight.parts
    )
