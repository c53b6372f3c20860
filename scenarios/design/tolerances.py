"""How well a weight is known that is made from a drawing and weighed."""

import numpy as np

from ident.payload.payload import Payload
from ident.support.arrays import Array
from scenarios.design.weights import MM, MassProperties, Weight, mass_properties
from sim.flange import Flange

MASS_STD = 0.025
"""Of a weighing machine as the paper's [kg]: +-0.050 kg read as two standard deviations."""
MEDIUM = ((6.0, 0.1), (30.0, 0.2), (120.0, 0.3), (400.0, 0.5), (np.inf, 0.8))
"""Tolerance [mm] of dimensions up to a size [mm]: ISO 2768-1, class m."""
SEAT_MM = 0.1
"""Deviation of where a weight sits on the flange, across its axis, each way [mm]; assumed of dowel pins."""
TURN = np.deg2rad(0.1)
"""Deviation of its turn about the flange's axis [rad]; assumed of dowel pins."""


def dimension_std(size_mm: float) -> float:
    """Standard deviation of a dimension [mm]: its tolerance, any value within being as likely."""
    return next(tolerance for most, tolerance in MEDIUM if size_mm <= most) / np.sqrt(3.0)


def payload_of(weight: Weight, flange: Flange) -> Payload:
    """A weight as identification may be told of it: weighed, its centre and inertia from the drawing."""
    drawn = _seen(weight, flange, np.zeros(len(weight.dimensions)), np.zeros(2), 0.0)
    values = _numbers(drawn)
    changes: list[Array] = []
    none = np.zeros(len(weight.dimensions))
    for k, size in enumerate(weight.dimensions):
        change = none.copy()
        change[k] = dimension_std(size)
        off = _seen(weight, flange, change, np.zeros(2), 0.0)
        changes.append(_numbers(_weighed(off, drawn.mass)) - values)
    for seat in SEAT_MM * np.eye(2):
        changes.append(_numbers(_seen(weight, flange, none, seat, 0.0)) - values)
    changes.append(_numbers(_seen(weight, flange, none, np.zeros(2), TURN)) - values)
    std = np.linalg.norm(changes, axis=0)
    ixx, iyy, izz, ixy, ixz, iyz = values[3:].tolist()
    return Payload(
        mass=drawn.mass,
        mass_std=MASS_STD,
        com=(float(values[0]), float(values[1]), float(values[2])),
        com_std=(float(std[0]), float(std[1]), float(std[2])),
        inertia=(ixx, iyy, izz, ixy, ixz, iyz),
        inertia_std=tuple(std[3:].tolist()),
        known="all",
    )


def _seen(weight: Weight, flange: Flange, change: Array, seat: Array, turn: float) -> MassProperties:
    """Mass properties in the frame of the last link, of a weight that is made and mounted a little off."""
    made = Weight(
        shape=weight.shape,
        dimensions=tuple((np.array(weight.dimensions) + change).tolist()),
        quarter=weight.quarter,
        density=weight.density,
    )
    c, s = np.cos(turn), np.sin(turn)
    rotation = weight.turned @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    on_flange = mass_properties(made.parts, made.density).seen(rotation, MM * np.append(seat, 0.0))
    return on_flange.seen(flange.rotation, flange.origin)


def _weighed(properties: MassProperties, mass: float) -> MassProperties:
    """The same shape with the mass that the scale says."""
    return MassProperties(mass=mass, com=properties.com, inertia=properties.inertia * mass / properties.mass)


def _numbers(properties: MassProperties) -> Array:
    """Centre, then ixx, iyy, izz, ixy, ixz, iyz, shape (9,)."""
    J = properties.inertia
    return np.array([*properties.com, J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]])
